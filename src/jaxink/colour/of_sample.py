"""Spectra of a sample in any geometries, differentiable in its parameters, and their colours."""

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.colour.coordinates import Colour
from jaxink.colour.geometry import Geometry, readings_at
from jaxink.colour.viewing import Illuminant, Viewing
from jaxink.errors import InputRefusedError
from jaxink.model import ForwardModel, ReadingsModel
from jaxink.numerics.precision import computing
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY

GEOMETRIES = ("45:0", "8:di", "8:de")


@dataclasses.dataclass(frozen=True)
class ParameterCovariance:
    """A covariance of parameters.

    Parameters
    ----------
    names, matrix
        The parameters, and their covariance in their units.
    """

    names: tuple[str, ...]
    matrix: Float[np.ndarray, "parameters parameters"]


class _Models(eqx.Module):
    """Models of the readings, and of the pairs of directions through the sample."""

    readings: ReadingsModel | None
    through: ForwardModel | None

    def spectra(self, values: Mapping) -> Float[Array, " all"]:
        parts = [] if self.readings is None else [self.readings.bsdf(values)]
        parts += [] if self.through is None else [jnp.pi * self.through.bsdf(values)]
        return jnp.concatenate(parts)


@eqx.filter_jit
def _compiled(models: _Models, values: Mapping):
    return models.spectra(values)


@eqx.filter_jit
def _compiled_slopes(models: _Models, values: Mapping, directions: Mapping):
    return jax.vmap(lambda along: jax.jvp(models.spectra, (values,), (along,))[1])(directions)


