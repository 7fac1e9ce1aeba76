"""Choice of the next effect: refits of the candidates of a stage, and the acceptance tests."""

import dataclasses
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from itertools import zip_longest

import numpy as np
from scipy.special import chdtrc

from jaxink.diagnosis.search.candidate_refits import best_refit, continued_refit, converged, refit_by_scan
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.setup import DiagnosisOptions
from jaxink.diagnosis.search.stage import Stage, by_program
from jaxink.diagnosis.search.step import Addition, Screening, Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.effects import Effect, invalidity
from jaxink.numerics.progress import StepOf
from jaxink.numerics.threads import in_threads


@dataclasses.dataclass(frozen=True)
class ForwardSelection:
    """Choice of the next effect while time allows."""

    options: DiagnosisOptions
    n_points: int
    cross_validation: CrossValidation

    def next_step(self, screening: Screening, with_pairs: bool, is_quiet: bool) -> Addition | None:
        """The first class of candidates that passes all tests, or None; `screening` collects the refits.

        `with_pairs`: there is room for a second effect, so candidates are also judged together with a second
        one; `is_quiet`: the residual is consistent with noise.
        """
        level = self.options.policy.quiet_level if is_quiet else self.options.level
        left_out = self._refit_candidates(screening, level)
        if screening.stage.is_far:
            # One more program costs less than all pairs, which nobody needs if this effect suffices.
            self._refit_until_enough(screening, left_out[:1], {})
            left_out = left_out[1:]
        if not is_quiet:
            self._refit_at_other_sizes(screening)
        reach = self._foresight(screening) if with_pairs else {}
        self._refit_until_enough(screening, left_out, reach)
        step = self._accepted(screening, reach)
        if step is None and not is_quiet:
            # What the free parameters imitate here they may not imitate at another minimum.
            names = [c.name for c in screening.result.candidates if c.status == Testability.HARDLY]
            hardly = [name for name in names if name not in screening.refits]
            hardly = [name for name in hardly if self._has_room(screening.stage, screening.directions[name])]
            self._refit_until_enough(screening, hardly, reach)
            step = self._accepted(screening, {}) if hardly else None
        return step

    def _refit_candidates(self, screening: Screening, level: float) -> list[str]:
        """Refit the significant candidates; return the names of those that were left out.

        All that share the program are fitted, but only the leading ones of those with a program of their own.
        """
        stage, directions, policy = screening.stage, screening.directions, self.options.policy
        # Far from a minimum of the true model even the sign of a score may be wrong, so all are tried.
        significant = [
            c.name
            for c in screening.result.candidates
            if c.p_adjusted <= level or (stage.is_far and c.status != Testability.NOT)
        ]
        significant = [name for name in significant if self._has_room(stage, directions[name])]
        promise = {name: stage.promise(directions[name]) for name in significant}
        own = sorted((n for n in promise if directions[n][0].effect.own_program), key=lambda n: -promise[n])
        shared = [name for name in promise if name not in own]
        likely_share = policy.own_program_share_far if stage.is_far else policy.own_program_share

        def may_be_worth(name: str) -> bool:
            # A copy: refits are added meanwhile.
            drops = [refit.delta_chi_square for refit in list(screening.refits.values())]
            return promise[name] >= likely_share * max(drops + list(promise.values()))

        with _prepared(stage, [directions[name][0].effect for name in own], may_be_worth):
            for name in shared:
                self._refit(screening, name, len(promise))
            self._polish(screening)
        drops = [r.delta_chi_square for r in screening.refits.values()]
        likely = max(drops + list(promise.values()), default=0.0)
        is_lost = stage.is_far and not self._is_enough(screening, {})
        share = policy.own_program_share_far if is_lost else policy.own_program_share
        worth = [n for n in own if promise[n] >= share * likely][: policy.most_own_programs]
        programs: dict[str | None, list[str]] = {}
        for name in worth:
            programs.setdefault(directions[name][0].effect.program, []).append(name)
        total = len(shared) + len(worth)
        later = [name for name in own if name not in worth]

        def refit(names: list[str]) -> None:
            for name in names:
                self._refit(screening, name, total)

        def prepare_next() -> None:
            if not self._is_enough(screening, {}):
                stage.prepare(directions[later[0]][0].effect)

        tasks: list[Callable[[], None]] = [partial(refit, names) for names in programs.values()]
        if is_lost and later:
            # For the thread that has nothing left to refit.
            tasks.append(prepare_next)
        in_threads(lambda task: task(), tasks)
        self._polish(screening)
        return later

    def _refit_until_enough(self, screening: Screening, names: list[str], reach: dict[str, float]) -> None:
        """Refit effects with programs of their own one by one; meanwhile, the next one is compiled."""
        pool, total = ThreadPoolExecutor(1), len(screening.refits) + len(names)
        compiled: Future | None = None
        try:
            for name, following in zip_longest(names, names[1:]):
                if self._is_enough(screening, reach):
                    break
                if compiled is not None:
                    compiled.result()
                if following is not None:
                    effect = screening.directions[following][0].effect
                    compiled = pool.submit(screening.stage.prepare, effect)
                self._refit(screening, name, total)
                self._polish(screening)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def _refit_at_other_sizes(self, screening: Screening) -> None:
        """Refit effects of the particles by a scan of their size, unless an effect leaves only noise."""
        stage = screening.stage
        names = [n for n, found in screening.directions.items() if found[0].effect.changes_particles]
        names = [name for name in names if self._has_room(stage, screening.directions[name])]
        for number, name in enumerate(names, start=1):
            lowest = screening.lowest_chi_square
            freedom = max(self.n_points - len(stage.free) - 1, 1)
            if float(chdtrc(freedom, lowest)) >= self.options.level:
                return
            if not stage.setup.deadline.permits(OptionalTask.REFIT, [name]):
                continue
            stage.setup.follow(f"refit with {name} at other sizes", StepOf(number, len(names)), lowest)
            found = refit_by_scan(stage, screening.directions[name])
            if found is not None:
                screening.refits[name] = found
                self._polish(screening)

    def _has_room(self, stage: Stage, directions: list[Direction]) -> bool:
        """Whether the number of free parameters allows for the terms of an effect."""
        most = self.options.max_parameters
        return most is None or len(stage.free) + len(directions[0].effect.terms) <= most

    def _refit(self, screening: Screening, name: str, total: int) -> None:
        """Refit one of so many effects."""
        stage, refits = screening.stage, screening.refits
        if not stage.setup.deadline.permits(OptionalTask.REFIT, [name]):
            return
        step = StepOf(len(refits) + 1, total)
        stage.setup.follow(f"refit with {name}", step, screening.lowest_chi_square)
        found = best_refit(stage, screening.directions[name])
        if found is not None:
            refits[name] = found

    def _polish(self, screening: Screening) -> None:
        """Continue the leading refits until they can be compared."""
        refits, policy = screening.refits, self.options.policy
        leading = sorted(refits, key=lambda name: -refits[name].penalised(self.n_points))
        for name in leading[: policy.most_polished]:
            refit, least = refits[name], policy.polish_share * refits[leading[0]].delta_chi_square
            is_done = refit.is_polished or refit.solution.search.outcome.converged
            if is_done or refit.delta_chi_square < least:
                continue
            if screening.stage.setup.deadline.permits(OptionalTask.CONVERGENCE, [name]):
                # If it fails, it is as close as it gets.
                refits[name] = dataclasses.replace(refit, is_polished=True)
                with screening.stage.setup.failures.sparing("the end of the refit with {}", name):
                    refits[name] = continued_refit(screening.stage, refit)

    def _is_enough(self, screening: Screening, reach: dict[str, float]) -> bool:
        """Whether one effect, or a pair, leaves little misfit; what is left is for the next stage."""
        policy, n = self.options.policy, self.n_points
        ends = [r.solution.chi_square for r in screening.refits.values()]
        least = min(ends + list(reach.values()), default=np.inf)
        excess = screening.stage.solution.chi_square - n
        return least < n + max((policy.enough_reduced_chi_square - 1) * n, policy.enough_share * excess)

    def _foresight(self, screening: Screening) -> dict[str, float]:
        """Chi-square, penalised for terms, that a second effect reaches after each leading one.

        Empty if one effect suffices. Effects with a program of their own are not followed up.
        """
        n, policy = self.n_points, self.options.policy
        ranked = sorted(screening.refits.values(), key=lambda r: -r.penalised(n))
        if not ranked or self._is_enough(screening, {}):
            return {}
        reach: dict[str, float] = {}
        stage, leading = screening.stage, [r for r in ranked if not r.effect.own_program]
        for number, refit in enumerate(leading[: policy.most_foreseen], start=1):
            if not stage.setup.deadline.permits(OptionalTask.PAIR, [refit.effect.name]):
                continue
            step = StepOf(number, min(len(leading), policy.most_foreseen))
            stage.setup.follow(f"pairs with {refit.effect.name}", step, refit.solution.chi_square)
            with stage.setup.failures.sparing(
                "the combination of {} with a second effect", refit.effect.name
            ):
                reach[refit.effect.name] = self._reach_with_second(stage, refit)
        return reach

    def _reach_with_second(self, stage: Stage, refit: Refit) -> float:
        """Chi-square, penalised for terms, that a second effect reaches after a first one."""
        n, policy = self.n_points, self.options.policy
        ahead = Stage(stage.setup, (*stage.accepted, refit.effect), refit.solution.values)
        directions = ahead.directions(with_own=False)
        order = sorted(directions, key=lambda name: -ahead.promise(directions[name]))
        order = [name for name in order if self._has_room(ahead, directions[name])]
        begun = (best_refit(ahead, directions[name]) for name in order[: policy.most_foreseen])
        found = [continued_refit(ahead, second) for second in begun if second is not None]
        ends = [r.solution.chi_square + r.penalty(n) + refit.penalty(n) for r in found]
        return min(ends, default=np.inf)

    def _accepted(self, screening: Screening, reach: dict[str, float]) -> Addition | None:
        """The first class of refits that passes all tests.

        If two effects are present, the best single one is often a third that mimics both. Unless one effect
        suffices, candidates are therefore ranked by what they reach together with a second one.
        """
        n, policy = self.n_points, self.options.policy

        def left(refit: Refit) -> float:
            alone = refit.solution.chi_square + refit.penalty(n)
            return min(alone, reach.get(refit.effect.name, np.inf))

        ranked = sorted(screening.refits.values(), key=left)
        tried: set[str] = set()
        for _ in range(policy.most_tried):
            others = [r for r in ranked if r.effect.name not in tried]
            if not others or others[0].penalised(n) <= 0:
                return None
            best = others[0]
            alike = [r for r in others if r.is_like(best, n, policy.class_delta_chi_square)]
            # Of effects that fit alike, one whose values mean what it says.
            wavelengths = screening.stage.setup.scene.wavelength_nm
            alike.sort(key=lambda r: bool(invalidity(r.effect, r.solution.values, wavelengths)))
            best, members = alike[0], tuple(r.effect.name for r in alike)
            tried.add(best.effect.name)
            error = best.estimates()[best.effect.strength.name].standard_error
            # A strength at a bound of its range has no error, and counts as significant.
            is_clear = error is None or abs(best.strength) > policy.clear_errors * error
            if not is_clear:
                tried |= set(members)
                continue
            gain = self.cross_validation.gain(screening.stage, best)
            if gain is None:
                screening.stage.setup.deadline.permits(OptionalTask.ACCEPTANCE, [best.effect.name])
                return None
            if gain.improves:
                with screening.stage.setup.failures.sparing("the end of the refit with {}", best.effect.name):
                    end = converged(screening.stage, best)
                    return Addition(Step.of(screening, end, members, gain), end)
            elif gain.gains.size:
                tried |= set(members)
        return None


@contextmanager
def _prepared(stage: Stage, effects: list[Effect], may_be_worth: Callable[[str], bool]) -> Iterator[None]:
    """Meanwhile, compile the programs of effects that may be refitted, one after the other.

    The last one may go on afterwards, beside the refits that wait for it.
    """

    def prepare(effect: Effect) -> None:
        if may_be_worth(effect.name):
            stage.prepare(effect)

    pool = ThreadPoolExecutor(1)
    try:
        for together in by_program(effects).values():
            pool.submit(prepare, together[0])
        yield
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
