"""Polarised light in a layer of spheres by Monte Carlo; nothing here imports jaxink.

The field of a photon is a coherency matrix <E E*> in space: a sphere scatters by its two amplitudes, an
interface acts by Fresnel's, with their phases, so that no Stokes vectors or Mueller matrices occur, and
circular polarisation is included. The same paths, drawn by the scalar theory, also carry its weight, hence
the difference of both theories has little noise.
"""

from typing import NamedTuple

import numpy as np

N_BATCHES = 20


class Spheres(NamedTuple):
    """Amplitudes of spheres of several sizes at angles in equal steps from 0 to 180 degrees.

    ``perpendicular`` and ``parallel`` to the scattering plane (S_1 and S_2), shape ``(sizes, angles)``;
    the mean over the sphere of half the sum of their squares is 1. ``share``: of each size in the
    scattering.
    """

    perpendicular: np.ndarray
    parallel: np.ndarray
    share: np.ndarray

    @property
    def angles(self):
        """Angles of the tables, radians."""
        return np.linspace(0, np.pi, self.parallel.shape[1])

    def amplitudes(self, size, cosine):
        """Both amplitudes of a size of each cosine."""
        place = np.arccos(np.clip(cosine, -1, 1)) / np.pi * (self.parallel.shape[1] - 1)
        left = np.minimum(place.astype(int), self.parallel.shape[1] - 2)
        t = place - left
        tables = self.perpendicular, self.parallel
        return [table[size, left] * (1 - t) + table[size, left + 1] * t for table in tables]


def rayleigh() -> Spheres:
    """Spheres much smaller than the wavelength."""
    cosine = np.cos(np.linspace(0, np.pi, 2001))
    return Spheres(np.full((1, 2001), 1.5**0.5 + 0j), 1.5**0.5 * cosine[None] + 0j, np.ones(1))


class PolarisedLayer(NamedTuple):
    """A layer of spheres between half spaces of index 1."""

    optical_thickness: float
    albedo: float
    index: float
    spheres: Spheres


class Orders(NamedTuple):
    """BSDF in 1/sr at the detectors by batches, shape ``(3, detectors, batches)``.

    Light scattered once, and twice, that no face has reflected on its way; all light together.
    """

    vector: np.ndarray
    scalar: np.ndarray


def simulate(layer: PolarisedLayer, theta_i_deg: float, detectors, n_photons: int, seed: int) -> Orders:
    """Light scattered by the layer from an unpolarised source to detectors of all polarisations.

    ``detectors``: polar angle and azimuth in degrees, 180 in the half-plane of the specular direction, and
    whether in transmission.
    """
    theta_o_deg, phi_deg, is_transmission = map(np.asarray, detectors)
    theta_o, phi = np.deg2rad(theta_o_deg), np.deg2rad(180.0 - phi_deg)
    side = np.where(is_transmission, 1.0, -1.0)
    sine = np.sin(theta_o) / layer.index
    inside = np.stack([sine * np.cos(phi), sine * np.sin(phi), side * np.sqrt(1 - sine**2)])
    outward = np.stack([_transmission(layer.index, 1.0, inside[:, d]) for d in range(theta_o.size)])
    to_front = ~is_transmission

    random = np.random.default_rng(seed)
    cumulative = _cumulative(layer.spheres)
    per_batch = n_photons // N_BATCHES
    found = np.zeros((2, 3, theta_o.size, N_BATCHES))
    for batch in range(N_BATCHES):
        photons = _enter(layer, theta_i_deg, per_batch)
        order = 0
        while photons is not None:
            photons = _fly(layer, photons, random)
            order += 1
            if photons is None:
                break
            size = random.choice(layer.spheres.share.size, photons.depth.size, p=layer.spheres.share)
            seen = _seen(layer, photons, size, inside, outward, to_front) / per_batch
            found[:, 2, :, batch] += seen.sum(axis=-1)
            if order <= 2:
                found[:, order - 1, :, batch] += seen[..., photons.direct].sum(axis=-1)
            photons = _scatter(layer, photons, size, cumulative, random)
    return Orders(*found)


