"""The ink as a homogeneous medium, and short forms of its phase function with their errors."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import roots_legendre

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.ink import InkLayers
from jaxink.model import mie_sizes, volume_scattering
from jaxink.numerics.precision import computing
from jaxink.numerics.validity import as_float
from jaxink.optics import Directions, ScatteringLayer
from jaxink.particles import HenyeyGreenstein, LegendreSeries, PhaseFunction, TwoTermHenyeyGreenstein
from jaxink.solver import SolverConfig, Stack, diffuse_bsdf, hemispherical_power

# Quadrature of the phase function and moments that describe it.
_NODES, _MOMENTS = 2000, 400
# Cosines at which a phase function is evaluated at once.
_POINTS = 1024
# Moments that a short form is fitted to: the BSDF of a layer hardly depends on higher ones.
_FITTED_MOMENTS, _KEPT = 24, 1e3
_CONFIG = SolverConfig(16, 12, 48, 16)
_INCIDENCES_DEG, _VIEWS_DEG = (0.0, 30.0, 60.0), np.arange(0.0, 76.0, 15.0)
SHORT_FORMS = ("henyey_greenstein", "two_term_henyey_greenstein", "gegenbauer")


class _Series(LegendreSeries):
    """A series of many moments; where it is cut, it may be slightly negative."""

    phase_moments: Float[Array, " moments"] = eqx.field(converter=as_float)


@dataclasses.dataclass(frozen=True, eq=False)
class Medium:
    """A scattering layer of an ink as a volume, at every wavelength.

    Parameters
    ----------
    name
        Name of the layer.
    wavelength_nm
        Wavelengths, shape ``(wavelengths,)``.
    refractive_index
        Real index of the binder, which the faces of the volume have; shape ``(wavelengths,)``.
    scattering_per_mm, absorption_per_mm
        Coefficients, shape ``(wavelengths,)``.
    phase
        Phase function at each wavelength, of the cosine of the scattering angle; its mean over the sphere
        is 1.
    moments
        Legendre moments of the phase functions, the first 1 and the second g; shape
        ``(wavelengths, moments)``.
    thickness_um
        Thickness of the layer.
    indices
        Refractive indices of side I and side A, shape ``(2, wavelengths)``.
    media
        Names of side I and of side A.
    faces
        Rough faces that the layer declares, in words; empty if all are smooth.
    """

    __repr__ = brief_repr

    name: str
    wavelength_nm: Float[np.ndarray, " wavelengths"]
    refractive_index: Float[np.ndarray, " wavelengths"]
    scattering_per_mm: Float[np.ndarray, " wavelengths"]
    absorption_per_mm: Float[np.ndarray, " wavelengths"]
    phase: tuple[Callable, ...]
    moments: Float[np.ndarray, "wavelengths moments"]
    thickness_um: float
    indices: Float[np.ndarray, "2 wavelengths"]
    media: tuple[str, str]
    faces: str = ""

    @property
    def asymmetry(self) -> Float[np.ndarray, " wavelengths"]:
        """Mean cosine g of the scattering angle."""
        return self.moments[:, 1]

    @property
    def extinction_per_mm(self) -> Float[np.ndarray, " wavelengths"]:
        """Scattering plus absorption."""
        return self.scattering_per_mm + self.absorption_per_mm

    def stack(self, wavelength: int, moments: Float[np.ndarray, " moments"] | None = None) -> Stack:
        """The layer with smooth faces between its two media, lit from side I.

        ``moments`` are those of another phase function of the same layer.
        """
        chosen = self.moments[wavelength] if moments is None else moments
        extinction = self.extinction_per_mm[wavelength]
        layer = ScatteringLayer(
            self.refractive_index[wavelength],
            extinction * self.thickness_um / 1000,
            self.scattering_per_mm[wavelength] / max(extinction, 1e-300),
            _Series(jnp.asarray(chosen)),
        )
        return Stack((layer,), *self.indices[:, wavelength])


def medium_of(ink: InkLayers, wavelengths_nm: Sequence[float]) -> Medium:
    """The ink as a medium.

    Parameters
    ----------
    ink
        From `jaxink.ink.find_ink`.
    wavelengths_nm
        Wavelengths.

    Raises
    ------
    InputRefusedError
        If the ink has several layers, or one without a thickness.
    """
    sample = ink.sample
    if len(ink.names) != 1:
        raise InputRefusedError(
            f"the ink consists of the layers {', '.join(ink.names)}; a volume is one layer, so name one that "
            "scatters (layers, --layer)."
        )
    layer = sample.layers[ink.first]
    if layer.opaque:
        raise InputRefusedError(
            f"layer '{layer.name}' is opaque: it has an albedo, but no coefficients per mm, so it cannot be "
            "written as a volume; write it as a surface (--as surface), or give thickness_um."
        )
    start = sample.parameters.values_with({})
    columns: dict[str, list] = {
        name: [] for name in ("index", "scattering", "absorption", "phase", "moments")
    }
    with computing():
        sizes = mie_sizes(sample, tuple(wavelengths_nm))
        for wavelength in wavelengths_nm:
            values: Mapping = sample.at_wavelength(start, wavelength)
            phase, scattering, absorption = volume_scattering(layer, values, wavelength, sizes)
            columns["index"].append(float(values[f"{layer.name}.refractive_index"]))
            columns["scattering"].append(float(scattering))
            columns["absorption"].append(float(absorption))
            columns["phase"].append(_as_numpy(phase))
            columns["moments"].append(np.asarray(phase.moments(_MOMENTS)))
    sides = np.array([ink.indices(wavelength) for wavelength in wavelengths_nm]).T
    faces = ", ".join(f"{rough.face} ({rough.density or 'wave optics'})" for rough in layer.roughness)
    return Medium(
        layer.name,
        np.asarray(wavelengths_nm, float),
        np.array(columns["index"]),
        np.array(columns["scattering"]),
        np.array(columns["absorption"]),
        tuple(columns["phase"]),
        np.array(columns["moments"]),
        float(sample.at_wavelength(start, wavelengths_nm[0])[f"{layer.name}.thickness_um"]),
        sides,
        ink.media,
        faces,
    )


def _as_numpy(phase: PhaseFunction) -> Callable:
    def value(cosine):
        cosine = np.asarray(cosine, float)
        # Always of one shape, as each is compiled.
        padded = np.resize(cosine.ravel(), -(-cosine.size // _POINTS) * _POINTS).reshape(-1, _POINTS)
        with computing():
            parts = [np.asarray(_phase_values(phase, part)) for part in padded]
        return np.concatenate(parts)[: cosine.size].reshape(cosine.shape)

    return value


@eqx.filter_jit
def _phase_values(phase: PhaseFunction, cosines: Float[Array, " points"]) -> Float[Array, " points"]:
    return phase.value(cosines)


@dataclasses.dataclass(frozen=True)
class ShortForm:
    """A phase function with a few numbers, and how much the BSDF of the layer differs with it.

    Parameters
    ----------
    kind
        One of `SHORT_FORMS`.
    numbers
        By name: ``g``; ``g_1``, ``g_2`` and ``weight_2``; or ``g`` and ``alpha``.
    reflectance, transmittance
        Largest difference of the hemispherical totals at 0, 30 and 60 degrees from side I.
    bsdf_rms
        Root mean square of the relative difference of the BSDF, in reflection and transmission to 75 degrees.
    """

    kind: str
    numbers: dict[str, float]
    reflectance: float
    transmittance: float
    bsdf_rms: float


def short_forms(medium: Medium, wavelength: int) -> list[ShortForm]:
    """Short forms of a phase function, the closest of each kind in its first Legendre moments.

    References
    ----------
    Reynolds, McCormick 1980 J. Opt. Soc. Am. 70, 1206 (Gegenbauer kernel).
    """
    from scipy.optimize import least_squares

    moments = medium.moments[wavelength]
    order = np.arange(_MOMENTS)
    g = float(np.clip(moments[1], -0.999, 0.999))

    # The mean cosine decides on the totals of a layer, and is kept.
    weights = np.where(order == 1, _KEPT, 1.0)

    def misfit(of):
        return lambda x: (weights * (of(x) - moments))[1:_FITTED_MOMENTS]

    first, second, share = _two_lobes(moments)
    lobes = {"g_1": first, "g_2": second, "weight_2": share}
    node, to_moments = _quadrature()

    def kernel(x):
        return gegenbauer(node, *x) @ to_moments

    with computing():
        lobed: list[tuple[str, dict[str, float], PhaseFunction]] = [
            ("henyey_greenstein", {"g": g}, HenyeyGreenstein(g)),
            ("two_term_henyey_greenstein", lobes, TwoTermHenyeyGreenstein(first, second, share)),
        ]
        found = [(kind, numbers, np.asarray(phase.moments(_MOMENTS))) for kind, numbers, phase in lobed]
        fitted = [
            least_squares(misfit(kernel), (h, a), bounds=([-0.995, 0.05], [0.995, 6.0]))
            for h, a in ((g if abs(g) > 0.05 else 0.05, 0.5), (g / 2 if abs(g) > 0.1 else -0.05, 1.5))
        ]
        best = min(fitted, key=lambda r: r.cost)
        found.append(("gegenbauer", {"g": float(best.x[0]), "alpha": float(best.x[1])}, kernel(best.x)))
        exact = light_of(medium, wavelength)
        return [_judged(medium, wavelength, exact, *one) for one in found]


def _two_lobes(moments: np.ndarray) -> tuple[float, float, float]:
    """Asymmetries of two lobes and the share of the second, with the mean cosine of the moments.

    The mean cosine fixes the share, so that two numbers are left, whose misfit has several minima.
    """
    from scipy.optimize import least_squares

    order, g = np.arange(1, _FITTED_MOMENTS), float(np.clip(moments[1], -0.99, 0.99))

    def misfit(x):
        one, other = g + (0.999 - g) * x[0], g - (g + 0.999) * x[1]
        share = (one - g) / (one - other)
        return (1 - share) * one**order + share * other**order - moments[1:_FITTED_MOMENTS]

    inside = np.linspace(0.02, 0.98, 25)
    start = min(((x, y) for x in inside for y in inside), key=lambda at: float(np.sum(misfit(at) ** 2)))
    x, y = least_squares(misfit, start, bounds=([1e-3, 1e-3], [1.0, 1.0])).x
    one, other = g + (0.999 - g) * x, g - (g + 0.999) * y
    return float(one), float(other), float((one - g) / (one - other))


@lru_cache(maxsize=1)
def _quadrature() -> tuple[np.ndarray, np.ndarray]:
    """Nodes in the cosine, and the matrix from values there to Legendre moments."""
    node, weight = roots_legendre(_NODES)
    return node, np.polynomial.legendre.legvander(node, _MOMENTS - 1) * weight[:, None] / 2


def gegenbauer(cosine, g: float, alpha: float) -> np.ndarray:
    """Gegenbauer kernel with mean 1 over the sphere; alpha of 1/2 is Henyey and Greenstein's function."""
    if abs(g) < 1e-6:
        return np.ones_like(cosine)
    scale = 4 * alpha * g * (1 - g**2) ** (2 * alpha) / ((1 + g) ** (2 * alpha) - (1 - g) ** (2 * alpha))
    return scale / (1 + g**2 - 2 * g * cosine) ** (alpha + 1)


