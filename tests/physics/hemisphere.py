"""Totals of the BSDF over hemispheres, at the solver's own channels, and the stacks the physics tests share."""

from typing import NamedTuple

import equinox as eqx
import numpy as np

from jaxink.bsdf import diffuse_bsdf, regular_power
from jaxink.geometry import Directions
from jaxink.optics import ClearLayer, ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.stack import SolverConfig, Stack

SMALL = SolverConfig(12, 8, 24, 8)

bsdf_of = eqx.filter_jit(diffuse_bsdf)


def ink(refractive_index=1.5, optical_thickness=2.0, albedo=0.9, asymmetry=0.4) -> ScatteringLayer:
    return ScatteringLayer(refractive_index, optical_thickness, albedo, HenyeyGreenstein(asymmetry))


def matched(optical_thickness, albedo, asymmetry) -> Stack:
    """An ink with the index of its surroundings: no interface at all."""
    return Stack((ink(1.0, optical_thickness, albedo, asymmetry),), 1.0, 1.0, (0,), exposed=True)


def film(layer: ScatteringLayer, index_front=1.0, index_back=1.0) -> Stack:
    """One ink layer between two half spaces; all three indices may differ."""
    return Stack((layer,), index_front, index_back, (0, 1, 2))


def printed(layer: ScatteringLayer, plate_index=1.5, plate_thickness=0.0, behind=False) -> Stack:
    """An ink on a plate in air; the plate is lit first, or lies behind."""
    plate = ClearLayer(plate_index, plate_thickness)
    return Stack((layer, plate) if behind else (plate, layer), 1.0, 1.0, (0, 1, 2))


class Hemispheres(NamedTuple):
    """Every pair of channels that light can enter and leave by, at azimuths that integrate all orders.

    ``share`` is cos(theta_o) dOmega of each point, ``incidence`` the number of the incident channel.
    """

    directions: Directions
    share: np.ndarray
    incidence: np.ndarray
    sin_incidence: np.ndarray

    def reflectance(self, bsdf) -> np.ndarray:
        return self._total(bsdf, ~self.directions.is_transmission)

    def transmittance(self, bsdf) -> np.ndarray:
        return self._total(bsdf, self.directions.is_transmission)

    def _total(self, bsdf, side):
        flux = np.where(side, np.asarray(bsdf) * self.share, 0.0)
        return np.bincount(self.incidence, flux, len(self.sin_incidence))


def hemispheres(stack: Stack, config: SolverConfig = SMALL, n_azimuths: int = 12) -> Hemispheres:
    """All pairs of channels of a stack, as directions in its surroundings."""
    grid = stack.grid(config)
    kappa, etendue = np.asarray(grid.kappa), np.asarray(grid.etendue_weight)
    front, back = float(stack.index_front), float(stack.index_back)
    entering = np.flatnonzero(kappa < front)
    leaving = [(False, o, front) for o in np.flatnonzero(kappa < front)]
    leaving += [(True, o, back) for o in np.flatnonzero(kappa < back)]
    azimuths = (np.arange(n_azimuths) + 0.5) * 180 / n_azimuths
    number, pair, azimuth = (
        a.ravel()
        for a in np.meshgrid(np.arange(len(entering)), np.arange(len(leaving)), azimuths, indexing="ij")
    )
    side, channel, index = (np.array(column)[pair] for column in zip(*leaving, strict=True))
    sin_incidence, sin_outgoing = kappa[entering] / front, kappa[channel] / index
    distinct, outgoing = np.unique(sin_outgoing, return_inverse=True)
    directions = Directions(sin_incidence, distinct, number, outgoing, np.deg2rad(azimuth), side)
    share = etendue[channel] / index**2 * (2 * np.pi / n_azimuths)
    return Hemispheres(directions, share, number, sin_incidence)


def power_balance(stack: Stack, config: SolverConfig = SMALL, n_azimuths: int = 12):
    """Diffuse reflectance and transmittance, and regular ones, for light entering by each channel."""
    points = hemispheres(stack, config, n_azimuths)
    bsdf = bsdf_of(stack, points.directions, config)
    regular = [np.asarray(power) for power in regular_power(stack, points.sin_incidence)]
    return points.reflectance(bsdf), points.transmittance(bsdf), *regular
