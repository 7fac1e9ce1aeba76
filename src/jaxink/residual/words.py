"""The shape of a residual in words."""

from collections.abc import Iterator, Sequence

import numpy as np

from jaxink.residual.points import ResidualPoints
from jaxink.residual.shares import CarriedShare, ModeShare
from jaxink.residual.symmetry import Asymmetry

_SIDES = {"R": "reflection", "T": "transmission"}
_AZIMUTH = {
    0: "the same at all azimuths",
    1: "opposite towards and away from the source (cos phi)",
    2: "opposite in and across the plane of incidence (cos 2 phi)",
}
# An extreme is named if it is at least this share of the larger one.
_SECOND = 0.4
# Levels of incidence or wavelength are compared if their rms differ by this factor.
_DIFFERS = 1.5
# Below this share the modes are not what the residual mainly consists of.
_HALF = 0.5


def shape_sentence(
    points: ResidualPoints,
    shares: Sequence[ModeShare],
    carried: CarriedShare,
    part: np.ndarray,
    found: Sequence[Asymmetry],
) -> str:
    """One or more sentences; `part` is the relative residual that the modes carry."""
    sentences = [*_mode_sentences(points, shares, carried, part), *map(_broken, found)]
    return " ".join(filter(None, sentences))


def _mode_sentences(points, shares, carried: CarriedShare, part) -> Iterator[str]:
    if not shares or carried.excess <= 0:
        yield "No smooth mode stands out of the noise."
        return
    low = next((o for o in carried.orders if carried.of_order(o) >= _HALF * carried.share), None)
    most = ""
    if low is not None and low.amplitudes < len(shares):
        most = f", the {low.amplitudes} up to order {low.order} alone {100 * carried.of_order(low):.0f} %"
    yield _size(len(shares), carried, most)
    for side, word in _SIDES.items():
        own = [found for found in shares if found.mode.side == side]
        if own:
            yield f"In {word}, {_leading(own[0])}: {_extremes(points, part, points.of_side(side))}."
    yield from _trends(points, part)
    if carried.smooth is None and carried.share < _HALF:
        yield "Most of it varies on a finer scale than these modes, or is confined to few directions."


def _size(n_modes: int, carried: CarriedShare, most: str) -> str:
    """How large the smooth part is, and how much of it the modes carry: all shares are of one whole."""
    several = n_modes > 1
    if carried.smooth is None:
        count = f"{n_modes} of {carried.n_considered} smooth modes carry"
        count = count if several else "One smooth mode carries"
        return f"{count} {100 * carried.share:.0f} % of the chi-square above the noise{most}."
    modes = f"{n_modes} of {carried.n_considered} broad modes" if several else "one broad mode"
    whole, part = round(100 * carried.smooth), round(100 * carried.share)
    finer = f"; the other {whole - part} % on a finer scale, or in few directions" if whole > part else ""
    return (
        f"{whole} % of the chi-square above the noise varies smoothly with direction: {part} % in "
        f"{modes}{most}{finer}."
    )


def _leading(found: ModeShare) -> str:
    """The character of the leading mode."""
    mode = found.mode
    grows = "level" if mode.order == 0 else "growing towards grazing angles"
    if mode.order > 2:
        grows = "changing sign with the polar angle"
    if mode.azimuthal_order is None:
        azimuth = "opposite in the two half-planes" if mode.n % 2 else "alike in both half-planes"
    else:
        azimuth = _AZIMUTH.get(mode.azimuthal_order, f"as cos {mode.azimuthal_order} phi")
    return f"the leading one is {azimuth}, {grows}"


def _extremes(points: ResidualPoints, part: np.ndarray, here: np.ndarray) -> str:
    at = np.flatnonzero(here)
    top, bottom = int(at[np.argmax(part[at])]), int(at[np.argmin(part[at])])
    order = sorted((top, bottom), key=lambda i: -abs(part[i]))
    largest = abs(part[order[0]])
    words = [
        f"measured {'above' if part[i] > 0 else 'below'} the model by up to {_percent(part[i])} at "
        f"{_direction(points, i)}"
        for i in order
        if abs(part[i]) >= _SECOND * largest and (i == top) == (part[i] > 0)
    ]
    return ", ".join(words)


def _percent(value: float) -> str:
    return f"{100 * abs(value):.2g} %"


def _direction(points: ResidualPoints, i: int) -> str:
    return (
        f"incidence {points.theta_i_deg[i]:.3g}°, view {points.theta_o_deg[i]:.3g}°, "
        f"phi {points.phi_deg[i]:.3g}°"
    )


def _trends(points: ResidualPoints, part: np.ndarray) -> Iterator[str]:
    """How the rms changes with incidence and wavelength."""
    for name, values, unit in (
        ("incidence", points.theta_i_deg, "°"),
        ("wavelength", points.wavelength_nm, " nm"),
    ):
        levels = np.unique(values)
        rms = np.array([np.sqrt(np.mean(part[values == level] ** 2)) for level in levels])
        if levels.size < 2 or rms.max() < _DIFFERS * rms.min():
            continue
        most, least = int(np.argmax(rms)), int(np.argmin(rms))
        yield (
            f"Its rms changes with {name}: {_percent(rms[most])} at {levels[most]:g}{unit}, "
            f"{_percent(rms[least])} at {levels[least]:g}{unit}."
        )


_CAUSES = {
    "mirror": (
        "+phi and -phi",
        "no isotropic sample does this, so a tilted plate, a misaligned azimuth, or grooves are behind it",
    ),
    "reciprocal": (
        "source and detector exchanged",
        "no reciprocal sample does this, so the instrument (illuminated area, field of view) or light that "
        "leaves sideways is behind it",
    ),
}


def _broken(found: Asymmetry) -> str:
    if not found.is_significant:
        return ""
    what, cause = _CAUSES[found.kind]
    at = f"incidence {found.theta_i_deg:.3g}°, view {found.theta_o_deg:.3g}°, phi {found.phi_deg:.3g}°"
    size = _percent(found.relative_rms)
    return f"Part of it differs between {what} (rms {size} of the mean, most at {at}): {cause}."