class _Photons(NamedTuple):
    """Direction, depth in optical thickness, coherency matrix, scalar weight, and whether never reflected."""

    direction: np.ndarray
    depth: np.ndarray
    field: np.ndarray
    weight: np.ndarray
    direct: np.ndarray

    def at(self, which):
        return _Photons(
            self.direction[:, which],
            self.depth[which],
            self.field[which],
            self.weight[which],
            self.direct[which],
        )


def _amplitudes(index_1, index_2, cosine):
    """Amplitudes of reflection and transmission, s then p, the latter so that their squares are powers."""
    cosine_2 = np.sqrt(1 - (index_1 / index_2) ** 2 * (1 - cosine**2) + 0j)
    s = (index_1 * cosine - index_2 * cosine_2) / (index_1 * cosine + index_2 * cosine_2)
    p = (index_2 * cosine - index_1 * cosine_2) / (index_2 * cosine + index_1 * cosine_2)
    through = np.sqrt(np.real(index_2 * cosine_2) / (index_1 * cosine))
    t_s = 2 * index_1 * cosine / (index_1 * cosine + index_2 * cosine_2) * through
    t_p = 2 * index_1 * cosine / (index_2 * cosine + index_1 * cosine_2) * through
    return s, p, t_s, t_p


def _axes(direction):
    """Unit vectors perpendicular to the plane of incidence, and in it."""
    across = np.stack([-direction[1], direction[0], np.zeros_like(direction[0])])
    length = np.linalg.norm(across, axis=0)
    across = np.where(length > 1e-12, across / np.maximum(length, 1e-12), np.array([0.0, 1.0, 0.0])[:, None])
    return across, np.cross(across, direction, axis=0)


def _transmission(index_1, index_2, direction):
    """Matrix from the field inside to components perpendicular to and in the plane of incidence outside."""
    direction = direction[:, None]
    across, along = _axes(direction)
    _, _, t_s, t_p = _amplitudes(index_1, index_2, np.abs(direction[2]))
    return np.stack([t_s * across, t_p * along])[:, :, 0]


def _enter(layer, theta_i_deg, n):
    theta = np.deg2rad(theta_i_deg)
    _, _, t_s, t_p = _amplitudes(1.0, layer.index, np.cos(theta))
    sine = np.sin(theta) / layer.index
    direction = np.array([sine, 0.0, np.sqrt(1 - sine**2)])
    across, along = _axes(direction[:, None])
    powers = np.abs(np.array([t_s, t_p])) ** 2 / 2
    field = sum(
        power * np.outer(axis, axis) for power, axis in zip(powers, (across[:, 0], along[:, 0]), strict=True)
    )
    return _Photons(
        np.repeat(direction[:, None], n, axis=1),
        np.zeros(n),
        np.repeat(field[None].astype(complex), n, axis=0),
        np.full(n, powers.sum()),
        np.ones(n, bool),
    )


