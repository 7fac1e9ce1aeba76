"""Tests whether a mistake in the input explains why a fit fails: one refit for each hypothesis."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import cast

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.fitting.exclusion import without
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.hypotheses import (
    ANGLES_EXCHANGED,
    LIT_FROM_OTHER_SIDE,
    OF_DATA,
    OF_SIGMA,
    Corrected,
    Hypothesis,
    of_lengths,
    source_is_scanned,
)
from jaxink.fitting.inputs import limits_of
from jaxink.fitting.mistake import Mistake, RefittedHypothesis, is_ordered, log_determinant
from jaxink.fitting.objective import Objective, make_objective, weights_of
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.pigment_hypotheses import of_pigments
from jaxink.fitting.result import FitResult
from jaxink.fitting.sweep import sweep
from jaxink.fitting.verdict import FitVerdictCode, exceeds_noise
from jaxink.measurement import (
    SIGMA_TOLERANCE,
    USER,
    FitNoise,
    GonioData,
    balances,
    noise_of,
    readings_out_of_line,
)
from jaxink.model import ForwardModel
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import computing
from jaxink.numerics.progress import Progress, log_progress
from jaxink.sample import Sample
from jaxink.solver import SolverConfig, layer_method

# More readings that are far from their neighbours are no slips.
_MOST_SLIPS = 5
# A share beyond this is more than errors of calibration and of the integration explain.
_MOST_POWER = 1.05
# A mistake is named if no more than this share of the excess of reduced chi-square over 1 is left, and the
# rest is noise; or if no more than the second share is left, near the noise, and ten times as much by others.
_LEFT, _LEFT_NEARLY, _NEAR, _CLEARLY = 0.1, 0.01, 3.0, 10.0
# With values and standard deviations both corrected, relative errors are those of the file: the misfit must
# decrease then, too. A larger relative noise alone would hide any misfit.
_LEFT_AT_EQUAL_NOISE = 0.25
# Minus twice the logarithm of a likelihood ratio that is decisive.
_CLEAR_EVIDENCE = 10.0
_JACOBIANS = 30
# Number of hypotheses that are refitted with a sweep along a parameter with many minima.
_SWEPT = 2
# Programs compiled at the same time.
_COMPILING = 2
# Above this reduced chi-square the fit may have ended at a resolution that a narrow peak required.
_FAR = 3.0
# A search missed the minimum if the gradient method leaves less than this share of its reduced chi-square.
_MISSED = 0.9


def check_input(
    result: FitResult, progress: Progress | None = None, failures: Failures | None = None
) -> FitResult:
    """Look for a mistake in the input of a fit that misses the noise, and add what was found to the result.

    Nothing is corrected: a mistake is a hypothesis, tested by one refit from the declared start. A fit that
    the noise explains, or that a limit ended, is returned as it is. If another method than the gradient
    method missed the minimum of the declared input, this is noted, and mistakes are judged against it.

    Parameters
    ----------
    result
        Of `fit`, or loaded.
    progress
        Called with the hypothesis, its number, and the reduced chi-square after the refit.
    failures
        Takes note of hypotheses whose refit fails; None: the notes of the result name them.
    """
    mistakes = far_from_neighbours(result.data) or too_much_power(result.data, result.sample)
    failed = Failures() if failures is None else failures
    if is_doubtful(result):
        with computing():
            check = _Check(result, progress or log_progress, failed)
            result, is_explained = check.at_minimum()
            mistakes += () if is_explained else check.mistakes(result.verdict.code)
    if failures is None and failed.found:
        sentences = tuple(failure.sentence for failure in failed.found)
        result = dataclasses.replace(result, notes=(*result.notes, *sentences))
    return dataclasses.replace(result, mistakes=mistakes) if mistakes or result.mistakes else result


def is_doubtful(result: FitResult) -> bool:
    """Whether `check_input` tests hypotheses about the input of a fit, which are worth their refits then."""
    verdict = result.verdict
    if result.objective != "chi_square" or verdict.reduced_chi_square is None or result.outcome.is_limited:
        return False
    if verdict.code is FitVerdictCode.CONSISTENT:
        return source_is_scanned(result.data)
    if verdict.code is FitVerdictCode.NOT_CONVERGED:
        return verdict.reduced_chi_square > SIGMA_TOLERANCE**2
    return verdict.code is not FitVerdictCode.NOT_JUDGED


def far_from_neighbours(data: GonioData) -> tuple[Mistake, ...]:
    """The mistake that needs no refit: single readings that are ten times their neighbours, or a tenth."""
    found = readings_out_of_line(data)
    if not 0 < len(found) <= _MOST_SLIPS:
        return ()
    first = found[0]
    value, place = data.bsdf_per_sr[first.point], data.place(first.point)
    more = f" ({len(found)} readings are so far off)" if len(found) > 1 else ""
    return (
        Mistake(
            "reading_out_of_line",
            f"A reading is far from its neighbours: {place} has {value:.4g} /sr, where two readings on "
            f"each side say {first.expected_per_sr:.3g} /sr{more}",
            "correct the reading, or remove its row",
            None,
            None,
            is_named=True,
        ),
    )


def too_much_power(data: GonioData, sample: Sample) -> tuple[Mistake, ...]:
    """The mistake that needs no refit: more light leaves the sample than arrives."""
    found = balances(data)
    most = max(found, key=lambda balance: balance.share, default=None)
    if most is None or most.share <= _MOST_POWER:
        return ()
    light = sample.illumination
    if sample.detector_mode == "spectrometer" and light is not None and len(found) > 1:
        # Light of one wavelength may come from another one: only that of all cannot exceed what arrives.
        weights = np.interp([balance.wavelength_nm for balance in found], *light)
        shares = np.array([balance.share for balance in found])
        if np.sum(weights * shares) <= _MOST_POWER * np.sum(weights):
            return ()
    sides = " + ".join(most.sides)
    return (
        Mistake(
            "more_light_than_arrives",
            f"More light leaves the sample than arrives: at {most.wavelength_nm:g} nm and "
            f"{most.theta_i_deg:g} degrees incidence, {sides} integrates to {most.share:.3g} of the incident "
            "power, regular light not included",
            "normalise the values: a BSDF is radiance over irradiance",
            None,
            None,
            is_named=True,
        ),
    )


class _Check:
    """The hypotheses about the input of one fit, and their refits."""

    def __init__(self, result: FitResult, progress: Progress, failures: Failures):
        self.result, self.progress, self.failures, self.count = result, progress, failures, 0
        starts = {parameter.name: parameter.start for parameter in result.parameters.free}
        table = result.sample.parameters.at(starts)
        self.sample = dataclasses.replace(result.sample, parameters=table)
        self.before = result.verdict.reduced_chi_square or 0.0
        self.config = self._config()
        self.rugged = [p.name for p in self.sample.parameters.free if p.multimodal]

    def _config(self) -> SolverConfig:
        """Resolution of the fit, or of its start if it is far off: the fit has compiled programs of both."""
        config = self.result.config
        # A result states which method was the fastest; programs are known by what was asked for.
        if config.layer_method == layer_method("fastest"):
            config = dataclasses.replace(config, layer_method="fastest")
        if self.before < _FAR:
            return config
        objective = make_objective(self.result.data, self.sample, layer_method=config.layer_method)
        start = cast(ForwardModel, objective.model).config
        return start if config.at_least(start) == config else config

    def at_minimum(self) -> tuple[FitResult, bool]:
        """The result, with a note if its search missed the minimum, and whether noise explains that one."""
        if self.result.outcome is Outcome.CONVERGED or self.before < SIGMA_TOLERANCE**2:
            return self.result, False
        _, objective = self._objective(self.result.data, self.sample)
        start = objective.scale.to_unit(np.array([p.value for p in self.sample.parameters.free]))
        chi_square, freedom, _ = self._left_by(
            objective, self._search(objective, start, {}, bool(self.rugged))
        )
        if not chi_square / freedom < _MISSED * self.before:
            return self.result, False
        self.before = chi_square / freedom
        level = self.result.noise.get("level")
        known = np.inf if level is None else level.degrees_of_freedom
        note = (
            f"The search missed the minimum: the gradient method reaches a reduced chi-square of "
            f"{self.before:.4g} from the same start."
        )
        result = dataclasses.replace(self.result, notes=(*self.result.notes, note))
        return result, not exceeds_noise(chi_square, freedom, known)

    def mistakes(self, code: FitVerdictCode) -> tuple[Mistake, ...]:
        """All hypotheses that were tested; costly ones only if none of the others is named."""
        if code is FitVerdictCode.CONSISTENT:
            return self._judged(list(self._tried((ANGLES_EXCHANGED,))))
        if code is FitVerdictCode.OVERSTATED_NOISE:
            return self._judged(list(self._tried(OF_SIGMA)))
        tried = self._swept(list(self._tried((*OF_DATA, *OF_SIGMA))))
        if not self._is_any_named(tried):
            lengths, pigments = tuple(of_lengths(self.sample)), tuple(of_pigments(self.sample))
            groups = (LIT_FROM_OTHER_SIDE,), (ANGLES_EXCHANGED,), lengths, pigments
            # Most of the time is compilation, of one program for each group.
            with ThreadPoolExecutor(_COMPILING) as pool:
                more = [one for group in pool.map(self._tried_in_thread, groups) for one in group]
            tried += self._swept(more)
        return self._judged(tried)

    def _is_any_named(self, tried: list[RefittedHypothesis]) -> bool:
        return any(mistake.is_named for mistake in self._judged(tried))

    def _swept(self, tried: list[RefittedHypothesis]) -> list[RefittedHypothesis]:
        """The best hypotheses again, with a sweep: one refit may end in the wrong one of many minima."""
        if not self.rugged or self._is_any_named(tried):
            return tried
        promising = sorted((t for t in tried if not t.hypothesis.about_noise), key=lambda t: t.reduced)
        for one in promising[:_SWEPT]:
            again = self._tried((one.hypothesis,), is_thorough=True)
            tried = [t for t in tried if t is not one] + list(again)
            if self._is_any_named(tried):
                break
        return tried

    def _tried_in_thread(self, hypotheses: tuple[Hypothesis, ...]) -> list[RefittedHypothesis]:
        with computing():
            return list(self._tried(hypotheses))

    def _judged(self, tried: list[RefittedHypothesis]) -> tuple[Mistake, ...]:
        best = sorted(tried, key=lambda t: t.left)
        fits = self.result.verdict.code is FitVerdictCode.CONSISTENT
        named = [t for t in best if t.is_possible and t.left <= _LEFT and t.is_noise and not fits]
        named = named or [t for t in best if self._is_likelier_design(t)]
        if not named and best and best[0].is_possible:
            others = best[1].left if len(best) > 1 else 1.0
            if best[0].left <= min(_LEFT_NEARLY, others / _CLEARLY) and 1 < best[0].reduced <= _NEAR:
                named = best[:1]
        rest = [t for t in best if not any(t is one for one in named)]
        return tuple(self._mistake(t, True) for t in named) + tuple(self._mistake(t, False) for t in rest)

    def _mistake(self, tried: RefittedHypothesis, is_named: bool) -> Mistake:
        # A corrected input may mask other points: of those that the refit uses.
        of, fall = tried.hypothesis, (self.before - tried.reduced) * tried.freedom
        return Mistake(of.name, of.statement, of.remedy, tried.reduced, fall, is_named)

    @property
    def _chi_square(self) -> float:
        whitened = self.result.whitened
        assert whitened is not None, "without known noise no input is doubtful"
        return float(np.sum(whitened[weights_of(self.result.data, self.sample) > 0] ** 2))

    def _is_likelier_design(self, tried: RefittedHypothesis) -> bool:
        """Whether exchanged angles explain the noise of the scans better, where the source seems scanned.

        Through a symmetric sample the exchange changes no value, only which points share a scan's factor.
        """
        if tried.hypothesis is not ANGLES_EXCHANGED or not source_is_scanned(self.result.data):
            return False
        _, objective = self._objective(self.result.data, self.sample)
        before = self._chi_square + log_determinant(objective, self.result.predicted_per_sr)
        gain = before - (tried.chi_square + tried.log_determinant)
        return tried.is_noise and bool(gain > _CLEAR_EVIDENCE)

    def _tried(
        self, hypotheses: Iterable[Hypothesis], is_thorough: bool = False
    ) -> Iterator[RefittedHypothesis]:
        for hypothesis in hypotheses:
            tried: RefittedHypothesis | None = None
            with (
                self.failures.sparing("the test for the mistake {} in the input", hypothesis.name),
                # If the corrected input is no input at all, the mistake cannot have been made.
                suppress(InputRefusedError),
            ):
                corrected = hypothesis.correct(self.result.data, self.sample)
                if corrected is not None:
                    tried = self._refitted(hypothesis, corrected, is_thorough)
            if tried is None:
                continue
            self.count += 1
            self.progress(f"input check, {hypothesis.name}", self.count, tried.reduced)
            yield tried

    def _refitted(
        self, hypothesis: Hypothesis, corrected: Corrected, is_thorough: bool
    ) -> RefittedHypothesis:
        tried = self._tested(hypothesis, corrected.data, corrected.sample, corrected.held, is_thorough)
        # Values that sink under the noise as stated explain nothing, however small chi-square becomes.
        explains = tried.reduced < self.before and tried.left <= _LEFT_AT_EQUAL_NOISE
        if corrected.noise_as_stated is None or not explains:
            return tried
        # The mistake may have been made with the values alone.
        kept = self._tested(hypothesis, *corrected.noise_as_stated, corrected.held, is_thorough)
        kept = dataclasses.replace(kept, is_possible=not kept.is_ordered)
        return min(tried, kept, key=lambda t: abs(np.log(max(t.reduced, 1e-300))))

    def _tested(
        self,
        hypothesis: Hypothesis,
        data: GonioData,
        sample: Sample,
        values_held: Mapping[str, float],
        is_thorough: bool,
    ) -> RefittedHypothesis:
        """One refit from the declared start, judged by the points that the corrected input would use."""
        data, objective = self._objective(data, sample)
        free = sample.parameters.free
        values = np.array([values_held.get(p.name, p.value) for p in free])
        start = objective.scale.to_unit(values)
        held = {i: float(start[i]) for i, p in enumerate(free) if p.name in values_held}
        search = self._search(objective, start, held, is_thorough)
        chi_square, freedom, whitened = self._left_by(objective, search)
        # Chi-square itself is known to its standard deviation only, and so is an estimated noise.
        level = self.result.noise.get("level")
        known = np.inf if level is None else level.degrees_of_freedom
        excess = max(abs(chi_square / freedom - 1) - float(np.sqrt(2 / freedom + 2 / known)), 0.0)
        left = excess / max(abs(self.before - 1), 1e-300)
        ordered = is_ordered(data, whitened, objective.weight > 0)
        return RefittedHypothesis(
            hypothesis=hypothesis,
            chi_square=chi_square,
            freedom=freedom,
            left=left,
            is_possible=not (hypothesis.about_noise and ordered),
            is_ordered=ordered,
            log_determinant=log_determinant(objective, search.predicted),
            noise_freedom=known,
        )

    def _left_by(self, objective: Objective, search: Search) -> tuple[float, int, np.ndarray]:
        """Chi-square of the points that have a weight, its degrees of freedom, and whitened residuals."""
        whitened = np.asarray(objective.in_noise(search.predicted, objective.measured - search.predicted))
        weighted = objective.weight > 0
        freedom = max(int(np.sum(weighted)) - len(self.sample.parameters.free), 1)
        return (
            float(np.sum(whitened[weighted] ** 2)) if np.isfinite(search.loss) else np.inf,
            freedom,
            whitened,
        )

    def _search(
        self, objective: Objective, start: np.ndarray, held: dict[int, float], is_thorough: bool
    ) -> Search:
        if not is_thorough:
            return GradientSearch(objective, _JACOBIANS).run(start, held)
        engine = GradientSearch(objective.tabulated(), _JACOBIANS)
        starts = sweep(engine, start, objective.free.index(self.rugged[0])).starts
        searches = [engine.run(there, held) for there in starts]
        return min(searches, key=lambda s: s.loss if np.isfinite(s.loss) else np.inf)

    def _noise(self, data: GonioData, sample: Sample) -> FitNoise:
        """Noise of a corrected input.

        Noise estimated from the values keeps its relative size: a wrong correction makes pairs
        disagree, and the misfit would then pass for noise.
        """
        before, used = self.result, self.result.data.used
        has_sigma = data.sigma_per_sr is not None and sample.noise.use_file_sigma
        if has_sigma or sample.noise.relative is not None:
            return noise_of(data, sample.noise)
        was = np.abs(before.data.bsdf_per_sr[used])
        factor = np.where(was > 0, np.abs(data.bsdf_per_sr[used]) / np.where(was > 0, was, 1.0), 1.0)
        stated = before.noise
        sigma, level = before.sigma_per_sr * factor, stated.get("level")
        return FitNoise(sigma, stated["scan_relative"], stated["origin"], level=level)

    def _objective(self, data: GonioData, sample: Sample) -> tuple[GonioData, Objective]:
        """Measurement and objective at the points of the fit, so that hypotheses share its programs.

        Points that the corrected input would mask stay, without weight.
        """
        used = self.result.data.used
        masked = (data.with_masks(limits_of(sample)).mask != 0)[used]
        data = data.replace(mask=np.where(used, 0, USER.bit).astype(np.uint32))
        objective = make_objective(data, sample, "chi_square", self.config, self._noise(data, sample))
        return data, without(objective, masked) if masked.any() else objective
