"""Settings of the rows of a residual: scans, the order along them, and neighbours in angle."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from jaxink.display.brief import brief_repr
from jaxink.measurement import GonioData, angular_distance_deg

# Azimuths closer than this belong to one plane.
_PLANE_DEG = 0.1
_NEIGHBOURS = 4


@dataclass(frozen=True, eq=False)
class Points:
    """Settings of the points of a residual, in its order.

    Parameters
    ----------
    scan
        Number of the scan (one side, incidence and wavelength) of each point, from 0 to scans - 1.
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        See `GonioData`.
    order
        When each point was measured, in any unit.
    """

    __repr__ = brief_repr

    scan: Int[np.ndarray, " points"]
    theta_i_deg: Float[np.ndarray, " points"]
    theta_o_deg: Float[np.ndarray, " points"]
    phi_deg: Float[np.ndarray, " points"]
    wavelength_nm: Float[np.ndarray, " points"]
    is_transmission: Bool[np.ndarray, " points"]
    order: Float[np.ndarray, " points"]

    @classmethod
    def of(cls, data: GonioData) -> "Points":
        """The points that are not masked, in the order of their rows."""
        used = data.used
        return cls(
            data.used_scan_index,
            data.theta_i_deg[used],
            data.theta_o_deg[used],
            data.phi_deg[used],
            data.wavelength_nm[used],
            data.is_transmission[used],
            data.reading_order[used].astype(float),
        )

    def __len__(self) -> int:
        return self.scan.size

    @property
    def n_scans(self) -> int:
        """Number of scans."""
        return int(self.scan.max()) + 1

    @cached_property
    def direction(self) -> Float[np.ndarray, "points 3"]:
        """Unit vector of view, with the normal of its side along z."""
        theta, phi = np.deg2rad(self.theta_o_deg), np.deg2rad(self.phi_deg)
        return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)

    @cached_property
    def from_forward_deg(self) -> Float[np.ndarray, " points"]:
        """Angle to the specular direction in reflection, to the undeviated beam in transmission."""
        return angular_distance_deg(self.theta_o_deg, self.phi_deg, self.theta_i_deg, 180.0)

    @cached_property
    def from_retro_deg(self) -> Float[np.ndarray, " points"]:
        """Angle to the direction of the source; nan in transmission."""
        angle = angular_distance_deg(self.theta_o_deg, self.phi_deg, self.theta_i_deg, 0.0)
        return np.where(self.is_transmission, np.nan, angle)

    @cached_property
    def path(self) -> Int[np.ndarray, " points"]:
        """Order of the points along their scans, scan by scan.

        From horizon to horizon in one plane through the normal, and back in the next; around the rings of
        equal polar angle if a scan has more planes than rings.
        """
        azimuth = np.rint(self.phi_deg / _PLANE_DEG).astype(int)
        half_turn = round(180 / _PLANE_DEG)
        polar = np.rint(self.theta_o_deg / _PLANE_DEG).astype(int)
        plane = np.mod(azimuth, half_turn)
        signed = np.where(np.mod(azimuth, 2 * half_turn) < half_turn, 1, -1) * self.theta_o_deg
        pieces = []
        for scan in range(self.n_scans):
            here = np.flatnonzero(self.scan == scan)
            lines, along = plane[here], signed[here]
            if np.unique(polar[here]).size < np.unique(lines).size:
                lines, along = polar[here], self.phi_deg[here]
            _, rank = np.unique(lines, return_inverse=True)
            rank = rank.reshape(-1)
            pieces.append(here[np.lexsort((np.where(rank % 2 == 0, along, -along), rank))])
        return np.concatenate(pieces)

    @cached_property
    def neighbours(self) -> csr_array:
        """Pairs of neighbouring directions within a scan, each pair once.

        Each point with its four nearest, by the distance of the unit vectors.
        """
        pairs = []
        for scan in range(self.n_scans):
            here = np.flatnonzero(self.scan == scan)
            if here.size < 2:
                continue
            count = min(_NEIGHBOURS + 1, here.size)
            _, near = cKDTree(self.direction[here]).query(self.direction[here], count)
            a, b = np.repeat(here, count), here[near.reshape(-1)]
            pairs.append(np.stack([np.minimum(a, b), np.maximum(a, b)])[:, a != b])
        return self._graph(pairs)

    @cached_property
    def across_incidence(self) -> csr_array:
        """Pairs of the same direction in scans of neighbouring incidence, otherwise equal."""
        return self._across(self.theta_i_deg, self.wavelength_nm)

    @cached_property
    def across_wavelength(self) -> csr_array:
        """Pairs of the same direction in scans of neighbouring wavelength, otherwise equal."""
        return self._across(self.wavelength_nm, self.theta_i_deg)

    def _across(self, running, fixed) -> csr_array:
        first = np.array([int(np.argmax(self.scan == scan)) for scan in range(self.n_scans)])
        series: dict[tuple, list[int]] = {}
        for scan in np.argsort(running[first], kind="stable"):
            key = (bool(self.is_transmission[first[scan]]), round(float(fixed[first[scan]]), 3))
            series.setdefault(key, []).append(int(scan))
        pairs = []
        for scans in series.values():
            for one, next_one in pairwise(scans):
                pairs.append(self._same_direction(one, next_one))
        return self._graph(pairs)

    def _same_direction(self, one, other):
        """Nearest points of two scans, if they are closer than the spacing of the second."""
        a, b = np.flatnonzero(self.scan == one), np.flatnonzero(self.scan == other)
        tree = cKDTree(self.direction[b])
        distance, near = tree.query(self.direction[a])
        spacing = np.median(tree.query(self.direction[b], min(2, b.size))[0].reshape(b.size, -1)[:, -1])
        close = distance <= max(spacing, 1e-6)
        return np.stack([a[close], b[near[close]]])

    def _graph(self, pairs) -> csr_array:
        size = (len(self), len(self))
        if not pairs:
            return csr_array(size)
        a, b = np.unique(np.concatenate(pairs, axis=1), axis=1)
        return csr_array((np.ones(a.size), (a, b)), shape=size)
