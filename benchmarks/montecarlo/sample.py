"""Samples of the Monte Carlo: phase functions, layers, faces, and directions to look from."""

from dataclasses import dataclass

import numpy as np

from benchmarks.montecarlo.facets import Facets


class HenyeyGreenstein:
    """Sum of Henyey-Greenstein functions; ``shares`` sum to 1."""

    def __init__(self, *asymmetries: float, shares=(1.0,)):
        self.asymmetries, self.shares = asymmetries, shares

    def value(self, cosine):
        """Per steradian, integral 1."""
        total = 0.0
        for g, share in zip(self.asymmetries, self.shares, strict=True):
            base = (1 + g * g) - (2 * g) * cosine
            base *= np.sqrt(base)
            total = total + share * (1 - g * g) / (4 * np.pi) / base
        return total

    def draw(self, n, random):
        """Cosines of ``n`` scattering angles."""
        g = np.array(self.asymmetries)[random.choice(len(self.shares), n, p=self.shares)]
        u = random.random(n)
        safe = np.where(np.abs(g) < 1e-6, 1e-6, g)
        return (1 + safe**2 - ((1 - safe**2) / (1 - safe + 2 * safe * u)) ** 2) / (2 * safe)


class Tabulated:
    """Phase function linear in the cosine between the points of a table."""

    def __init__(self, cosines, values):
        order = np.argsort(cosines)
        self.cosines, values = np.asarray(cosines, float)[order], np.asarray(values, float)[order]
        parts = 0.5 * np.diff(self.cosines) * (values[1:] + values[:-1])
        self.values = values / (2 * np.pi * parts.sum())
        self._cumulative = np.concatenate([[0.0], np.cumsum(parts)]) / parts.sum()
        # In an even table, a point is found without a search.
        steps = np.diff(self.cosines)
        self._slopes = np.diff(self.values) / steps
        self._per_step = 1 / steps[0] if np.allclose(steps, steps[0], rtol=1e-9) else None

    def value(self, cosine):
        """Per steradian, integral 1."""
        if self._per_step is None:
            return np.interp(cosine, self.cosines, self.values)
        above = cosine - self.cosines[0]
        k = np.clip((above * self._per_step).astype(np.int32), 0, self._slopes.size - 1)
        return self.values[k] + self._slopes[k] * (above - k / self._per_step)

    def draw(self, n, random):
        """Cosines of ``n`` scattering angles."""
        u = random.random(n)
        k = np.clip(np.searchsorted(self._cumulative, u, side="right") - 1, 0, self.cosines.size - 2)
        first, width = self.values[k], self.cosines[k + 1] - self.cosines[k]
        part = (u - self._cumulative[k]) / (2 * np.pi)
        slope = (self.values[k + 1] - first) / width
        root = np.sqrt(np.maximum(first**2 + 2 * slope * part, 0.0))
        return self.cosines[k] + np.minimum(2 * part / np.maximum(first + root, 1e-300), width)


@dataclass(frozen=True)
class Layer:
    """Homogeneous layer; ``thickness_mm`` may be infinite if it scatters or absorbs."""

    index: float
    thickness_mm: float
    scattering_per_mm: float = 0.0
    absorption_per_mm: float = 0.0
    phase: HenyeyGreenstein | Tabulated | None = None


@dataclass(frozen=True)
class Sample:
    """Layers from the lit side.

    Parameters
    ----------
    layers
        The layers.
    index_front, index_back
        Of the surroundings.
    faces
        One more than layers: `Facets`, or None where smooth; empty: all smooth.
    backing_albedo
        Of a Lambertian backing behind the sample, in the surroundings at the back; None without.
    beam_radius_mm, seen_radius_mm
        Uniform disc across the beam, so an ellipse on the sample; and radius around the place where its axis
        enters (in R) or leaves (in T) within which light that leaves is seen; None: all.
    """

    layers: tuple[Layer, ...]
    index_front: float = 1.0
    index_back: float = 1.0
    faces: tuple[Facets | None, ...] = ()
    backing_albedo: float | None = None
    beam_radius_mm: float = 0.0
    seen_radius_mm: float | None = None

    @property
    def indices(self):
        """Of all media, from front to back."""
        return np.array([self.index_front, *(layer.index for layer in self.layers), self.index_back])

    def axis_offset(self, theta_deg):
        """Shift along x of the axis of the beam on its way through all layers; 0 if it does not pass."""
        sines = self.index_front * np.sin(np.deg2rad(theta_deg)) / self.indices[1:-1]
        thickness = self.per_medium("thickness_mm")[1:-1]
        if np.any(sines >= 1) or np.any(np.isinf(thickness)):
            return 0.0
        return np.sum(thickness * sines / np.sqrt(1 - sines**2))

    def rough(self, face):
        """Facets of a face; None where smooth or where the index does not change."""
        same = self.indices[face] == self.indices[face + 1]
        return None if same or not self.faces else self.faces[face]

    def per_medium(self, name, outside=0.0):
        """A property of the layers, with the value of both surroundings."""
        return np.array([outside, *(getattr(layer, name) for layer in self.layers), outside])


@dataclass(frozen=True)
class Detectors:
    """Directions in the surroundings, as the columns of a measurement at one incidence."""

    theta_deg: np.ndarray
    phi_deg: np.ndarray
    is_transmission: np.ndarray


def sample_from(description):
    """Sample from a dictionary with the names of the fields of `Sample` and `Layer`.

    ``phase`` of a layer: ``{"g": [...], "shares": [...]}`` or ``{"cosines": [...], "values": [...]}``; a
    rough face: ``{"density": ..., "sigma_deg": ...}``.
    """
    layers = []
    for layer in description["layers"]:
        phase = layer.get("phase")
        if phase is not None:
            shares = phase.get("shares", (1.0,))
            tabulated = "cosines" in phase
            phase = Tabulated(**phase) if tabulated else HenyeyGreenstein(*phase["g"], shares=shares)
        layers.append(Layer(**{**layer, "phase": phase}))
    faces = tuple(
        None if face is None else Facets(face["density"], np.tan(np.deg2rad(face["sigma_deg"])))
        for face in description.get("faces", ())
    )
    return Sample(**{**description, "layers": tuple(layers), "faces": faces})
