"""Light that leaves a stack: totals over the solver's own channels, and pairs of arbitrary directions.

At its channels the solver interpolates nothing, so that totals show its balance of energy to rounding.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxink.optics.directions import Directions
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf, regular_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import plan_channels
from jaxink.solver.stack import Stack

SMALL = SolverConfig(12, 8, 24, 8)
# Azimuths of the totals; midpoints integrate all orders below twice their number.
N_AZIMUTHS = 12
N_PAIRS = 20


def ink(refractive_index=1.5, optical_thickness=2.0, albedo=0.9, asymmetry=0.3) -> ScatteringLayer:
    return ScatteringLayer(refractive_index, optical_thickness, albedo, HenyeyGreenstein(asymmetry))


def matched(optical_thickness=2.0, albedo=0.9, asymmetry=0.3) -> Stack:
    """An ink with the index of its surroundings: no interface at all."""
    return Stack((ink(1.0, optical_thickness, albedo, asymmetry),), 1.0, 1.0)


def film(layer: ScatteringLayer, index_front=1.0, index_back=1.0) -> Stack:
    """One ink layer between two half spaces; all three indices may differ."""
    return Stack((layer,), index_front, index_back)


def printed(layer: ScatteringLayer, plate_index=1.5, plate_thickness=0.0, behind=False) -> Stack:
    """An ink on a plate in air; the plate is lit first, or lies behind."""
    plate = ClearLayer(plate_index, plate_thickness)
    return Stack((layer, plate) if behind else (plate, layer), 1.0, 1.0)


def two_inks(first: ScatteringLayer, second: ScatteringLayer) -> Stack:
    return Stack((first, second), 1.0, 1.0)


class Light:
    """What leaves a stack.

    ``reflectance``, ``transmittance``: diffuse, for light entering by each channel. ``specular``,
    ``undeviated``: regular. ``bsdf``: at all points. ``reflected_pairs``, ``transmitted_pairs``: BSDF from
    a to b and from b to a, shape ``(2, N_PAIRS)``.
    """

    def __init__(self, stack: Stack, config: SolverConfig = SMALL):
        directions, share, n_entering = _points(stack, config)
        self.bsdf = np.asarray(diffuse_bsdf(stack, directions, config))
        n_pairs = 4 * N_PAIRS
        flux, side = self.bsdf[:-n_pairs] * share, directions.is_transmission[:-n_pairs]
        incidence = directions.incidence[:-n_pairs]
        self.reflectance = np.bincount(incidence, np.where(side, 0.0, flux), n_entering)
        self.transmittance = np.bincount(incidence, np.where(side, flux, 0.0), n_entering)
        entering = jnp.asarray(directions.sin_incidence[:n_entering])
        self.specular, self.undeviated = (np.asarray(p) for p in _regular(stack, entering))
        self.reflected_pairs, self.transmitted_pairs = self.bsdf[-n_pairs:].reshape(2, 2, N_PAIRS)

    @property
    def total(self):
        return self.reflectance + self.transmittance + self.specular + self.undeviated


_regular = eqx.filter_jit(regular_power)


def pair_angles():
    """Seeded polar angles a and b and azimuths, in rad."""
    random = np.random.default_rng(7)
    a, b = np.deg2rad(random.uniform(0, 85, (2, N_PAIRS)))
    return a, b, random.uniform(0, np.pi, N_PAIRS)


def _points(stack: Stack, config: SolverConfig):
    """Directions, cos(theta_o) dOmega of those that make the totals, and number of entering channels."""
    grid = plan_channels(stack).grid(stack, config)
    kappa, etendue = np.asarray(grid.kappa), np.asarray(grid.etendue_weight)
    front, back = float(stack.index_front), float(stack.index_back)
    entering = np.flatnonzero(kappa < front)
    leaving = [(False, o, front) for o in entering] + [(True, o, back) for o in np.flatnonzero(kappa < back)]
    azimuths = (np.arange(N_AZIMUTHS) + 0.5) * np.pi / N_AZIMUTHS
    axes = np.arange(len(entering)), np.arange(len(leaving)), azimuths
    incidence, way, azimuth = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    side, channel, index = (np.array(column)[way] for column in zip(*leaving, strict=True))
    share = etendue[channel] / index**2 * (2 * np.pi / N_AZIMUTHS)

    a, b, pair_azimuth = pair_angles()
    sines = np.sin(np.concatenate([a, b]))
    from_a, from_b = np.arange(N_PAIRS), N_PAIRS + np.arange(N_PAIRS)
    there, back_again = np.concatenate([from_a, from_b]), np.concatenate([from_b, from_a])
    directions = Directions(
        np.concatenate([kappa[entering] / front, sines]),
        np.concatenate([kappa[channel] / index, sines]),
        np.concatenate([incidence, np.tile(len(entering) + there, 2)]),
        np.concatenate([np.arange(len(way)), np.tile(len(way) + back_again, 2)]),
        np.concatenate([azimuth, np.tile(pair_azimuth, 4)]),
        np.concatenate([side, np.repeat([False, True], 2 * N_PAIRS)]),
    )
    return directions, share, len(entering)
