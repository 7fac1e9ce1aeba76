"""Whether readings that must be equal agree; if not, no model of an isotropic sample can explain them."""

import dataclasses

import numpy as np

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.measurement import (
    FitNoise,
    GonioData,
    estimate_noise,
    reciprocal_differences,
    repeat_differences,
    without_copies,
)
from jaxink.numerics.chi_square import probability_above

_WORDS = {
    "repeats": "repeated readings",
    "mirror": "readings at +phi and -phi",
    "reciprocal": "readings with source and detector exchanged",
}


@dataclasses.dataclass(frozen=True)
class Consistency:
    """Agreement between pairs of readings that must be equal.

    Parameters
    ----------
    kind
        ``repeats``, ``mirror`` or ``reciprocal``.
    pairs
        Number of pairs, without outliers.
    relative
        Relative standard deviation of one reading, estimated from the pairs.
    expected
        The same from the noise in use (root mean square), including the scan factor if pairs span two scans.
    p_value
        Probability of at least this much scatter under that noise.
    exceeds_noise
        Whether the pairs differ significantly more than the noise.
    """

    kind: str
    pairs: int
    relative: float
    expected: float
    p_value: float
    exceeds_noise: bool

    @property
    def sentence(self) -> str:
        """Description for a verdict."""
        return (
            f"{_WORDS[self.kind]} differ by {self.relative:.2%}, but the noise is {self.expected:.2%}, which "
            "no isotropic sample explains"
        )


def consistency_of(
    data: GonioData, noise: FitNoise, policy: SearchPolicy = DEFAULT_POLICY
) -> tuple[Consistency, ...]:
    """Compare repeats, mirror images and reciprocal pairs, if there are enough of them, with the noise."""
    relative = noise.sigma_per_sr / np.abs(data.bsdf_per_sr[data.used])
    within = float(np.sqrt(np.mean(relative**2)))
    found = []
    for source in estimate_noise(data).sources:
        if source.name not in _WORDS or source.pairs < policy.fewest_pairs or not source.relative > 0:
            continue
        between = _between(data, noise.scan_relative) if source.name == "reciprocal" else 0.0
        expected = float(np.hypot(within, between))
        # Pairs of two scans share their factors: at most one pair per scan, except the first, is independent.
        shared = (between / expected) ** 2 * max(source.pairs / max(len(source.scans) - 1, 1) - 1, 0.0)
        independent = source.pairs / (1 + shared)
        square = independent * (source.relative / expected) ** 2
        p_value = float(probability_above(square, independent, noise.degrees_of_freedom))
        exceeds_noise = bool(p_value < policy.noise_p and source.relative > policy.sigma_tolerance * expected)
        found.append(
            Consistency(source.name, source.pairs, source.relative, expected, p_value, exceeds_noise)
        )
    return tuple(found)


def _between(data: GonioData, scan_relative: float) -> float:
    """Contribution of the factors of two scans to a reciprocal difference, in units of one reading.

    Averaging mirror images first reduces the noise of a reading, but not the factor of its scan.
    """
    _, means = repeat_differences(without_copies(data))
    return scan_relative * float(np.sqrt(np.mean(2 / reciprocal_differences(means).spread)))
