"""Random paths through a light guide, from the eye to the lamp."""

import numpy as np
from jaxtyping import Float

from jaxink.render.dots import Dots
from jaxink.render.guide import Guide
from jaxink.render.smooth_faces import fresnel

NORMAL, HEMISPHERE = "normal", "hemisphere"
# Bins of the picture along the side of a cell.
BINS = 6


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
    alive = tuple(a[enters] for a in (bins, position, direction, weight))
    while len(alive[0]):
        alive = _step(guide, dots, ratio, random, found, *alive)
    return (found / paths_per_bin).reshape(*shape, -1)


def _step(guide, dots, ratio, random, found, bins, position, direction, weight):
    """Paths after the next face; those that reach the lamp are counted."""
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
    there = np.flatnonzero(on_dot)
    if len(there):
        after = dots.visit(guide, position[there], direction[there], random)
        stays[there] = after.goes_on
        position[there], direction[there] = after.position_mm, after.direction
        weight[there] *= after.weight
    return tuple(a[stays] for a in (bins, position, direction, weight))
