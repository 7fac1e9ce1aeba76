"""Averages over the cones of a goniometer's source and detector, regular peaks included."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.display.brief import brief_repr
from jaxink.optics import Directions


class Cones(eqx.Module):
    """Cones of source and detector, each a uniform disc in the two tangent angles.

    Parameters
    ----------
    source_half_angle_deg, detector_half_angle_deg
        Half angles; 0 is a single direction.
    """

    source_half_angle_deg: float = eqx.field(static=True, default=0.0)
    detector_half_angle_deg: float = eqx.field(static=True, default=0.0)

    @property
    def is_ideal(self) -> bool:
        """Whether both cones are single directions."""
        return self.source_half_angle_deg == 0 and self.detector_half_angle_deg == 0


# Seven points that integrate polynomials of degree 5 over the unit disc exactly: Abramowitz, Stegun 25.4.61.
_RADIUS = np.sqrt(2 / 3)
_DISC_POINTS = np.array(
    [(0.0, 0.0)] + [(_RADIUS * np.cos(a), _RADIUS * np.sin(a)) for a in np.arange(6) * np.pi / 3]
)
_DISC_WEIGHTS = np.array([1 / 4] + [1 / 8] * 6)


def _vectors(theta_deg, phi_deg):
    theta, phi = np.deg2rad(theta_deg), np.deg2rad(phi_deg)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def _disc_around(theta_deg, phi_deg, half_angle_deg):
    """Directions of the disc points around each direction, shape ``(points, disc, 3)``."""
    theta, phi = np.deg2rad(theta_deg), np.deg2rad(phi_deg)
    centre = _vectors(theta_deg, phi_deg)
    along = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)], axis=-1)
    across = np.stack([-np.sin(phi), np.cos(phi), np.zeros_like(phi)], axis=-1)
    points = _DISC_POINTS if half_angle_deg else np.zeros((1, 2))
    reach = np.tan(np.deg2rad(half_angle_deg))
    rays = centre[:, None] + reach * (
        points[:, 0, None] * along[:, None] + points[:, 1, None] * across[:, None]
    )
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


class ConeRays(eqx.Module):
    """Pairs of rays that sample the cones at each point of a measurement.

    Parameters
    ----------
    directions
        All ``points * rays`` pairs.
    weights
        Weight of each pair; rows sum to 1, and pairs beyond the horizon have weight 0.
    regular_share
        Contribution of a regular beam of unit power to each point, in 1/sr.
    """

    __repr__ = brief_repr

    directions: Directions
    weights: Float[np.ndarray, "points rays"]
    regular_share: Float[np.ndarray, " points"]

    def average(self, bsdf: Float[Array, " pairs"]) -> Float[Array, " points"]:
        """Average of the BSDF of all pairs over the cones of each point."""
        return jnp.sum(bsdf.reshape(self.weights.shape) * self.weights, axis=1)


def cone_rays(cones: Cones, theta_i_deg, theta_o_deg, phi_deg, is_transmission) -> ConeRays:
    """Rays that average a BSDF over the cones of source and detector.

    Parameters
    ----------
    cones
        Cones of the instrument.
    theta_i_deg, theta_o_deg, phi_deg, is_transmission
        Nominal directions, shape ``(points,)``.

    Notes
    -----
    A regular beam is a disc of the source's size; the detector sees the part that overlaps its own disc.

    References
    ----------
    Abramowitz, Stegun 1964, 25.4.61 (seven points per disc, exact for polynomials of degree 5).
    """
    theta_i, theta_o, phi = (np.asarray(a, float) for a in (theta_i_deg, theta_o_deg, phi_deg))
    side = np.asarray(is_transmission, bool)
    source = _disc_around(theta_i, np.zeros_like(theta_i), cones.source_half_angle_deg)
    detector = _disc_around(theta_o, phi, cones.detector_half_angle_deg)
    n_source, n_detector = source.shape[1], detector.shape[1]
    shape = (len(theta_i), n_source, n_detector)
    source = np.broadcast_to(source[:, :, None], (*shape, 3))
    detector = np.broadcast_to(detector[:, None], (*shape, 3))
    weights = (_DISC_WEIGHTS if n_source > 1 else np.ones(1))[:, None] * (
        _DISC_WEIGHTS if n_detector > 1 else np.ones(1)
    )
    visible = (source[..., 2] > 0) & (detector[..., 2] > 0)
    # The irradiance is proportional to the cosine of each source direction.
    weights = np.broadcast_to(weights, shape) * visible * source[..., 2]
    weights = (weights / weights.sum(axis=(1, 2), keepdims=True)).reshape(len(theta_i), -1)

    def polar(rays):
        return np.rad2deg(np.arccos(np.clip(rays[..., 2], 0, 1))).ravel()

    azimuth = np.arctan2(detector[..., 1], detector[..., 0]) - np.arctan2(source[..., 1], source[..., 0])
    directions = Directions.from_degrees(
        polar(source), polar(detector), np.rad2deg(azimuth).ravel(), np.repeat(side, n_source * n_detector)
    )
    return ConeRays(directions, weights, _regular_share(cones, theta_i, theta_o, phi))


def _regular_share(cones: Cones, theta_i, theta_o, phi):
    """Regular power seen per detector solid angle and cosine, for a beam of unit power."""
    if cones.is_ideal:
        return np.zeros_like(theta_i)
    expected, seen = _vectors(theta_i, np.full_like(phi, 180.0)), _vectors(theta_o, phi)
    distance = 2 * np.arcsin(np.clip(np.linalg.norm(expected - seen, axis=-1) / 2, 0, 1))
    s, d = (np.deg2rad(a) for a in (cones.source_half_angle_deg, cones.detector_half_angle_deg))
    solid_angle = np.pi * np.sin(d) ** 2 if d > 0 else np.pi * np.sin(s) ** 2
    if s == 0 or d == 0:
        seen_share = (distance < max(s, d)).astype(float)
    else:
        seen_share = _disc_overlap(distance, s, d) / (np.pi * s**2)
    return seen_share / (solid_angle * np.cos(np.deg2rad(theta_i)))


def _disc_overlap(distance, a, b):
    """Area common to two discs of radii a and b."""
    small, large = min(a, b), max(a, b)
    x = np.clip(distance, large - small + 1e-15, a + b)
    alpha = np.arccos(np.clip((x**2 + a**2 - b**2) / (2 * x * a), -1, 1))
    beta = np.arccos(np.clip((x**2 + b**2 - a**2) / (2 * x * b), -1, 1))
    lens = a**2 * (alpha - np.sin(2 * alpha) / 2) + b**2 * (beta - np.sin(2 * beta) / 2)
    return np.where(distance <= large - small, np.pi * small**2, np.where(distance >= a + b, 0.0, lens))
