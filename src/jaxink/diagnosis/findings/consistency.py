"""Whether a measurement agrees with itself: what no model of an isotropic sample could mend."""

import dataclasses

import numpy as np
from scipy.stats import chi2

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.measurement import FitNoise, GonioData, estimate_noise
from jaxink.measurement.pairs import reciprocal_differences, repeat_differences, without_copies

_WORDS = {
    "repeats": "repeated readings",
    "mirror": "readings at +phi and -phi",
    "reciprocal": "readings with source and detector exchanged",
}


@dataclasses.dataclass(frozen=True)
class Consistency:
    """How well pairs of readings agree that must be equal.

    Parameters
    ----------
    kind
        ``repeats``, ``mirror`` or ``reciprocal``.
    pairs
        How many, those far off the others left out.
    relative
        Relative standard deviation of one reading that they show.
    stated
        That of the noise in use, root mean square, with the scan's factor where the pairs cross scans.
    p_value
        Chance of as much scatter under that noise.
    is_broken
        Whether they differ by more than the noise.
    """

    kind: str
    pairs: int
    relative: float
    stated: float
    p_value: float
    is_broken: bool

    @property
    def sentence(self) -> str:
        """In words, for a verdict."""
        return (
            f"{_WORDS[self.kind]} differ by {self.relative:.2%} where the noise is {self.stated:.2%}, which "
            "no isotropic sample explains"
        )


def consistency_of(
    data: GonioData, noise: FitNoise, policy: SearchPolicy = DEFAULT_POLICY
) -> tuple[Consistency, ...]:
    """Agreement of repeats, mirror images and reciprocal pairs under the noise in use.

    Parameters
    ----------
    data
        The measurement.
    noise
        Its noise, at the used points.
    policy
        How many pairs are enough, and when they differ.

    Returns
    -------
    tuple[Consistency, ...]
        Of the kinds with enough pairs.
    """
    relative = noise.sigma_per_sr / np.abs(data.bsdf_per_sr[data.used])
    within = float(np.sqrt(np.mean(relative**2)))
    found = []
    for source in estimate_noise(data).sources:
        if source.pairs < policy.fewest_pairs or not source.relative > 0:
            continue
        between = _between(data, noise.scan_relative) if source.name == "reciprocal" else 0.0
        stated = float(np.hypot(within, between))
        # Pairs of two scans share their factors: no more than one for each scan but the first is independent.
        shared = (between / stated) ** 2 * max(source.pairs / max(len(source.scans) - 1, 1) - 1, 0.0)
        independent = source.pairs / (1 + shared)
        p_value = float(chi2.sf(independent * (source.relative / stated) ** 2, independent))
        is_broken = bool(p_value < policy.noise_p and source.relative > policy.sigma_tolerance * stated)
        found.append(Consistency(source.name, source.pairs, source.relative, stated, p_value, is_broken))
    return tuple(found)


def _between(data: GonioData, scan_relative: float) -> float:
    """What the factors of two scans add to a reciprocal difference, in units of one reading.

    Where mirror images were averaged first, one reading counts less, but its scan's factor does not.
    """
    _, means = repeat_differences(without_copies(data))
    return scan_relative * float(np.sqrt(np.mean(2 / reciprocal_differences(means).spread)))
