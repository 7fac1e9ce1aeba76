"""Phase functions: Henyey-Greenstein, Rayleigh, Legendre series and tables."""

from functools import partial
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Array, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.legendre import legendre_series, moments_of_function
from jaxink.numerics.validity import as_float, is_known, require
from jaxink.optics import PhaseFunction, ScatteringMatrix


def _henyey_greenstein(g, cosine):
    # Two forms, so that neither 1 - |g| nor 1 - |cosine| is lost to rounding at a narrow peak.
    forward = (1 - g) ** 2 + 2 * g * (1 - cosine)
    backward = (1 + g) ** 2 - 2 * g * (1 + cosine)
    return (1 - g) * (1 + g) / jnp.where(g >= 0, forward, backward) ** 1.5


@partial(jax.custom_jvp, nondiff_argnums=(1,))
def _powers(base, n_powers: int):
    """base^0 ... base^(n - 1), with derivatives of every order also at base 0."""
    return jnp.power(base, np.arange(n_powers))


@_powers.defjvp
def _powers_jvp(n_powers, primals, tangents):
    (base,), (d_base,) = primals, tangents
    lower = jnp.pad(_powers(base, n_powers - 1), (1, 0))
    return _powers(base, n_powers), np.arange(n_powers) * lower * d_base


def _require_asymmetry(name: str, value) -> None:
    require(name, value, lambda g: np.abs(g) < 1, "be between -1 and 1, both excluded")


class HenyeyGreenstein(PhaseFunction):
    """One-parameter phase function of Henyey and Greenstein.

    Parameters
    ----------
    asymmetry_parameter
        Mean cosine of the scattering angle, between -1 and 1; a known value outside is rejected.

    References
    ----------
    Henyey, Greenstein 1941 Astrophys. J. 93, 70, eq. 2.
    """

    asymmetry_parameter: Float[Array, ""] = eqx.field(converter=as_float)

    if TYPE_CHECKING:
        # Type checkers know nothing of converters: what a user may give, here and below.
        def __init__(self, asymmetry_parameter: ArrayLike) -> None: ...

    def __check_init__(self):
        _require_asymmetry("asymmetry_parameter", self.asymmetry_parameter)

    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """See `PhaseFunction.value`."""
        return _henyey_greenstein(self.asymmetry_parameter, scattering_cosine)

    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """Powers g^l."""
        return _powers(self.asymmetry_parameter, n_moments)


class TwoTermHenyeyGreenstein(PhaseFunction):
    """Weighted sum of two Henyey-Greenstein lobes.

    Parameters
    ----------
    asymmetry_parameter, second_asymmetry_parameter
        Mean cosine of each lobe, between -1 and 1.
    second_weight
        Fraction of the scattering in the second lobe, 0 to 1.
    """

    asymmetry_parameter: Float[Array, ""] = eqx.field(converter=as_float)
    second_asymmetry_parameter: Float[Array, ""] = eqx.field(converter=as_float)
    second_weight: Float[Array, ""] = eqx.field(converter=as_float)

    if TYPE_CHECKING:

        def __init__(
            self,
            asymmetry_parameter: ArrayLike,
            second_asymmetry_parameter: ArrayLike,
            second_weight: ArrayLike,
        ) -> None: ...

    def __check_init__(self):
        _require_asymmetry("asymmetry_parameter", self.asymmetry_parameter)
        _require_asymmetry("second_asymmetry_parameter", self.second_asymmetry_parameter)
        require("second_weight", self.second_weight, lambda w: (w >= 0) & (w <= 1), "be between 0 and 1")

    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """See `PhaseFunction.value`."""
        first = _henyey_greenstein(self.asymmetry_parameter, scattering_cosine)
        second = _henyey_greenstein(self.second_asymmetry_parameter, scattering_cosine)
        return first + self.second_weight * (second - first)

    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """See `PhaseFunction.moments`."""
        first = _powers(self.asymmetry_parameter, n_moments)
        second = _powers(self.second_asymmetry_parameter, n_moments)
        return first + self.second_weight * (second - first)


