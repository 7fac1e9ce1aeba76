"""The BSDF of a plane body in reflection as a smooth series.

A facet of any orientation sees a pair of directions i and o under the cosines i.m and o.m with its normal m,
while the cosine i.o between them is the same for all facets. Hence (i.m + o.m) f as a series of Legendre
polynomials of i.m and o.m and Chebyshev polynomials of i.o: it has no singularity at the normal, it is
reciprocal term by term, and averages over facets act on the first two factors only. The factor i.m + o.m
removes the pole of light that is scattered once in a body without a refracting face.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.numerics.chebyshev import chebyshev
from jaxink.numerics.quadrature import gauss_legendre_unit

# Highest degree in i.m and o.m together, and in i.o.
_DEGREE, _ORDER = 10, 24
# Nodes of the polar angles, up to the largest, and of the azimuth.
_N_POLAR, _N_AZIMUTH, _LARGEST_DEG = 14, 20, 88.0


Coefficients = Float[Array, "*bodies degrees degrees orders"]


def legendre(cosine: Float[ArrayLike, "*shape"], degree: int = _DEGREE) -> Float[Array, "*shape degrees"]:
    """Legendre polynomials of 2 x - 1 up to a degree, for cosines x from 0 to 1."""
    x = 2 * jnp.asarray(cosine, float) - 1
    found = [jnp.ones_like(x), x]
    for k in range(1, degree):
        found.append(((2 * k + 1) * x * found[-1] - k * found[-2]) / (k + 1))
    return jnp.stack(found, axis=-1)


def _polar_cosines():
    lowest = np.cos(np.deg2rad(_LARGEST_DEG))
    return lowest + (1 - lowest) * gauss_legendre_unit(_N_POLAR)[0]


class BodySeries(eqx.Module):
    """The directions at which a body is evaluated, and its series from the values there.

    Parameters
    ----------
    theta_i_deg, theta_o_deg, phi_deg
        The directions.
    fit
        Least squares: matrix from (cos(theta_i) + cos(theta_o)) f to the coefficients.
    place
        Position of each coefficient, and of its mirror image, in the array of the series.
    """

    __repr__ = brief_repr

    theta_i_deg: Float[np.ndarray, " directions"]
    theta_o_deg: Float[np.ndarray, " directions"]
    phi_deg: Float[np.ndarray, " directions"]
    fit: Float[np.ndarray, "terms directions"]
    place: tuple[np.ndarray, np.ndarray]

    @property
    def cosines(self) -> Float[np.ndarray, " incidences"]:
        """Cosines of the distinct polar angles, ascending."""
        return _polar_cosines()

    @property
    def incidence_at(self) -> Int[np.ndarray, " incidences"]:
        """Position of a direction with each of them as its incidence."""
        return _N_AZIMUTH * np.flatnonzero(np.triu_indices(_N_POLAR)[0] == np.triu_indices(_N_POLAR)[1])

    @classmethod
    def of_any_body(cls) -> "BodySeries":
        """The directions and the series that suit all bodies."""
        cosines, azimuths = _polar_cosines(), (np.arange(_N_AZIMUTH) + 0.5) * np.pi / _N_AZIMUTH
        first, second = (np.repeat(i, _N_AZIMUTH) for i in np.triu_indices(_N_POLAR))
        a, b, phi = cosines[first], cosines[second], np.tile(azimuths, first.size // _N_AZIMUTH)
        c = a * b + np.sqrt((1 - a**2) * (1 - b**2)) * np.cos(phi)
        of_a, of_b = (np.polynomial.legendre.legvander(2 * x - 1, _DEGREE) for x in (a, b))
        of_c = np.polynomial.chebyshev.chebvander(c, _ORDER)
        terms = [
            (p, q, r)
            for p in range(_DEGREE + 1)
            for q in range(p, _DEGREE + 1 - p)
            for r in range(_ORDER + 1)
            if (p + q) / _DEGREE + r / _ORDER < 1 + 1e-9
        ]
        p, q, r = np.array(terms).T
        columns = (of_a[:, p] * of_b[:, q] + of_a[:, q] * of_b[:, p]) / 2 * of_c[:, r]
        theta_i_deg, theta_o_deg = (np.rad2deg(np.arccos(x)) for x in (a, b))
        shape = (_DEGREE + 1, _DEGREE + 1, _ORDER + 1)
        place = np.ravel_multi_index((p, q, r), shape), np.ravel_multi_index((q, p, r), shape)
        return cls(theta_i_deg, theta_o_deg, np.rad2deg(phi), np.linalg.pinv(columns, 1e-10), place)

    def coefficients(self, bsdf: Float[Array, " directions"]) -> Coefficients:
        """Coefficients of the series, from the BSDF in the directions of the series in 1/sr."""
        cosines = jnp.cos(jnp.deg2rad(self.theta_i_deg)), jnp.cos(jnp.deg2rad(self.theta_o_deg))
        found = self.fit @ (bsdf * (cosines[0] + cosines[1])) / 2
        size = _DEGREE + 1
        empty = jnp.zeros(size * size * (_ORDER + 1))
        first, second = self.place
        return empty.at[first].add(found).at[second].add(found).reshape(size, size, -1)


def between(
    coefficients: Coefficients, cosine_between: Float[Array, "*pairs"]
) -> Float[Array, "*pairs degrees degrees"]:
    """Coefficients of the polynomials of i.m and o.m, for pairs of directions with the cosine i.o."""
    return jnp.einsum("pqr,r...->...pq", coefficients, chebyshev(cosine_between, _ORDER + 1))


class Mirror(eqx.Module):
    """Regular reflectance of a plane body as a polynomial of the cosine of incidence.

    Parameters
    ----------
    series
        Coefficients of Legendre polynomials, of one body or of one for each cosine.
    """

    series: Float[Array | np.ndarray, "*bodies degrees"]

    @classmethod
    def through(
        cls, cosines: Float[np.ndarray, " incidences"], reflectance: Float[Array, " incidences"]
    ) -> "Mirror":
        """The polynomial through the reflectance at some cosines."""
        columns = np.polynomial.legendre.legvander(2 * cosines - 1, cosines.size - 1)
        return cls(np.linalg.inv(columns) @ reflectance)

    def reflectance(self, cosine: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Reflectance at other cosines."""
        return jnp.sum(legendre(cosine, self.series.shape[-1] - 1) * self.series, axis=-1)
