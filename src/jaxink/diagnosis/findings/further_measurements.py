"""Which further measurement would tell effects apart that the data at hand do not."""

import dataclasses

import numpy as np

from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.setup import Setup
from jaxink.diagnosis.search.workbench import Workbench
from jaxink.effects import Effect, Scene
from jaxink.measurement import FitNoise, GonioData

_INCIDENCES_DEG, _APART_DEG = (75.0, 45.0, 20.0, 5.0), 7.5
_VIEW_DEG = np.arange(-85.0, 86.0, 5.0)
# Views nearer than this to a regular peak or to the source are not asked for.
_NEAR_DEG = 4.0


@dataclasses.dataclass(frozen=True)
class Further:
    """A measurement, and how well it would tell two effects apart.

    Parameters
    ----------
    effects
        The two.
    measurement
        What to measure, as often and as well as what was measured.
    chi_square
        By which the second effect would miss data that follow the first, all parameters fitted anew.
    """

    effects: tuple[str, str]
    measurement: str
    chi_square: float


def further_measurements(
    setup: Setup, accepted: tuple[Effect, ...], first: Refit, second: Refit
) -> tuple[Further, ...]:
    """Measurements from a menu that would tell two effects apart, the most telling first.

    The first effect, as fitted, predicts old and new points without noise; the second is fitted to them.

    Parameters
    ----------
    setup, accepted
        Of the stage at which both were fitted.
    first, second
        Their refits.

    References
    ----------
    Atkinson, Fedorov 1975 Biometrika 62, 57 (T-optimal designs).
    """
    data = setup.data
    used = data.used
    old = np.column_stack([column[used] for column in data.directions])
    menu = menu_of(old)
    if not menu:
        return ()
    parts = [old, *menu.values()]
    item = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    columns = np.concatenate(parts).T
    scene = Scene.of(*columns, np.append(data.row[used], data.row.max() + 1 + np.arange(sum(item > 0))))

    def bench(refit, bsdf, sigma):
        values = (*columns[:4], columns[4] > 0.5, bsdf)
        arguments = GonioData(*values), FitNoise(sigma, setup.noise.scan_relative, "")
        effects = (*accepted, refit.effect)
        return Workbench(setup.sample, effects, *arguments, setup.config, scene, len(refit.solution.free))

    ones = np.ones(columns.shape[1])
    expected = bench(first, ones, ones).predict(first.solution.values)
    sigma_old = np.asarray(setup.noise.sigma_per_sr, float)
    relative = float(np.median(sigma_old / np.abs(data.bsdf_per_sr[used])))
    sigma = np.concatenate([sigma_old, relative * expected[item > 0]])
    rival = bench(second, expected, sigma)
    found = []
    for number, name in enumerate(menu, start=1):
        left_out = (item > 0) & (item != number)
        solution = rival.fit(second.solution.values, second.solution.free, left_out=left_out)
        found.append(Further((first.effect.name, second.effect.name), name, solution.chi_square))
    return tuple(sorted(found, key=lambda f: -f.chi_square))


def menu_of(old: np.ndarray) -> dict[str, np.ndarray]:
    """Further points, by what they are called.

    Parameters
    ----------
    old
        Incidence, view, azimuth, wavelength and side of the points at hand, shape ``(points, 5)``.

    Returns
    -------
    dict[str, np.ndarray]
        The same columns of the points that each item adds.
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
        menu[f"the plane across that of incidence, at {angle:g} degrees"] = _plane(angle, 90.0, settings)
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
