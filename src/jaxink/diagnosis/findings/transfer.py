"""The final model of a diagnosis applied to another measurement, refitted or unchanged."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.diagnosis.search.refit import Estimate, estimates
from jaxink.diagnosis.search.workbench import Workbench
from jaxink.display.brief import brief_repr
from jaxink.display.named_rows import NamedRows
from jaxink.effects import Scene
from jaxink.fitting import prepare_data
from jaxink.measurement import GonioData, noise_of
from jaxink.numerics.precision import computing


@dataclasses.dataclass(frozen=True)
class Transfer:
    """A model applied to a measurement other than the one it was found on.

    Parameters
    ----------
    data
        The measurement; points that are not used are masked.
    values
        Of all parameters.
    standard_errors
        Of the refitted parameters; None for those at a bound.
    predicted_per_sr, whitened
        At the used points; `whitened` in units of the noise, without the weights of the sample file.
    """

    data: GonioData
    values: dict[str, float]
    standard_errors: dict[str, float | None]
    predicted_per_sr: Float[np.ndarray, " points"]
    whitened: Float[np.ndarray, " points"]

    __repr__ = brief_repr

    @property
    def parameters(self) -> NamedRows[Estimate]:
        """All parameters with the standard errors of those refitted."""
        return NamedRows({n: Estimate(v, self.standard_errors.get(n)) for n, v in self.values.items()})


def transfer(diagnosis: Diagnosis, data: GonioData, is_refitted: bool) -> Transfer:
    """Predict a measurement with the final model of a diagnosis.

    Parameters
    ----------
    diagnosis
        Of another measurement of the same kind of sample.
    data
        May have other wavelengths, unless the sample has parameters given by wavelength.
    is_refitted
        Whether to refit all free parameters or to keep their values.

    Raises
    ------
    InputRefusedError
        The sample is not defined at the wavelengths of the data, or the noise is unknown.
    """
    wavelengths = tuple(np.unique(data.wavelength_nm).tolist())
    sample = dataclasses.replace(diagnosis.result.sample, wavelengths_nm=wavelengths)
    data = prepare_data(data, sample)
    used = data.used
    terms = tuple(t.name for e in diagnosis.effects for t in e.terms)
    found = diagnosis.parameters_after
    with computing():
        scene = Scene.of(*data.used_directions, time=data.row[used])
        config = diagnosis.result.config
        n_slots = max(len(found), 1)
        bench = Workbench(
            sample, diagnosis.effects, data, noise_of(data, sample.noise), config, scene, n_slots
        )
        values = bench.start | {name: value for name, (value, _) in found.items()}
        errors: dict[str, float | None] = {}
        if is_refitted:
            solution = bench.fit(values, (*bench.base_free, *terms))
            values, predicted = solution.values, solution.predicted_per_sr
            errors = {name: found.standard_error for name, found in estimates(bench, solution).items()}
        else:
            predicted = bench.predict(values)
        left = bench.in_noise(predicted, bench.measured - predicted)
    return Transfer(data, values, errors, predicted, left)