def light_of(medium: Medium, wavelength: int, moments=None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hemispherical reflectance and transmittance at 0, 30, 60 degrees from side I; BSDF to 75 degrees.

    ``moments`` are those of another phase function of the same layer.
    """
    with computing():
        stack = medium.stack(wavelength, moments)
        sines = np.sin(np.deg2rad(_INCIDENCES_DEG))
        reflected, transmitted = hemispherical_power(stack, sines, _CONFIG)
        axes = np.meshgrid(_INCIDENCES_DEG, _VIEWS_DEG, [0.0, 90.0, 180.0], [False, True], indexing="ij")
        directions = Directions.from_degrees(*(axis.ravel() for axis in axes))
        bsdf = diffuse_bsdf(stack, directions, _CONFIG)
        return np.asarray(reflected), np.asarray(transmitted), np.asarray(bsdf)


def _judged(medium: Medium, wavelength: int, exact, kind: str, numbers, moments) -> ShortForm:
    found = light_of(medium, wavelength, moments)
    reflected, transmitted = (float(np.max(np.abs(a - b))) for a, b in zip(found[:2], exact[:2], strict=True))
    relative = found[2] / np.maximum(exact[2], 1e-300) - 1
    return ShortForm(kind, numbers, reflected, transmitted, float(np.sqrt(np.mean(relative**2))))
