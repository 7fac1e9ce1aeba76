"""Further measurements that would distinguish effects that the present data cannot."""

import dataclasses

import numpy as np

from jaxink.diagnosis.search.candidate_objective import CandidateObjective
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.refit import Refit
from jaxink.effects import Effect, Scene
from jaxink.measurement import FitNoise, GonioData

_INCIDENCES_DEG, _APART_DEG = (75.0, 45.0, 20.0, 5.0), 7.5
_VIEW_DEG = np.arange(-85.0, 86.0, 5.0)
# Directions this close to a regular (specular or directly transmitted) peak or to the source are skipped.
_NEAR_DEG = 4.0


@dataclasses.dataclass(frozen=True)
class FurtherMeasurement:
    """A measurement, and how well it would distinguish two effects.

    Parameters
    ----------
    effects
        The two effects.
    measurement
        What to measure, with the sampling and the noise of the present data.
    chi_square
        Chi-square of the second effect, all parameters refitted, on noise-free data that follow the first.
    """

    effects: tuple[str, str]
    measurement: str
    chi_square: float


def further_measurements(
    problem: SearchProblem, accepted: tuple[Effect, ...], first: Refit, second: Refit
) -> tuple[FurtherMeasurement, ...]:
    """Candidate measurements that would distinguish two effects, the most decisive first.

    The first effect, as fitted, predicts the present and the new points; the second is fitted to them.

    Parameters
    ----------
    problem, accepted
        Of the model to which both effects were added.
    first, second
        Their refits.

    References
    ----------
    Atkinson, Fedorov 1975 Biometrika 62, 57 (T-optimal designs).
    """
    data = problem.data
    used = data.used
    old = np.column_stack([column[used] for column in data.directions])
    menu = menu_of(old)
    if not menu:
        return ()
    parts = [old, *menu.values()]
    item = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    columns = np.concatenate(parts).T
    time = data.reading_order
    row = np.append(time[used], time.max() + 1 + np.arange(sum(item > 0)))
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, side = columns
    scene = Scene.of(theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, side, row)

    def objective_of(refit, bsdf, sigma):
        values = (*columns[:4], columns[4] > 0.5, bsdf)
        rows = np.arange(len(bsdf))
        arguments = GonioData(*values, row=rows), FitNoise(sigma, problem.noise.scan_relative, "")
        effects = (*accepted, refit.effect)
        n_slots = len(refit.solution.free)
        return CandidateObjective(
            problem.sample, effects, *arguments, problem.config, scene, n_slots, problem.checkpoint
        )

    ones = np.ones(columns.shape[1])
    expected = objective_of(first, ones, ones).predict(first.solution.values)
    sigma_old = np.asarray(problem.noise.sigma_per_sr, float)
    relative = float(np.median(sigma_old / np.abs(data.bsdf_per_sr[used])))
    sigma = np.concatenate([sigma_old, relative * expected[item > 0]])
    rival, found = objective_of(second, expected, sigma), []
    start = rival.linearised(second.solution.values, second.solution.free)
    for number, name in enumerate(menu, start=1):
        left_out = (item > 0) & (item != number)
        solution = rival.fit_near(start, left_out)
        found.append(FurtherMeasurement((first.effect.name, second.effect.name), name, solution.chi_square))
    return tuple(sorted(found, key=lambda f: -f.chi_square))


def menu_of(old: np.ndarray) -> dict[str, np.ndarray]:
    """Additional points by name, with columns as in `old`.

    Parameters
    ----------
    old
        Incidence, view, azimuth (degrees), wavelength (nm) and side of the present points, shape ``(points,
        5)``.
    """
    incidences = np.unique(old[:, 0])
    settings = np.unique(old[:, 3:5], axis=0)
    menu = {}
    new = [a for a in _INCIDENCES_DEG if np.min(np.abs(incidences - a)) > _APART_DEG]
    for angle in new[:2]:
        menu[f"the plane of incidence at {angle:g} degrees"] = _plane(angle, 180.0, settings)
    phi = np.mod(old[:, 2], 180.0)
    if np.all((phi < 1) | (phi > 179)):
        angle = float(incidences[-1])
        menu[f"the plane normal to that of incidence, at {angle:g} degrees"] = _plane(angle, 90.0, settings)
    return menu


def _plane(theta_i: float, phi: float, settings: np.ndarray) -> np.ndarray:
    rows = []
    for wavelength, side in settings:
        for view in _VIEW_DEG:
            if phi == 180.0 and abs(abs(view) - theta_i) < _NEAR_DEG:
                continue
            azimuth = phi if view >= 0 else phi - 180.0
            rows.append((theta_i, abs(view), azimuth, wavelength, side))
    return np.array(rows)
