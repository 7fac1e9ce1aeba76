"""Masks: points that are excluded from fits, and why.

Values of exactly 0 where nothing was measured: the detector's shadow, gaps, NaN that became 0.

A 0 is a reading where the values around it go to 0 continuously, scatter as far as 0, or are rounded so
coarsely that they reach it. It is none where they agree on a value that is clearly not 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt32

from jaxink.errors import InputRefusedError

# A point exactly at the limit is kept despite rounding.
_ROUNDING_DEG = 1e-9
# Farther from a direction, zeros are described by their row.
_NEAR_DEG = 25.0
# Number of readings around a zero that judge it, and the fewest that can.
_NEIGHBOURS, _FEWEST = 8, 5
# They agree if their median exceeds so many times their scatter (1.4826 times the median deviation), and do
# not go to 0 if no more than two, as of a half-shaded beam, are below this share of the median.
_AGREEING, _SMALL, _FEW = 3.0, 0.1, 2
# Distance of one radian of incidence among directions of view: neighbours are of the same scan if it has any.
_BETWEEN_SCANS = 10.0
# Towards the horizon every BSDF through a smooth face goes to 0.
_HORIZON_DEG = 90 - 1e-6
# Of all values of a side and wavelength; if most are 0, they are the dark surroundings of a lobe.
_MOST_ZEROS = 0.5
_WHOLE = 1e-6


@dataclass(frozen=True)
class MaskFlag:
    """One reason to mask a point.

    Parameters
    ----------
    bit
        Its bit in ``GonioData.mask``.
    name
        Its name in counts and files.
    sentence
        The reason in words.
    """

    bit: int
    name: str
    sentence: str


NEGATIVE = MaskFlag(1, "negative", "the BSDF is negative, below what the detector can resolve")
SPECULAR = MaskFlag(2, "specular", "the view is near the specular direction, where a peak may enter")
UNDEVIATED = MaskFlag(4, "undeviated", "the view is near the undeviated beam, which may enter")
RETRO = MaskFlag(8, "retro", "the view is near the source, where the detector may shade the beam")
GRAZING = MaskFlag(16, "grazing", "the view is close to grazing, where the footprint may overfill")
USER = MaskFlag(32, "user", "the user excluded the point")
ZERO = MaskFlag(64, "zero", "the BSDF is exactly 0 among values that are not, so nothing was measured")
MASK_FLAGS = (NEGATIVE, SPECULAR, UNDEVIATED, RETRO, GRAZING, USER, ZERO)


@dataclass(frozen=True)
class MaskLimits:
    """Limits of the geometric masks; None switches a mask off.

    The defaults suit smooth faces, whose regular (specular or directly transmitted) peaks are not part of a
    BSDF. To fit the lobe of a rough face, switch both peak masks off.

    Parameters
    ----------
    specular_half_angle_deg, undeviated_half_angle_deg, retro_half_angle_deg
        Points at a smaller angle to the direction are masked.
    grazing_theta_o_deg
        Points with a larger polar angle of view are masked.

    Raises
    ------
    InputRefusedError
        If a limit is not between 0 and 90 degrees.
    """

    specular_half_angle_deg: float | None = 2.5
    undeviated_half_angle_deg: float | None = 2.5
    retro_half_angle_deg: float | None = 2.5
    grazing_theta_o_deg: float | None = None

    def __post_init__(self):
        for name, value in vars(self).items():
            if value is not None and not 0 <= value <= 90:
                raise InputRefusedError(f"{name} is {value}; it must be between 0 and 90, or None.")


def angular_distance_deg(
    theta_a_deg: Float[np.ndarray, " points"],
    phi_a_deg: Float[np.ndarray, " points"],
    theta_b_deg: Float[np.ndarray, " points"],
    phi_b_deg: Float[np.ndarray, " points"] | float,
) -> Float[np.ndarray, " points"]:
    """Angle between two directions a and b, 0 to 180 degrees, by the haversine formula, accurate near 0."""
    half_polar = np.sin(np.deg2rad(theta_a_deg - theta_b_deg) / 2) ** 2
    half_azimuth = np.sin(np.deg2rad(phi_a_deg - phi_b_deg) / 2) ** 2
    sines = np.sin(np.deg2rad(theta_a_deg)) * np.sin(np.deg2rad(theta_b_deg))
    return np.rad2deg(2 * np.arcsin(np.sqrt(np.minimum(half_polar + sines * half_azimuth, 1))))


def mask_bits(
    directions: tuple[np.ndarray, ...], bsdf_per_sr: Float[np.ndarray, " points"], limits: MaskLimits
) -> UInt32[np.ndarray, " points"]:
    """Bits of `MASK_FLAGS` by geometry and sign; ``directions`` as in `GonioData.directions`."""
    theta_i_deg, theta_o_deg, phi_deg, _, is_transmission = directions
    forward = angular_distance_deg(theta_o_deg, phi_deg, theta_i_deg, 180.0)
    backward = angular_distance_deg(theta_o_deg, phi_deg, theta_i_deg, 0.0)

    def nearer(angle, limit):
        return angle < (limit or 0.0) - _ROUNDING_DEG

    grazing = 90.0 if limits.grazing_theta_o_deg is None else limits.grazing_theta_o_deg
    hits = {
        NEGATIVE: bsdf_per_sr < 0,
        SPECULAR: ~is_transmission & nearer(forward, limits.specular_half_angle_deg),
        UNDEVIATED: is_transmission & nearer(forward, limits.undeviated_half_angle_deg),
        RETRO: ~is_transmission & nearer(backward, limits.retro_half_angle_deg),
        GRAZING: theta_o_deg > grazing + _ROUNDING_DEG,
        ZERO: without_reading(directions, bsdf_per_sr),
    }
    return _bits(hits)


def value_bits(
    directions: tuple[np.ndarray, ...], bsdf_per_sr: Float[np.ndarray, " points"]
) -> UInt32[np.ndarray, " points"]:
    """Bits of `MASK_FLAGS` that a measurement has from the start: values that are no readings."""
    return _bits({NEGATIVE: bsdf_per_sr < 0, ZERO: without_reading(directions, bsdf_per_sr)})


def _bits(hits: dict[MaskFlag, np.ndarray]) -> UInt32[np.ndarray, " points"]:
    return np.bitwise_or.reduce([flag.bit * hit.astype(np.uint32) for flag, hit in hits.items()])


def value_notes(
    mask: UInt32[np.ndarray, " points"], directions: tuple[np.ndarray, ...], row: Int[np.ndarray, " points"]
) -> list[str]:
    """What a reader says of the values that it masked: how many, and where."""
    notes = []
    negative = mask & NEGATIVE.bit > 0
    if negative.any():
        verb = "is" if negative.sum() == 1 else "are"
        first = row[np.argmax(negative)]
        notes.append(
            f"{negative.sum()} of {mask.size} values {verb} negative (first in row {first}) and masked."
        )
    is_transmission = directions[-1]
    for side, name in ((False, "R"), (True, "T")):
        zero = (mask & ZERO.bit > 0) & (is_transmission == side)
        if zero.any():
            verb = "is" if zero.sum() == 1 else "are"
            where = _where(tuple(column[zero] for column in directions[:3]), side)
            notes.append(
                f"{zero.sum()} of {mask.size} values {verb} exactly 0 among values that are clearly not "
                f"({name}, {where}first in row {row[np.argmax(zero)]}) and masked: nothing was measured."
            )
    return notes


def _where(angles: tuple[np.ndarray, ...], side: bool) -> str:
    """Where all of some directions are, if near the source or the specular or undeviated direction."""
    theta_i_deg, theta_o_deg, phi_deg = angles
    near = {} if side else {"the source": 0.0}
    near |= {"the undeviated beam" if side else "the specular direction": 180.0}
    for what, azimuth in near.items():
        farthest = angular_distance_deg(theta_o_deg, phi_deg, theta_i_deg, azimuth).max()
        if farthest <= _NEAR_DEG:
            return f"within {np.ceil(farthest - 1e-6) + 0.0:g} degrees of {what}, "
    return f"at theta_o_deg from {theta_o_deg.min():g} to {theta_o_deg.max():g}, "


def mask_counts(mask: UInt32[np.ndarray, " points"]) -> dict[str, int]:
    """Number of points with each flag; a point may have several."""
    return {flag.name: int((mask & flag.bit > 0).sum()) for flag in MASK_FLAGS}


def mask_names(mask: UInt32[np.ndarray, " points"]) -> list[str]:
    """Names of the flags of each point, separated by spaces; empty if it is used."""
    return [" ".join(flag.name for flag in MASK_FLAGS if bits & flag.bit) for bits in mask.tolist()]


def mask_sentences(mask: UInt32[np.ndarray, " points"]) -> tuple[str, ...]:
    """One sentence for each reason that occurs, then how many points are used.

    If some points are masked for several reasons, a sentence before them says how many are masked in all.
    """
    counts, n_masked = mask_counts(mask), int((mask != 0).sum())
    sentences = []
    if sum(counts.values()) > n_masked:
        sentences.append(f"{n_masked} of {len(mask)} points are masked, some of them for several reasons.")
    sentences += [
        f"{counts[flag.name]} of {len(mask)} points are masked as {flag.name}: {flag.sentence}."
        for flag in MASK_FLAGS
        if counts[flag.name]
    ]
    return (*sentences, f"{int((mask == 0).sum())} of {len(mask)} points are used.")


def without_reading(
    directions: tuple[np.ndarray, ...], bsdf_per_sr: Float[np.ndarray, " points"]
) -> Bool[np.ndarray, " points"]:
    """True for values of exactly 0 that are no readings; ``directions`` as in `GonioData.directions`."""
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission = directions
    found = np.zeros(bsdf_per_sr.shape, bool)
    zero = (bsdf_per_sr == 0) & (theta_o_deg < _HORIZON_DEG) & (theta_i_deg < _HORIZON_DEG)
    if not zero.any():
        return found
    theta, phi = np.deg2rad(theta_o_deg), np.deg2rad(phi_deg)
    across = np.sin(theta)
    places = np.stack(
        [
            _BETWEEN_SCANS * np.deg2rad(theta_i_deg),
            across * np.cos(phi),
            across * np.sin(phi),
            np.cos(theta),
        ],
        axis=1,
    )
    for side in (False, True):
        for wavelength in np.unique(wavelength_nm[zero & (is_transmission == side)]):
            here = np.flatnonzero((is_transmission == side) & (wavelength_nm == wavelength))
            at, value = places[here], bsdf_per_sr[here]
            found[here[zero[here]]] = _are_no_readings(at[zero[here]], at[value != 0], value[value != 0])
    return found


def _are_no_readings(at: np.ndarray, others_at: np.ndarray, others: np.ndarray) -> np.ndarray:
    """For zeros at these places, among the other values of their side and wavelength."""
    # Imported late because most files have no zeros, and reading them needs no scipy.
    from scipy.spatial import cKDTree

    if others.size < _FEWEST or len(at) > _MOST_ZEROS * (len(at) + others.size):
        return np.zeros(len(at), bool)
    _, nearest = cKDTree(others_at).query(at, min(_NEIGHBOURS, others.size))
    around = others[nearest]
    middle = np.median(around, axis=1)
    small = np.sort(around, axis=1)[:, min(_FEW, around.shape[1] - 1)]
    scatter = 1.4826 * np.median(np.abs(around - middle[:, None]), axis=1)
    agree = (middle > _AGREEING * scatter) & (small > _SMALL * middle)
    return agree & (middle > 2 * _rounding_step(others))


def _rounding_step(values: np.ndarray) -> float:
    """The step of values that are rounded, or counted, to whole multiples of it; 0 if they are not."""
    step = np.abs(values).min()
    multiples = np.abs(values) / step
    is_whole = np.abs(multiples - np.round(multiples)) < _WHOLE * multiples
    return float(step) if is_whole.all() and (np.round(multiples) == 2).any() else 0.0
