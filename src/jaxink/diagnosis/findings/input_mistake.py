"""Mistakes in the input beside effects: what either explains."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from jaxink.diagnosis.findings.summary import Figures
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.policy import SearchPolicy
from jaxink.fitting import FitResult
from jaxink.fitting.mistake import Mistake, mistakes_sentence


def explains_all(mistakes: Sequence[Mistake], policy: SearchPolicy) -> bool:
    """Whether a mistake without any free parameter leaves so little that no effect need be looked for."""
    return any(
        mistake.is_named
        and mistake.reduced_chi_square is not None
        and mistake.reduced_chi_square <= policy.enough_reduced_chi_square
        for mistake in mistakes
    )


def beside_mistakes(verdict: Verdict, declared: FitResult, after: Figures, policy: SearchPolicy) -> Verdict:
    """The verdict on effects, or that the input has a mistake if no effect explains the data as well.

    Parameters
    ----------
    verdict
        From the effects alone.
    declared
        The fit of the declared model, with the mistakes that were considered.
    after
        Figures of merit with all effects.
    policy
        Thresholds.
    """
    named = [mistake for mistake in declared.mistakes if mistake.is_named]
    if not named:
        return verdict
    sentence = mistakes_sentence(tuple(declared.mistakes), declared.verdict.reduced_chi_square)
    if explains_all(named, policy):
        return Verdict(VerdictCode.INPUT_MISTAKE, (), f"{sentence} No missing effect was looked for.")
    reached = [m.reduced_chi_square for m in named if m.reduced_chi_square is not None]
    before, left = declared.verdict.reduced_chi_square, after.reduced_chi_square
    if before is not None and left is not None and verdict.effects:
        is_little = verdict.code.is_met or left - 1 <= policy.enough_share * (before - 1)
        if is_little and left <= min(reached, default=np.inf):
            also = " ".join(f"{mistake.statement}." for mistake in named)
            sentence = f"{verdict.sentence} A mistake in the input was considered, too: {also}"
            return dataclasses.replace(verdict, sentence=sentence)
    return Verdict(VerdictCode.INPUT_MISTAKE, (), f"{sentence} No effect explains the data as well.")