def _fly(layer, photons, random):
    """To the next event; at a face, the part that leaves is lost, and the path goes on reflected."""
    way = -np.log(1 - random.random(photons.depth.size))
    while True:
        vertical = photons.direction[2]
        depth = photons.depth + way * vertical
        outside = (depth < 0) | (depth > layer.optical_thickness)
        if not outside.any():
            return photons._replace(depth=depth)
        face = np.where(vertical > 0, layer.optical_thickness, 0.0)
        cosine = np.abs(vertical)
        r_s, r_p, _, _ = _amplitudes(layer.index, 1.0, cosine)
        chance = (np.abs(r_s) ** 2 + np.abs(r_p) ** 2) / 2
        stays = ~outside | (random.random(depth.size) < chance)
        if not stays.any():
            return None
        across, along = _axes(photons.direction)
        mirrored = photons.direction * np.array([1.0, 1.0, -1.0])[:, None]
        _, along_after = _axes(mirrored)
        # A reflected p field keeps its component across the direction in the plane of incidence.
        matrix = r_s * across[:, None] * across[None] + r_p * along_after[:, None] * along[None]
        matrix = np.moveaxis(matrix, -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            field = matrix @ photons.field @ np.conj(np.swapaxes(matrix, 1, 2)) / chance[:, None, None]
        used = np.abs((face - photons.depth) / vertical)
        photons = _Photons(
            np.where(outside, mirrored, photons.direction),
            np.where(outside, face, photons.depth),
            np.where(outside[:, None, None], field, photons.field),
            photons.weight,
            photons.direct & ~outside,
        ).at(stays)
        way = np.where(outside, way - used, way)[stays]


def _planes(before, after):
    """Axes perpendicular to the scattering plane, and in it before and after."""
    across = np.cross(before, after, axis=0)
    length = np.linalg.norm(across, axis=0)
    plain = np.broadcast_to(_axes(before)[0], across.shape)
    across = np.where(length > 1e-9, across / np.maximum(length, 1e-9), plain)
    return across, np.cross(across, before, axis=0), np.cross(across, after, axis=0)


def _seen(layer, photons, size, inside, outward, to_front):
    """Light that leaves unscattered towards each detector, by both theories."""
    found = np.empty((2, inside.shape[1], photons.depth.size))
    for d, (to, axes) in enumerate(zip(inside.T[:, :, None], outward, strict=True)):
        cosine = np.abs(to[2])
        rest = photons.depth if to_front[d] else layer.optical_thickness - photons.depth
        share = np.exp(-rest / cosine) * layer.albedo / (4 * np.pi * layer.index**2 * cosine)
        turn = np.sum(to * photons.direction, axis=0)
        s_1, s_2 = layer.spheres.amplitudes(size, turn)
        across, before, after = _planes(photons.direction, to)
        power = 0.0
        for axis in axes:
            seen = s_1 * (axis @ across) * across + s_2 * (axis @ after) * before
            power = power + np.einsum("in,nij,jn->n", seen, photons.field, np.conj(seen)).real
        scalar = (np.abs(s_1) ** 2 + np.abs(s_2) ** 2) / 2 * photons.weight
        found[:, d] = share * power, share * scalar * np.sum(np.abs(axes) ** 2) / 2
    return found


def _cumulative(spheres: Spheres):
    """Cumulative distribution of the scattering angle of each size."""
    density = (np.abs(spheres.perpendicular) ** 2 + np.abs(spheres.parallel) ** 2) * np.sin(spheres.angles)
    steps = (density[:, 1:] + density[:, :-1]) / 2
    total = np.concatenate([np.zeros((len(steps), 1)), np.cumsum(steps, axis=1)], axis=1)
    return total / total[:, -1:]


def _scatter(layer, photons, size, cumulative, random):
    """New directions by the scalar phase function; roulette for what is left."""
    n = photons.depth.size
    angle = np.empty(n)
    for k, table in enumerate(cumulative):
        angle[size == k] = np.interp(random.random(np.sum(size == k)), table, layer.spheres.angles)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = 2 * np.pi * random.random(n)
    across, along = _axes(photons.direction)
    direction = cosine * photons.direction + sine * (np.cos(turn) * along + np.sin(turn) * across)
    direction = direction / np.linalg.norm(direction, axis=0)
    across, before, after = _planes(photons.direction, direction)
    s_1, s_2 = layer.spheres.amplitudes(size, cosine)
    matrix = np.moveaxis(s_1 * across[:, None] * across + s_2 * after[:, None] * before, -1, 0)
    density = (np.abs(s_1) ** 2 + np.abs(s_2) ** 2) / 2
    factor = layer.albedo / density[:, None, None]
    field = factor * (matrix @ photons.field @ np.conj(np.swapaxes(matrix, 1, 2)))
    weight = layer.albedo * photons.weight
    kept = (weight > 1e-3) | (random.random(n) < 0.1)
    boost = np.where(weight > 1e-3, 1.0, 10.0)
    after = _Photons(direction, photons.depth, field * boost[:, None, None], weight * boost, photons.direct)
    return after.at(kept) if kept.any() else None
