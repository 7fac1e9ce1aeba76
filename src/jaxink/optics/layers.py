"""Optics of one layer, and its delta-M truncation."""

from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.display.brief import brief_repr
from jaxink.numerics.validity import as_float, known_float, require
from jaxink.optics.phase_function import PhaseFunction


class ClearLayer(eqx.Module):
    """Homogeneous layer that does not scatter, such as the plate.

    Parameters
    ----------
    refractive_index
        Real refractive index.
    optical_thickness
        Absorption coefficient times thickness, 0 or more.
    """

    __repr__ = brief_repr

    refractive_index: Float[Array, ""] = eqx.field(converter=known_float)
    optical_thickness: Float[Array, ""] = eqx.field(converter=as_float)

    if TYPE_CHECKING:
        # Type checkers know nothing of converters: what a user may give, here and beside.
        def __init__(self, refractive_index: ArrayLike, optical_thickness: ArrayLike) -> None: ...

    def __check_init__(self):
        _require_physical(self)


class ScatteringLayer(eqx.Module):
    """Homogeneous scattering layer, such as the ink.

    Parameters
    ----------
    refractive_index
        Real refractive index of the binder.
    optical_thickness
        Extinction coefficient times thickness, 0 or more; see `OPAQUE_OPTICAL_THICKNESS`.
    single_scattering_albedo
        Scattering over extinction, from 0 to 1 inclusive.
    phase_function
        Phase function, with mean 1 over the sphere.
    """

    __repr__ = brief_repr

    refractive_index: Float[Array, ""] = eqx.field(converter=known_float)
    optical_thickness: Float[Array, ""] = eqx.field(converter=as_float)
    single_scattering_albedo: Float[Array, ""] = eqx.field(converter=as_float)
    phase_function: PhaseFunction

    if TYPE_CHECKING:

        def __init__(
            self,
            refractive_index: ArrayLike,
            optical_thickness: ArrayLike,
            single_scattering_albedo: ArrayLike,
            phase_function: PhaseFunction,
        ) -> None: ...

    def __check_init__(self):
        _require_physical(self)
        name, albedo = "single_scattering_albedo of a ScatteringLayer", self.single_scattering_albedo
        # A quotient of coefficients may exceed 1 by rounding.
        require(name, albedo, lambda a: (a >= 0) & (a <= 1 + _ROUNDING), "be from 0 to 1")


def _require_physical(layer: ClearLayer | ScatteringLayer) -> None:
    where = f"of a {type(layer).__name__}"
    require(f"refractive_index {where}", layer.refractive_index, _is_positive, "be positive and finite")
    require(f"optical_thickness {where}", layer.optical_thickness, lambda t: t >= 0, "be at least 0")


def _is_positive(value):
    return (value > 0) & np.isfinite(value)


_ROUNDING = 1e-6

# Of an opaque layer: its transmittance is below 1e-7 even without absorption.
OPAQUE_OPTICAL_THICKNESS = 1e8


class TruncatedOptics(eqx.Module):
    """Optics of a layer whose forward peak counts as unscattered.

    Parameters
    ----------
    optical_thickness, single_scattering_albedo
        Scaled by the truncation.
    phase_moments
        Scaled Legendre moments; moment 0 is 1.
    forward_fraction
        Share of the scattered light that counts as unscattered.
    """

    optical_thickness: Float[Array, ""]
    single_scattering_albedo: Float[Array, ""]
    phase_moments: Float[Array, " moments"]
    forward_fraction: Float[Array, ""]


def delta_m(layer: ScatteringLayer, n_moments: int) -> TruncatedOptics:
    """Treat the part of the phase function beyond ``n_moments`` as unscattered light.

    The result is scaled by the similarity relations and equivalent to the layer up to that moment. Of a
    narrow backward peak, whose moments alternate, only so much counts as unscattered that the moments that
    remain are those of a function that can exist.

    References
    ----------
    Wiscombe 1977 J. Atmos. Sci. 34, 1408.
    """
    moments = layer.phase_function.moments(n_moments + 1)
    fraction = jnp.minimum(moments[n_moments], jnp.min(1 + moments[:n_moments]) / 2)
    albedo = layer.single_scattering_albedo
    kept = 1 - albedo * fraction
    return TruncatedOptics(
        optical_thickness=layer.optical_thickness * kept,
        single_scattering_albedo=albedo * (1 - fraction) / kept,
        phase_moments=(moments[:n_moments] - fraction) / (1 - fraction),
        forward_fraction=fraction,
    )
