"""Random directions of light that meets an ink, drawn from its table."""

import dataclasses
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from jaxink.ink import COMPONENTS, InkTable

INSIDE, OUTSIDE = 0, 1
# Components of light that arrives on side I and on side A: reflected, transmitted.
_OF_SIDE = (("R_II", "T_IA"), ("R_AA", "T_AI"))


class Scattered(NamedTuple):
    """What becomes of light that meets the sheet; all arrays have the shape ``(n,)`` if not stated.

    Parameters
    ----------
    goes_on
        Whether the path goes on; otherwise the light is absorbed.
    is_transmitted
        Whether it leaves on the other side.
    theta_o, phi
        Direction in the medium of its side, radians; azimuth 0 is the side that the light came from.
    weight
        Factor of the power at each wavelength, shape ``(n, wavelengths)``; its mean is close to 1.
    """

    goes_on: Bool[np.ndarray, " n"]
    is_transmitted: Bool[np.ndarray, " n"]
    theta_o: Float[np.ndarray, " n"]
    phi: Float[np.ndarray, " n"]
    weight: Float[np.ndarray, "n wavelengths"]


@dataclasses.dataclass(frozen=True, eq=False)
class SheetSampler:
    """Draws what becomes of light at a table, interpolated linearly between its entries.

    A path goes on with the probability that light is not absorbed, in a direction that is drawn in proportion
    to the power, all in the mean over the wavelengths; weights make each wavelength right. Weights are those
    of power; for paths that run from the eye to the lamp they are those of radiance over the squared index.

    Parameters
    ----------
    table
        The table.
    """

    table: InkTable

    @property
    def index_ratio(self) -> float:
        """Refractive index of side I over that of side A, mean over the wavelengths."""
        return float(np.mean(self.table.index_inside / self.table.index_outside))

    @cached_property
    def _theta(self) -> np.ndarray:
        return np.deg2rad(self.table.theta_deg)

    @cached_property
    def _phi(self) -> np.ndarray:
        return np.deg2rad(self.table.phi_deg)

    @cached_property
    def _cell_area(self) -> np.ndarray:
        """Projected solid angle of a cell between entries, of one half of the azimuths."""
        return np.outer(np.diff(np.sin(self._theta) ** 2) / 2, np.diff(self._phi))

    @cached_property
    def _cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By component and incidence: diffuse power; ascending cumulated shares of cells; their densities.

        The shares of a row lie between its number and the next, so that all rows are searched at once.
        """
        mean = self.table.bsdf_per_sr.mean(axis=1)
        middle = (mean[..., :-1, :] + mean[..., 1:, :]) / 2
        middle = (middle[..., :-1] + middle[..., 1:]) / 2
        power = np.maximum(middle * self._cell_area, 0.0).reshape(*mean.shape[:2], -1)
        total = power.sum(axis=-1)
        share = power / np.where(total > 0, total, 1.0)[..., None]
        cumulated = np.cumsum(share, axis=-1)
        rows = np.arange(total.size).reshape(total.shape)
        ascending = np.minimum(cumulated, 1.0) + rows[..., None]
        # A cell and its mirror image.
        return 2 * total, ascending.ravel(), (share / self._cell_area.ravel()).ravel()

    def scatter(self, side: int, theta_i: Float[np.ndarray, " n"], random: np.random.Generator) -> Scattered:
        """Draw what becomes of light.

        Parameters
        ----------
        side
            `INSIDE` or `OUTSIDE`: where it arrives.
        theta_i
            Angles of incidence in the medium of that side, radians.
        random
            Source of random numbers.
        """
        n, table = len(theta_i), self.table
        diffuse, ascending, density = self._cells
        n_theta, n_cells = len(self._theta), self._cell_area.size
        i, u = _cell(self._theta, theta_i)
        numbers = [COMPONENTS.index(name) for name in _OF_SIDE[side]]
        regular = table.regular.mean(axis=1)
        shares = np.stack(
            [of[c, i] * (1 - u) + of[c, i + 1] * u for of in (diffuse, regular) for c in numbers]
        )
        edges = np.cumsum(shares, axis=0)
        draw = random.random(n)
        lobe = (draw >= edges).sum(axis=0)
        goes_on = lobe < len(shares)
        lobe = np.minimum(lobe, len(shares) - 1)
        is_regular, is_transmitted = lobe >= 2, lobe % 2 == 1
        component = np.take(numbers, lobe % 2)
        weight = np.zeros((n, len(table.wavelength_nm)))

        # Regular light.
        sine = np.sin(theta_i)
        ratio = self.index_ratio if side == INSIDE else 1 / self.index_ratio
        refracted = np.arcsin(np.clip(ratio * sine, 0.0, 1.0))
        theta_o, phi = np.where(is_transmitted, refracted, theta_i), np.full(n, np.pi)
        at = np.flatnonzero(goes_on & is_regular)
        rows = table.regular[component[at], :, i[at]], table.regular[component[at], :, i[at] + 1]
        value = rows[0] * (1 - u[at, None]) + rows[1] * u[at, None]
        weight[at] = value / np.maximum(shares[lobe[at], at], 1e-300)[:, None]

        # Diffuse light: one of the two tabulated incidences, a cell, and a point in it.
        at = np.flatnonzero(goes_on & ~is_regular)
        c, low, fraction = component[at], i[at], u[at]
        parts = diffuse[c, low] * (1 - fraction), diffuse[c, low + 1] * fraction
        takes_upper = random.random(len(at)) * (parts[0] + parts[1]) >= parts[0]
        row = c * n_theta + low + takes_upper
        found = np.searchsorted(ascending, row + random.random(len(at)), side="right") - row * n_cells
        found = np.clip(found, 0, n_cells - 1)
        o, p = np.divmod(found, len(self._phi) - 1)
        between = np.sin(self._theta) ** 2
        theta_o[at] = np.arcsin(np.sqrt(_lerp(between[o], between[o + 1], random.random(len(at)))))
        phi[at] = _lerp(self._phi[p], self._phi[p + 1], random.random(len(at)))
        value = self._bsdf(c, low, fraction, theta_o[at], phi[at])
        drawn = sum(
            part * density[(c * n_theta + low + upper) * n_cells + found] for upper, part in enumerate(parts)
        ) / (2 * np.maximum(parts[0] + parts[1], 1e-300))
        weight[at] = value / np.maximum(drawn * shares[lobe[at], at], 1e-300)[:, None]
        # The other half of the azimuths is the mirror image.
        phi[at] *= np.where(random.random(len(at)) < 0.5, 1.0, -1.0)
        return Scattered(goes_on, is_transmitted, theta_o, phi, weight)

    def _bsdf(self, component, i, u, theta_o, phi) -> Float[np.ndarray, "n wavelengths"]:
        (o, v), (p, w) = _cell(self._theta, theta_o), _cell(self._phi, phi)
        value = np.zeros((len(component), len(self.table.wavelength_nm)))
        for a, along in ((0, 1 - u), (1, u)):
            for b, polar in ((0, 1 - v), (1, v)):
                for c, azimuth in ((0, 1 - w), (1, w)):
                    entry = self.table.bsdf_per_sr[component, :, i + a, o + b, p + c]
                    value += entry * (along * polar * azimuth)[:, None]
        return value


def turned(
    direction: Float[np.ndarray, "n 3"], scattered: Scattered, side: Float[np.ndarray, " n"] | float
) -> Float[np.ndarray, "n 3"]:
    """Directions of travel after a sheet whose normal is z.

    Parameters
    ----------
    direction
        Directions of travel before.
    scattered
        From `SheetSampler.scatter`.
    side
        1 if light arrives from above (travels downwards), -1 from below.
    """
    back = -direction[:, :2]
    length = np.hypot(back[:, 0], back[:, 1])
    unit = np.where(length[:, None] > 1e-12, back / np.maximum(length, 1e-12)[:, None], [1.0, 0.0])
    cosine, sine = np.cos(scattered.phi), np.sin(scattered.phi)
    radial = np.sin(scattered.theta_o)
    x = radial * (cosine * unit[:, 0] - sine * unit[:, 1])
    y = radial * (sine * unit[:, 0] + cosine * unit[:, 1])
    z = np.cos(scattered.theta_o) * np.where(scattered.is_transmitted, -1.0, 1.0) * side
    return np.stack([x, y, z], axis=1)


def _cell(axis: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell of an ascending axis and fraction within it."""
    cell = np.clip(np.searchsorted(axis, value, side="right") - 1, 0, len(axis) - 2)
    return cell, np.clip((value - axis[cell]) / (axis[cell + 1] - axis[cell]), 0.0, 1.0)


def _lerp(low, high, fraction):
    return low + (high - low) * fraction
