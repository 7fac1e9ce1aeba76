"""Random paths through a light guide, from the eye to the lamp."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.render.dots import Dots
from jaxink.render.guide import Guide
from jaxink.render.smooth_faces import fresnel

NORMAL, HEMISPHERE = "normal", "hemisphere"
# Bins of the picture along the side of a cell.
BINS = 6
# So many are traced at once, which takes about 2 GB.
_MOST_PATHS = 4_000_000


class _Paths(NamedTuple):
    """Paths, each from a bin of the face."""

    bins: Int[np.ndarray, " n"]
    position_mm: Float[np.ndarray, "n 3"]
    direction: Float[np.ndarray, "n 3"]
    weight: Float[np.ndarray, "n wavelengths"]

    def where(self, chosen: Bool[np.ndarray, " n"]) -> "_Paths":
        return _Paths(*(a[chosen] for a in self))


def guide_batch(
    guide: Guide, dots: Dots, view: str, paths_per_bin: int, random: np.random.Generator
) -> Float[np.ndarray, "rows columns wavelengths"]:
    """Radiance of the exit face over that of the lamp, in each bin of the face.

    Parameters
    ----------
    guide
        The guide, with the refractive indices that belong to the dots.
    dots
        Its dots.
    view
        ``normal``: radiance along the normal. ``hemisphere``: mean over the hemisphere, weighted with the
        cosine, which is exitance over pi.
    paths_per_bin
        Number of paths of each bin; a cell has `BINS` by `BINS` of them.
    random
        Source of random numbers.

    Notes
    -----
    Radiance over the squared refractive index is the same along a path except where light is absorbed or
    divided, and a path follows one of the parts, so a path that reaches the lamp counts with the weights of
    the dots alone.
    """
    n_bins = guide.rows * BINS * guide.columns * BINS
    most = max(1, _MOST_PATHS // n_bins)
    whole, rest = divmod(paths_per_bin, most)
    numbers = [most] * whole + [rest] * (rest > 0)
    found = [n * _traced(guide, dots, view, n, random) for n in numbers]
    return np.sum(found, axis=0) / paths_per_bin


def _traced(
    guide: Guide, dots: Dots, view: str, paths_per_bin: int, random: np.random.Generator
) -> Float[np.ndarray, "rows columns wavelengths"]:
    """As `guide_batch`, of all paths at once."""
    shape = guide.rows * BINS, guide.columns * BINS
    side = guide.pitch_mm / BINS
    bins = np.tile(np.arange(shape[0] * shape[1]), paths_per_bin)
    n = len(bins)
    row, column = np.divmod(bins, shape[1])
    ratio = dots.indices[0] / dots.indices[1]
    cosine = np.ones(n) if view == NORMAL else np.sqrt(random.random(n))
    sine, azimuth = np.sqrt(1 - cosine**2) / ratio, 2 * np.pi * random.random(n)
    position = np.stack(
        [
            (column + random.random(n)) * side,
            (row + random.random(n)) * side,
            np.full(n, guide.thickness_mm),
        ],
        axis=1,
    )
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -np.sqrt(1 - sine**2)], axis=1)
    enters = random.random(n) >= fresnel(-direction[:, 2], ratio)
    weight = np.ones((n, dots.n_wavelengths))
    found = np.zeros((shape[0] * shape[1], weight.shape[1]))
    paths = _Paths(bins, position, direction, weight).where(enters)
    while len(paths.bins):
        # All paths come to a dot before any goes on from there, because one call for many costs little more
        # than one for a few.
        arrived = []
        while len(paths.bins):
            paths, at_dots = _to_next_face(guide, ratio, random, found, paths)
            arrived.append(at_dots)
        paths = _Paths(*(np.concatenate(parts) for parts in zip(*arrived, strict=True)))
        after = dots.visit(guide, paths.position_mm, paths.direction, random)
        weight = paths.weight * after.weight
        paths = _Paths(paths.bins, after.position_mm, after.direction, weight).where(after.goes_on)
    return (found / paths_per_bin).reshape(*shape, -1)


def _to_next_face(
    guide: Guide, ratio: float, random: np.random.Generator, found: Float[np.ndarray, "bins w"], paths: _Paths
) -> tuple[_Paths, _Paths]:
    """Paths that go on within the plate, and those on a dot; those that reach the lamp are counted."""
    bins, position, direction, weight = paths
    sizes = np.array(guide.sizes_mm)
    n = len(bins)
    ahead = np.where(direction > 0, sizes, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(direction != 0, (ahead - position) / direction, np.inf)
    axis = np.argmin(distance, axis=1)
    each = np.arange(n)
    position += np.maximum(distance[each, axis], 0.0)[:, None] * direction
    position[each, axis] = ahead[each, axis]
    goes_up = direction[each, axis] > 0
    is_lower = (axis == 2) & ~goes_up
    on_dot = np.zeros(n, bool)
    lower = np.flatnonzero(is_lower)
    on_dot[lower] = guide.is_printed(position[lower, 0], position[lower, 1])
    is_lit = (axis == 0) & ~goes_up
    is_mirror = (axis != 2) & ~is_lit
    reflectance = np.where(is_mirror, guide.edge_reflectance, fresnel(abs(direction[each, axis]), ratio))
    is_reflected = random.random(n) < reflectance
    leaves = is_lit & ~is_reflected
    np.add.at(found, bins[leaves], weight[leaves])
    stays = is_reflected & ~on_dot
    here = np.flatnonzero(stays)
    direction[here, axis[here]] *= -1
    return paths.where(stays), paths.where(on_dot)
