"""How smooth spectra are, by predicting wavelengths that are held out."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import numpy as np
from jaxtyping import Float

from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.fitting.exclusion import fit_near, objective_of, solution_of, without
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.result import FitResult
from jaxink.numerics.precision import computing
from jaxink.sample import ParameterTable, Sample

# Of the declared change, in steps of a factor of three.
FACTORS = (1 / 27, 1 / 9, 1 / 3, 1.0, 3.0, 9.0, 27.0)
# The first and the last wavelength would be extrapolated.
_FEWEST = 4


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SmoothnessChoice(Presented):
    """Misfit of held-out wavelengths for each strength of the smoothness.

    Parameters
    ----------
    factors
        Of the declared ``change`` of every quantity with a smoothness, ascending.
    misfits
        Mean square of measured minus predicted, in standard deviations of the noise, over the points of each
        wavelength between the first and the last when these are left out of the fit.
    sample
        The sample with the best ``change``.
    """

    factors: tuple[float, ...]
    misfits: Float[np.ndarray, " factors"]
    sample: Sample

    @property
    def best(self) -> float:
        """The factor of least misfit."""
        return self.factors[int(np.argmin(self.misfits))]

    @property
    def is_open(self) -> bool:
        """Whether the best is the first or the last, so that others beyond may be better."""
        return self.best in (self.factors[0], self.factors[-1])

    def card(self) -> Card:
        """The misfit of each factor."""
        rows = [[f"{f:.3g}", f"{m:.4g}"] for f, m in zip(self.factors, self.misfits, strict=True)]
        table = CardTable(["factor of change", "misfit of held-out wavelengths"], rows, ())
        remarks = ["The best is at the end of the factors; try others beyond it."] if self.is_open else []
        return Card(f"Smoothness: {self.best:.3g} times the declared change", (), (table,), remarks)


def choose_smoothness(result: FitResult, factors: Sequence[float] = FACTORS) -> SmoothnessChoice:
    """Choose the strength of the smoothness of spectra by wavelengths that are held out.

    For each factor of the declared ``change``, each wavelength but the first and the last is left out of the
    fit, its values then follow from those beside it, and the prediction there is compared with the
    measurement. One compiled program serves all of these fits.

    Parameters
    ----------
    result
        A fit by chi-square whose sample declares a smoothness.
    factors
        Factors of the declared change, above 0.

    Raises
    ------
    InputRefusedError
        If no free quantity has a smoothness, there are fewer than four wavelengths, or a factor is not
        positive.
    NotFiniteError
        See `jaxink.fitting.exclusion.fit_near`.

    References
    ----------
    Stone 1974 J. R. Stat. Soc. B 36, 111 (cross-validation).
    """
    tried = tuple(sorted(map(float, factors)))
    if not tried or not tried[0] > 0:
        raise InputRefusedError("the factors of the smoothness must be numbers above 0, at least one.")
    if not any(p.smoothness for p in result.sample.parameters.free):
        raise InputRefusedError(
            "no free quantity has a smoothness; write smoothness = { change = ..., over_nm = ... } beside "
            "its per_wavelength, and fit again."
        )
    waves = np.unique(result.data.wavelength_nm[result.data.used])
    if len(waves) < _FEWEST:
        raise InputRefusedError(
            f"the fit has {len(waves)} wavelengths; at least {_FEWEST} are needed to hold some out."
        )
    objective = objective_of(result)
    # A difference of two neighbours, as `priors_of` makes them; priors have one weight each.
    is_smooth = (objective.prior_weights != 0).sum(axis=1) == 2
    at_wave = result.data.wavelength_nm[result.data.used]
    misfits = []
    with computing():
        search, start = GradientSearch(objective), solution_of(objective, result)
        for factor in tried:
            deviation = np.where(is_smooth, factor, 1.0) * objective.prior_deviation
            scaled = eqx.tree_at(lambda o: o.prior_deviation, objective, deviation)
            end = search.on(scaled).linearised(start)
            total = 0.0
            for wave in waves[1:-1]:
                out = at_wave == wave
                rest = without(scaled, out)
                predicted = np.asarray(fit_near(search.on(rest), rest, end).predicted)
                total += float(np.sum(((objective.measured - predicted) / objective.sigma)[out] ** 2))
            misfits.append(total / np.isin(at_wave, waves[1:-1]).sum())
    best = tried[int(np.argmin(misfits))]
    return SmoothnessChoice(tried, np.array(misfits), _with_factor(result.sample, best))


def _with_factor(sample: Sample, factor: float) -> Sample:
    table = ParameterTable(
        [
            dataclasses.replace(
                p, smoothness=dataclasses.replace(p.smoothness, change=factor * p.smoothness.change)
            )
            if p.smoothness
            else p
            for p in sample.parameters.values()
        ]
    )
    return dataclasses.replace(sample, parameters=table)