class Rayleigh(PhaseFunction):
    """Unpolarised scattering by particles much smaller than the wavelength, 3/4 (1 + cos^2)."""

    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """See `PhaseFunction.value`."""
        return 0.75 * (1 + jnp.square(scattering_cosine))

    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """1, 0, 1/10, then zeros."""
        return jnp.zeros(max(n_moments, 3)).at[0].set(1.0).at[2].set(0.1)[:n_moments]

    def matrix(self) -> ScatteringMatrix:
        """F12 = -3/4 (1 - cos^2) and F33 = 3/2 cos; Bohren, Huffman 1983, eq. 5.5."""
        return ScatteringMatrix(jnp.array([[1.0, 0.0, 0.1], [-0.5, 0.0, 0.1], [0.0, 0.5, 0.0]]))


class LegendreSeries(PhaseFunction):
    """Phase function given by its Legendre moments.

    Parameters
    ----------
    phase_moments
        Moments without the factor 2l + 1, the first is 1, shape ``(moments,)``; higher ones are zero.
    """

    phase_moments: eqx.AbstractVar[Float[Array, " moments"]]

    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """See `PhaseFunction.value`."""
        return legendre_series(self.phase_moments, scattering_cosine)

    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """See `PhaseFunction.moments`."""
        missing = max(0, n_moments - self.phase_moments.shape[0])
        return jnp.pad(self.phase_moments, (0, missing))[:n_moments]


# Largest deviation of a table's mean from 1; beyond, its normalisation is different or it is too coarse.
LARGEST_NORMALISATION_ERROR = 1e-2
# A series, of mean 1, may be negative by this much.
LARGEST_NEGATIVE_VALUE = 1e-3


class TabulatedByAngle(PhaseFunction):
    """Phase function tabulated at cosines of the scattering angle, from forward to backward.

    It is interpolated by a cubic spline in the cosine (not-a-knot). The values are divided by the exact mean
    of that spline over the sphere, so the mean is exactly 1.

    Parameters
    ----------
    scattering_cosine
        Cosines, known numbers, ascending or descending, from -1 to 1, at least 4, shape ``(angles,)``.
    values
        Phase function, mean over the sphere 1, shape ``(angles,)``.

    Raises
    ------
    InputRefusedError
        If the table does not extend from -1 to 1 in order, a value is negative, the spline becomes negative
        between the angles, or the mean differs from 1 by more than 0.01.
    """

    scattering_cosine: Float[Array, " angles"]
    values: Float[Array, " angles"]
    slopes: Float[Array, " angles"]
    widest_step_rad: float = eqx.field(static=True)

    def __init__(self, scattering_cosine, values):
        cosine = np.asarray(scattering_cosine, float)
        _check_table_cosines(cosine)
        if np.shape(values) != cosine.shape:
            raise InputRefusedError(
                f"the phase function table has {cosine.size} angles and values of shape {np.shape(values)}; "
                "give one value for each angle."
            )
        require("a phase function value", values, lambda v: v >= 0, "be 0 or more")
        if cosine[0] > cosine[-1]:
            cosine, values = cosine[::-1], values[::-1]
        # Ends such as cos(deg2rad(180)) are -1 only up to rounding.
        cosine = np.concatenate([[-1.0], cosine[1:-1], [1.0]])
        # Importing it takes a quarter of a second, and few samples need it.
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(cosine, np.eye(cosine.size))
        values = jnp.asarray(values, float)
        mean = (spline.integrate(-1, 1) / 2) @ values
        require(
            "the mean of the tabulated phase function over the sphere",
            mean,
            lambda m: np.abs(m - 1) <= LARGEST_NORMALISATION_ERROR,
            "be 1 within 0.01 (divide the values by it, or give more angles where the function is steep)",
        )
        self.scattering_cosine = jnp.asarray(cosine)
        self.values = values / mean
        self.slopes = spline(cosine, 1) @ self.values
        self.widest_step_rad = float(np.max(np.abs(np.diff(np.arccos(cosine)))))
        _require_not_negative(self, np.cos(np.linspace(0, np.pi, 20 * cosine.size)), "angles")

    @eqx.filter_jit
    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """Spline at the cosines; see `PhaseFunction.value`."""
        x = jnp.asarray(scattering_cosine)
        table = self.scattering_cosine
        left = jnp.clip(jnp.searchsorted(table, x, side="right") - 1, 0, table.shape[0] - 2)
        step = table[left + 1] - table[left]
        t = (x - table[left]) / step
        before, after = self.values[left], self.values[left + 1]
        start, end = step * self.slopes[left], step * self.slopes[left + 1]
        rise = after - before
        return before + t * (start + t * (3 * rise - 2 * start - end + t * (start + end - 2 * rise)))

    @eqx.filter_jit
    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """Moments of the spline by Gauss-Legendre quadrature between neighbouring angles."""
        # The fastest polynomial spans n_moments * step radians in one step; this many nodes integrate it.
        n_nodes = 6 + int(np.ceil(n_moments * self.widest_step_rad / 2))
        unit_nodes, unit_weights = np.polynomial.legendre.leggauss(n_nodes)
        step = jnp.diff(self.scattering_cosine)[:, None]
        nodes = (self.scattering_cosine[:-1, None] + step * (unit_nodes + 1) / 2).ravel()
        weights = (step * unit_weights / 2).ravel()
        return moments_of_function(self.value(nodes), nodes, weights, n_moments)


