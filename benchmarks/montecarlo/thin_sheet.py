"""Monte Carlo of a plate with a table as the sheet on its far side; knows the table and Fresnel only.

Photons carry weights. At every diffuse reflection each detector gets its expected share (next event
estimation), so that any number of sharp directions is seen without bins.
"""

import dataclasses

import numpy as np

from benchmarks.montecarlo.facets import fresnel

_ROULETTE_BELOW = 0.02


@dataclasses.dataclass(frozen=True)
class Plate:
    """Clear plate in a surrounding medium, the sheet on its far side; side A extends to infinity.

    Parameters
    ----------
    optical_thickness
        Absorption coefficient times thickness.
    index_front
        Refractive index of the surroundings on the lit side.
    """

    optical_thickness: float = 0.0
    index_front: float = 1.0


class _Ways:
    """Regular ways of directions inside the plate, by their angle there."""

    def __init__(self, table, plate: Plate, theta_deg: np.ndarray):
        cosine = np.cos(np.deg2rad(theta_deg))
        index = table.index_inside[0]
        through = np.exp(-plate.optical_thickness / np.maximum(cosine, 1e-12))
        front, _ = fresnel(index, plate.index_front, cosine)
        self.back_to_sheet = through**2 * front
        self.out = through * (1 - front)
        self.reflected, self.transmitted = (
            np.interp(theta_deg, table.theta_deg, table.regular[component, 0]) for component in (0, 1)
        )


class _Detectors:
    """Directions to look from, and what each gets of light that the sheet sends on."""

    def __init__(self, table, plate: Plate, theta_o_deg, phi_deg, transmitted):
        self.table, self.theta_o, self.phi, self.transmitted = table, theta_o_deg, phi_deg, transmitted
        inside = table.index_inside[0]
        leaves_into = np.where(transmitted, table.index_outside[0], plate.index_front)
        self.within = np.rad2deg(np.arcsin(leaves_into * np.sin(np.deg2rad(theta_o_deg)) / inside))
        ways = _Ways(table, plate, self.within)
        repeated = 1 / (1 - ways.reflected * ways.back_to_sheet)
        exit_share = np.where(transmitted, ways.back_to_sheet * ways.transmitted, ways.out)
        self.upward = exit_share * repeated * (leaves_into / inside) ** 2

    def bsdf(self, theta, azimuth):
        """Of every detector per power that arrives at the sheet with these angles."""
        turn = self.phi + np.rad2deg(azimuth)[:, None]
        value = self.upward * self.table.interpolated("R_II", theta[:, None], self.within, turn)
        if self.transmitted.any():
            to = self.transmitted
            value[:, to] += self.table.interpolated("T_IA", theta[:, None], self.theta_o[to], turn[:, to])
        return value


def plate_bsdf(
    table,
    plate: Plate,
    theta_i_deg: float,
    detectors: tuple[np.ndarray, np.ndarray, np.ndarray],
    n_photons: int,
    seed: int,
) -> tuple[np.ndarray, np.ndarray]:
    """BSDF of the plate with its sheet, lit from the plate's side.

    Parameters
    ----------
    table
        The table, its first wavelength.
    plate
        The plate.
    theta_i_deg
        Incidence in the surroundings.
    detectors
        theta_o and phi in degrees, and whether in transmission.
    n_photons, seed
        Photons, and seed of the random numbers.

    Returns
    -------
    bsdf, standard_error
        1/sr, one for each detector.
    """
    random = np.random.default_rng(seed)
    seen = _Detectors(table, plate, *(np.asarray(column) for column in detectors))
    sine = plate.index_front * np.sin(np.deg2rad(theta_i_deg)) / table.index_inside[0]
    theta = np.full(n_photons, np.rad2deg(np.arcsin(sine)))
    entering = _Ways(table, plate, theta[:1])
    azimuth, weight = np.zeros(n_photons), np.full(n_photons, float(entering.out[0]))
    total = np.zeros((n_photons, len(seen.phi)))
    alive = np.arange(n_photons)
    while alive.size:
        # All photons arrive alike the first time.
        some = slice(1) if np.ptp(theta) == 0 else slice(None)
        total[alive] += weight[:, None] * seen.bsdf(theta[some], azimuth[some])
        regular = np.interp(theta, table.theta_deg, table.regular[0, 0])
        goes_straight = random.random(alive.size) < regular / (regular + 0.5)
        turn = 2 * np.pi * random.random(alive.size)
        onward = np.rad2deg(np.arcsin(np.sqrt(random.random(alive.size))))
        scattered = np.pi * table.interpolated("R_II", theta, onward, 180 - np.rad2deg(turn))
        weight = weight * np.where(goes_straight, 1.0, scattered / 0.5) * (regular + 0.5)
        theta = np.where(goes_straight, theta, onward)
        azimuth = np.where(goes_straight, azimuth, azimuth + turn)
        weight = weight * _Ways(table, plate, theta).back_to_sheet
        survives = np.minimum(weight / _ROULETTE_BELOW, 1.0)
        keep = random.random(alive.size) < survives
        weight = (weight / np.maximum(survives, 1e-300))[keep]
        alive, theta, azimuth = alive[keep], theta[keep], azimuth[keep]
    return total.mean(axis=0), total.std(axis=0, ddof=1) / np.sqrt(n_photons)