class SampleSpectra:
    """Reflectance factors, reflectances and transmittances of a sample, at any values of its parameters.

    Cones, beam and field of view of the goniometer that the sample describes do not count: light is
    parallel, and all of it is collected.

    Parameters
    ----------
    sample
        The sample.
    geometries
        Geometries, see `Geometry.of`.
    wavelength_nm
        Wavelengths, ascending.
    accuracy
        Largest relative error of the discretisation.

    Raises
    ------
    InputRefusedError
        If the sample cannot be predicted, or declares effects, which are known for goniometers only.
    """

    def __init__(
        self,
        sample: Sample,
        geometries: Sequence[str | Geometry],
        wavelength_nm: Sequence[float] | Float[np.ndarray, " wavelengths"],
        accuracy: float = DEFAULT_ACCURACY,
    ):
        self.geometries = tuple(Geometry.of(one) for one in geometries)
        if not self.geometries:
            raise InputRefusedError(f"no geometry is given; give one or more, such as {GEOMETRIES[0]}.")
        self.wavelength_nm = np.asarray(wavelength_nm, float)
        self.sample = dataclasses.replace(
            sample,
            source_half_angle_deg=0.0,
            detector_half_angle_deg=0.0,
            beam_diameter_mm=None,
            detector_diameter_mm=None,
        )
        readings = readings_at(self.geometries, self.wavelength_nm)
        through = [g for g in self.geometries if g.quantity is None]
        with computing():
            self._models = _Models(
                None if readings is None else ReadingsModel(self.sample, readings, accuracy=accuracy),
                self._through(through, accuracy) if through else None,
            )

    def _through(self, geometries: list[Geometry], accuracy: float) -> ForwardModel:
        size = len(self.wavelength_nm)
        theta_i, theta_o, phi = (
            np.repeat([getattr(g, key) for g in geometries], size)
            for key in ("theta_i_deg", "theta_o_deg", "phi_deg")
        )
        wave = np.tile(self.wavelength_nm, len(geometries))
        behind = np.ones(len(wave), bool)
        return ForwardModel(self.sample, theta_i, theta_o, phi, wave, behind, accuracy=accuracy)

    @cached_property
    def _start(self) -> dict[str, float]:
        """Values of the parameters that are not tied."""
        return {name: p.value for name, p in self.sample.parameters.items() if p.tie is None}

    def _shaped(self, flat) -> np.ndarray:
        """In the order of the geometries; those with a quantity come first in the models."""
        order = np.argsort([g.quantity is None for g in self.geometries], kind="stable")
        parts = np.asarray(flat).reshape(*np.shape(flat)[:-1], len(order), len(self.wavelength_nm))
        shaped = np.empty_like(parts)
        shaped[..., order, :] = parts
        return shaped

    def at(self, values: Mapping[str, float] | None = None) -> Float[np.ndarray, "geometries wavelengths"]:
        """The spectra; ``values`` by name take the place of those of the sample's table."""
        with computing():
            given = {n: jnp.asarray(v, float) for n, v in {**self._start, **(values or {})}.items()}
            return self._shaped(_compiled(self._models, given))

    def slopes(
        self, names: Sequence[str], values: Mapping[str, float] | None = None
    ) -> Float[np.ndarray, "parameters geometries wavelengths"]:
        """Derivatives of the spectra by some parameters.

        Parameters of different wavelengths share a derivative: the cost follows the number of quantities.
        """
        own = self.sample.own_wavelengths(names, self.wavelength_nm.tolist())
        group = [name.partition("@")[0] if name in own else name for name in names]
        groups = list(dict.fromkeys(group))
        with computing():
            given = {n: jnp.asarray(v, float) for n, v in {**self._start, **(values or {})}.items()}
            seeds = {
                name: jnp.array(
                    [float(name in names and group[list(names).index(name)] == g) for g in groups]
                )
                for name in given
            }
            found = self._shaped(_compiled_slopes(self._models, given, seeds))
        each = found[[groups.index(one) for one in group]]
        for i, name in enumerate(names):
            if name in own:
                each[i][:, self.wavelength_nm != own[name]] = 0.0
        return each

    def covariances(
        self, known: ParameterCovariance, values: Mapping[str, float] | None = None
    ) -> Float[np.ndarray, "geometries wavelengths wavelengths"]:
        """Covariance of each spectrum from that of the parameters; ``values`` that are given are exact."""
        keep = [
            i for i, n in enumerate(known.names) if n in self.sample.parameters and n not in (values or {})
        ]
        shape = (len(self.geometries), len(self.wavelength_nm), len(self.wavelength_nm))
        if not keep:
            return np.zeros(shape)
        slopes = self.slopes([known.names[i] for i in keep], values)
        matrix = known.matrix[np.ix_(keep, keep)]
        return np.einsum("pgw,pq,qgv->gwv", slopes, matrix, slopes, optimize=True)

    def colours(
        self,
        illuminant: str | Illuminant = "D65",
        observer_deg: int = 2,
        known: ParameterCovariance | None = None,
        values: Mapping[str, float] | None = None,
    ) -> tuple[Colour, ...]:
        """The colour in each geometry.

        Parameters
        ----------
        illuminant, observer_deg
            See `Viewing.of`.
        known
            Covariance of parameters, for standard errors.
        values
            See `at`.
        """
        viewing = Viewing.of(self.wavelength_nm, illuminant, observer_deg)
        spectra = self.at(values)
        errors = [None] * len(spectra) if known is None else self.covariances(known, values)
        return tuple(
            Colour(geometry.name, viewing, spectrum, error)
            for geometry, spectrum, error in zip(self.geometries, spectra, errors, strict=True)
        )


def wavelengths_of(sample: Sample, known_nm: Collection[float] = ()) -> tuple[float, ...]:
    """Wavelengths of a sample, or else those of its measurement; at least two.

    Raises
    ------
    InputRefusedError
        If there are fewer.
    """
    found = tuple(sorted(sample.wavelengths_nm or known_nm))
    if len(found) < 2:
        raise InputRefusedError(
            f"a colour needs a spectrum; the sample has {', '.join(f'{w:g} nm' for w in found) or 'none'}, "
            "and at least two wavelengths are needed."
        )
    return found
