"""Layers of spheres, by the Mie series of miepython."""

from collections.abc import Iterable
from typing import NamedTuple

import miepython
import numpy as np

from benchmarks.montecarlo.sample import Layer, Tabulated

_COSINES = np.cos(np.linspace(0, np.pi, 2001))


class Spheres(NamedTuple):
    """Equal spheres: radius, refractive index n - ik, and share of the layer's volume."""

    radius_nm: float
    index: complex
    volume_fraction: float


class EvenTable(Tabulated):
    """Phase function looked up at equal steps of the cosine, which is several times as fast."""

    _STEPS = 200_000

    def __init__(self, cosines, values):
        super().__init__(cosines, values)
        self._even = super().value(np.linspace(-1.0, 1.0, self._STEPS + 1))

    def value(self, cosine):
        """Per steradian, integral 1."""
        return self._even[((cosine + 1.0) * (0.5 * self._STEPS) + 0.5).astype(np.int32)]


def layer_of_spheres(
    kinds: Iterable[Spheres], binder_index: float, thickness_mm: float, wavelength_nm: float
) -> Layer:
    """A layer of spheres in a binder; the cross sections of all kinds add up."""
    scattering, absorption, phase = 0.0, 0.0, np.zeros(_COSINES.size)
    for one in kinds:
        index, size = one.index / binder_index, 2 * np.pi * one.radius_nm * binder_index / wavelength_nm
        extinct, scattered, *_ = miepython.efficiencies_mx(index, size)
        # Cross section of a sphere over its volume, times their share.
        per_mm = 0.75 * one.volume_fraction / (one.radius_nm * 1e-6)
        scattering += per_mm * float(scattered)
        absorption += per_mm * float(extinct - scattered)
        phase += per_mm * scattered * miepython.i_unpolarized(index, size, _COSINES, norm="one")
    return Layer(binder_index, thickness_mm, scattering, absorption, EvenTable(_COSINES, phase))