class TabulatedByMoments(LegendreSeries):
    """Tabulated Legendre moments.

    Raises
    ------
    InputRefusedError
        If the first moment is not 1, one exceeds 1 in magnitude, or the series becomes negative.
    """

    phase_moments: Float[Array, " moments"] = eqx.field(converter=as_float)

    def __check_init__(self):
        require("phase moment 0", self.phase_moments[0], lambda m: np.abs(m - 1) <= 1e-6, "be 1")
        require(
            "a phase moment",
            self.phase_moments,
            lambda m: np.abs(m) <= 1 + 1e-6,
            "be between -1 and 1, without the factor 2l + 1",
        )
        n_points = 10 * self.phase_moments.shape[0] + 11
        _require_not_negative(self, np.cos(np.linspace(0, np.pi, n_points)), "moments")


def _check_table_cosines(cosine: np.ndarray) -> None:
    if cosine.ndim != 1 or cosine.size < 4:
        raise InputRefusedError(
            f"the phase function table has angles of shape {cosine.shape}; give a list of at least 4."
        )
    steps = np.diff(cosine)
    if not (np.all(steps > 0) or np.all(steps < 0)):
        raise InputRefusedError(
            "the angles of the phase function table are not in order; sort the table by angle."
        )
    if abs(cosine.min() + 1) > 1e-9 or abs(cosine.max() - 1) > 1e-9:
        lowest, highest = np.rad2deg(np.arccos(np.clip([cosine.max(), cosine.min()], -1, 1)))
        raise InputRefusedError(
            f"the phase function table extends from {lowest:.6g} to {highest:.6g} deg; it must extend from 0 "
            "to 180 deg."
        )


def _require_not_negative(phase_function: PhaseFunction, cosines: np.ndarray, what: str) -> None:
    values = phase_function.value(cosines)
    if is_known(values) and jnp.min(values) < -LARGEST_NEGATIVE_VALUE:
        worst = int(jnp.argmin(values))
        raise InputRefusedError(
            f"the tabulated phase function is {values[worst]:.3g} at a scattering angle of "
            f"{np.rad2deg(np.arccos(cosines[worst])):.4g} deg; give more {what} to make it positive."
        )


# By the names that a sample file gives them; the fields are its numbers.
PHASE_FUNCTIONS: dict[str, type[PhaseFunction]] = {
    "henyey_greenstein": HenyeyGreenstein,
    "two_term_henyey_greenstein": TwoTermHenyeyGreenstein,
    "rayleigh": Rayleigh,
}
