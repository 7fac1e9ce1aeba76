"""What becomes of paths at a printed dot: as a sheet, or as a body of ink that scatters inside."""

import dataclasses
from functools import cached_property
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.export import Medium
from jaxink.render.sheet_sampling import INSIDE, SheetSampler, turned
from jaxink.render.smooth_faces import fresnel, refracted

_QUANTILES, _ANGLES = 100_001, 20_001


@runtime_checkable
class Pattern(Protocol):
    """Where dots are on the face of a plate."""

    def dot_at(
        self, position_mm: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Middle and radius in mm of the dot at each point."""
        ...

    def is_clear(
        self, x_mm: Float[np.ndarray, " n"], y_mm: Float[np.ndarray, " n"]
    ) -> Bool[np.ndarray, " n"]:
        """Whether points at the height of the printed face are on it and not on a dot."""
        ...


class AfterDot(NamedTuple):
    """Paths that came from the plate onto a dot.

    Parameters
    ----------
    goes_on
        Whether the path is in the plate again, shape ``(n,)``.
    position_mm, direction
        There, shape ``(n, 3)``.
    weight
        Factor at each wavelength, shape ``(n, wavelengths)``.
    """

    goes_on: Bool[np.ndarray, " n"]
    position_mm: Float[np.ndarray, "n 3"]
    direction: Float[np.ndarray, "n 3"]
    weight: Float[np.ndarray, "n wavelengths"]


@dataclasses.dataclass(frozen=True, eq=False)
class SheetDots:
    """Dots that are sheets without a thickness; what they transmit is lost below the plate.

    Parameters
    ----------
    sampler
        Of the ink's table.
    """

    sampler: SheetSampler

    @property
    def indices(self) -> tuple[float, float]:
        """Refractive indices of the plate and of what is around it, means over the wavelengths."""
        table = self.sampler.table
        return float(np.mean(table.index_inside)), float(np.mean(table.index_outside))

    @property
    def n_wavelengths(self) -> int:
        """Number of wavelengths that a path carries."""
        return len(self.sampler.table.wavelength_nm)

    def visit(self, pattern: Pattern, position_mm, direction, random) -> AfterDot:  # noqa: ARG002
        """What becomes of paths that arrive on dots, at the height 0, from above.

        Parameters
        ----------
        pattern
            Where the dots are.
        position_mm, direction
            Of the paths, shape ``(n, 3)``.
        random
            Source of random numbers.
        """
        scattered = self.sampler.scatter(INSIDE, np.arccos(np.clip(-direction[:, 2], 0.0, 1.0)), random)
        goes_on = scattered.goes_on & ~scattered.is_transmitted
        return AfterDot(goes_on, position_mm, turned(direction, scattered, 1.0), scattered.weight)


@dataclasses.dataclass(frozen=True, eq=False)
class VolumeDots:
    """Dots that are cylinders of ink, in which light is scattered and absorbed, at one wavelength.

    Their lower face and their rim refract into what is around the plate. Light that leaves through the rim,
    upwards, enters the plate again, unless it meets another dot.

    Parameters
    ----------
    medium
        The ink.
    wavelength
        Index of the wavelength.
    """

    medium: Medium
    wavelength: int

    @property
    def indices(self) -> tuple[float, float]:
        """Refractive indices of the plate and of what is around it."""
        inside, outside = self.medium.indices[:, self.wavelength]
        return float(inside), float(outside)

    @property
    def n_wavelengths(self) -> int:
        """One."""
        return 1

    @cached_property
    def _quantiles(self) -> np.ndarray:
        """Cosines of the scattering angle at equal steps of probability."""
        cosine = np.cos(np.linspace(np.pi, 0, _ANGLES))
        value = np.maximum(self.medium.phase[self.wavelength](cosine), 0.0)
        share = (value[1:] + value[:-1]) / 2 * np.diff(cosine)
        cumulated = np.concatenate([[0.0], np.cumsum(share)])
        return np.interp(np.linspace(0, 1, _QUANTILES), cumulated / cumulated[-1], cosine)

    def visit(self, pattern: Pattern, position_mm, direction, random) -> AfterDot:
        """See `SheetDots`."""
        walk = Walk(self, pattern, len(position_mm), random)
        walk.enter(position_mm, direction)
        walk.finish()
        return AfterDot(walk.goes_on, walk.left_at, walk.left_along, np.ones((len(position_mm), 1)))


Dots = SheetDots | VolumeDots


class Walk:
    """Paths within dots. Positions are counted from the middle of each dot, heights are 0 down to minus h.

    Parameters
    ----------
    dots, pattern
        The dots, and where they are.
    n
        Number of paths.
    random
        Source of random numbers.

    Attributes
    ----------
    goes_on, leaves_plate, is_scattered
        Of each path, whether it is in the plate again, left into what is around the plate, and was scattered.
    left_at, left_along
        Positions and directions of those that are in the plate again, shape ``(n, 3)``.
    paths, at, along
        Numbers, positions and directions of the paths that are still in a dot.
    """

    def __init__(self, dots: VolumeDots, pattern: Pattern, n: int, random: np.random.Generator):
        w, medium = dots.wavelength, dots.medium
        self._pattern, self._random, self._quantiles = pattern, random, dots._quantiles
        self._height_mm = medium.thickness_um / 1000
        self._extinction = float(medium.extinction_per_mm[w])
        self._albedo = float(medium.scattering_per_mm[w]) / max(self._extinction, 1e-300)
        index, (plate, around) = float(medium.refractive_index[w]), dots.indices
        self._to_plate, self._to_around, self._around_to_plate = index / plate, index / around, around / plate
        self.goes_on, self.leaves_plate, self.is_scattered = np.zeros((3, n), bool)
        self.left_at, self.left_along = np.zeros((2, n, 3))

    def enter(self, position_mm: Float[np.ndarray, "n 3"], direction: Float[np.ndarray, "n 3"]) -> None:
        """Start from the plate: the upper face of the ink reflects some of the paths."""
        is_reflected = self._random.random(len(direction)) < fresnel(-direction[:, 2], 1 / self._to_plate)
        self.goes_on[is_reflected] = True
        self.left_at[:], self.left_along[:] = position_mm, direction
        self.left_along[is_reflected, 2] *= -1
        paths = np.flatnonzero(~is_reflected)
        self.start(paths, position_mm[paths], refracted(direction[paths], 2, 1 / self._to_plate))

    def start(
        self,
        paths: Int[np.ndarray, " m"],
        position_mm: Float[np.ndarray, "m 3"],
        along: Float[np.ndarray, "m 3"],
    ) -> None:
        """Start some of the paths inside the ink, in the directions ``along`` there."""
        self.paths = paths
        self._centre, self._radius = self._pattern.dot_at(position_mm)
        self.at, self.along = position_mm - self._centre, along

    def finish(self) -> None:
        """Follow all paths until they have left or are absorbed."""
        while len(self.paths):
            self.step()

    def step(self) -> None:
        """To the next scattering or face."""
        random, n = self._random, len(self.paths)
        at, along = self.at, self.along
        free = random.exponential(1 / self._extinction, n)
        goes_up = along[:, 2] > 0
        ahead = np.where(goes_up, 0.0, -self._height_mm)
        with np.errstate(divide="ignore", invalid="ignore"):
            to_plane = np.maximum((ahead - at[:, 2]) / along[:, 2], 0.0)
        to_plane = np.where(along[:, 2] != 0, to_plane, np.inf)
        distance = np.minimum(to_plane, free)
        scatters, meets_rim = free <= to_plane, np.zeros(n, bool)
        end = at[:, :2] + distance[:, None] * along[:, :2]
        beyond = np.flatnonzero(end[:, 0] ** 2 + end[:, 1] ** 2 > self._radius**2)
        distance[beyond], scatters[beyond], meets_rim[beyond] = self._to_rim(beyond), False, True
        self.at = at + distance[:, None] * along
        on_plane = ~scatters & ~meets_rim
        stays = np.ones(n, bool)
        stays[scatters] = random.random(np.count_nonzero(scatters)) < self._albedo
        here = np.flatnonzero(scatters & stays)
        self.along[here] = self._scattered(along[here])
        self.is_scattered[self.paths[here]] = True
        self.at[on_plane, 2] = ahead[on_plane]
        upper = np.flatnonzero(on_plane & goes_up)
        stays[upper] = self._at_upper_face(upper)
        lower = np.flatnonzero(on_plane & ~goes_up)
        is_reflected = random.random(len(lower)) < fresnel(-along[lower, 2], self._to_around)
        self.along[lower[is_reflected], 2] *= -1
        stays[lower[~is_reflected]] = False
        self.leaves_plate[self.paths[lower[~is_reflected]]] = True
        rim = np.flatnonzero(meets_rim)
        stays[rim] = self.at_rim(rim)
        for name in ("paths", "_centre", "_radius", "at", "along"):
            setattr(self, name, getattr(self, name)[stays])

    def _to_rim(self, which: np.ndarray) -> np.ndarray:
        x, y = self.at[which, :2].T
        dx, dy = self.along[which, :2].T
        square, inward = dx**2 + dy**2, x * dx + y * dy
        inside = np.maximum(self._radius[which] ** 2 - x**2 - y**2, 0.0)
        return np.maximum((np.sqrt(inward**2 + square * inside) - inward) / square, 0.0)

    def _scattered(self, along: np.ndarray) -> np.ndarray:
        n = len(along)
        cosine = self._quantiles[self._random.integers(_QUANTILES, size=n)]
        sine, azimuth = np.sqrt(np.maximum(1 - cosine**2, 0.0)), 2 * np.pi * self._random.random(n)
        # Two directions across.
        sign = np.copysign(1.0, along[:, 2])
        a = -1 / (sign + along[:, 2])
        b = along[:, 0] * along[:, 1] * a
        one = np.stack([1 + sign * along[:, 0] ** 2 * a, sign * b, -sign * along[:, 0]], axis=1)
        two = np.stack([b, sign + along[:, 1] ** 2 * a, -along[:, 1]], axis=1)
        turned_ = (sine * np.cos(azimuth))[:, None] * one + (sine * np.sin(azimuth))[:, None] * two
        new = turned_ + cosine[:, None] * along
        return new / np.linalg.norm(new, axis=1, keepdims=True)

    def _at_upper_face(self, upper: np.ndarray) -> np.ndarray:
        """Whether paths stay in the ink; the others are back in the plate."""
        is_reflected = self._random.random(len(upper)) < fresnel(self.along[upper, 2], self._to_plate)
        self.along[upper[is_reflected], 2] *= -1
        leaves = upper[~is_reflected]
        self._leave(leaves, self.at[leaves], refracted(self.along[leaves], 2, self._to_plate))
        return is_reflected

    def at_rim(self, rim: np.ndarray) -> np.ndarray:
        """Whether paths stay in the ink; of the others, those that go up enter the plate from below.

        ``rim``: positions of the paths that meet it in ``paths``.
        """
        along = self.along[rim]
        normal = self.at[rim] * [1.0, 1.0, 0.0]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cosine = np.clip(np.sum(along * normal, axis=1), 0.0, 1.0)
        is_reflected = self._random.random(len(rim)) < fresnel(cosine, self._to_around)
        back = along - 2 * cosine[:, None] * normal
        self.along[rim[is_reflected]] = back[is_reflected]
        outside, n = rim[~is_reflected], self._to_around
        along, normal, cosine = along[~is_reflected], normal[~is_reflected], cosine[~is_reflected]
        beyond = np.sqrt(np.maximum(1 - n**2 * (1 - cosine**2), 0.0))
        along = n * along + (beyond - n * cosine)[:, None] * normal
        self.leaves_plate[self.paths[outside]] = True
        goes_up = along[:, 2] > 1e-9
        outside, along = outside[goes_up], along[goes_up]
        at = self.at[outside]
        at = at - (at[:, 2] / along[:, 2])[:, None] * along
        enters = self._random.random(len(outside)) >= fresnel(along[:, 2], self._around_to_plate)
        place = at + self._centre[outside]
        enters &= self._pattern.is_clear(place[:, 0], place[:, 1])
        self._leave(outside[enters], at[enters], refracted(along[enters], 2, self._around_to_plate))
        return is_reflected

    def _leave(self, which: np.ndarray, at: np.ndarray, along: np.ndarray) -> None:
        paths = self.paths[which]
        self.goes_on[paths], self.leaves_plate[paths] = True, False
        self.left_at[paths] = at + self._centre[which]
        self.left_along[paths] = along
