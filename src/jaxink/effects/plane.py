"""A sample with a plane surface, known over the hemisphere, for effects that reshape its surface."""

from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.surfaces import BodySeries, Coefficients, Mirror, Pairs


class Hemisphere(eqx.Module):
    """Directions over the hemisphere at each wavelength, in reflection, beside those that are wanted.

    Parameters
    ----------
    series
        The directions, and the series of the BSDF there.
    theta_deg
        Polar angles of the wanted directions, in and out.
    pairs
        The same as pairs above the surface.
    wave
        Position of the wavelength of each of them.
    waves
        The wavelengths in nm.
    """

    __repr__ = brief_repr

    series: BodySeries
    theta_deg: Float[np.ndarray, "2 pairs"]
    pairs: Pairs
    wave: Int[np.ndarray, " pairs"]
    waves: tuple[float, ...] = eqx.field(static=True)

    @classmethod
    def beside(cls, columns: tuple[np.ndarray, ...], waves: tuple[float, ...]) -> "Hemisphere":
        """For wanted directions: polar angles, azimuth and wavelength, as in `Scene.all_directions`."""
        theta_i, theta_o, phi, wavelength, _ = columns
        # The facets that are seen at 90 degrees have no area.
        theta = np.minimum([theta_i, theta_o], 89.9)
        into, out = np.cos(np.deg2rad(theta))
        pairs = Pairs(into, out, np.arccos(np.cos(np.deg2rad(phi))))
        return cls(BodySeries.of_any_body(), theta, pairs, np.searchsorted(waves, wavelength), waves)

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """The directions as columns of a measurement."""
        n, series = len(self.waves), self.series
        angles = (np.tile(a, n) for a in (series.theta_i_deg, series.theta_o_deg, series.phi_deg))
        each = series.phi_deg.size
        return (*angles, np.repeat(self.waves, each), np.zeros(n * each))

    def sample(self, bsdf: Float[Array, " all"], regular: Float[Array, " all"]) -> "PlaneSample":
        """The sample, from its BSDF and regular power in the wanted directions and in these."""
        n = self.theta_deg.shape[1]
        there = bsdf[n:].reshape(len(self.waves), -1)
        mirrored = regular[n:].reshape(there.shape)[:, self.series.incidence_at]
        coefficients = jax.vmap(self.series.coefficients)(there)
        mirror = jax.vmap(lambda r: Mirror.through(self.series.cosines, r))(mirrored)
        return PlaneSample(self, bsdf[:n], regular[:n], coefficients, mirror)


class PlaneSample(NamedTuple):
    """A sample with a plane surface.

    Parameters
    ----------
    hemisphere
        Directions.
    bsdf
        In the wanted directions, 1/sr.
    regular
        Share of the incident power in the regular peak of each of them.
    coefficients, mirror
        Series of the BSDF and regular reflectance by angle, at each wavelength.
    """

    hemisphere: Hemisphere
    bsdf: Float[Array, " pairs"]
    regular: Float[Array, " pairs"]
    coefficients: Coefficients
    mirror: Mirror
