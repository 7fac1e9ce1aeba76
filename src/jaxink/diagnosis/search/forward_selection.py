"""Choice of the next effect: refits of the candidates of a screen, and the acceptance tests."""

import dataclasses

import numpy as np
from scipy.special import chdtrc

from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.search.candidate_refits import best_refit, converged, polished, refit_by_scan
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.model import FittedModel, by_program, fit_model
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.search.step import Addition, Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.effects import invalidity
from jaxink.numerics.progress import StepOf
from jaxink.numerics.threads import in_threads


@dataclasses.dataclass(frozen=True)
class ForwardSelection:
    """Choice of the next effect from a screen, whose refits are kept there, while time allows."""

    screen: Screen
    options: DiagnosisOptions
    cross_validation: CrossValidation

    @property
    def model(self) -> FittedModel:
        """The model that was screened."""
        return self.screen.model

    @property
    def problem(self) -> SearchProblem:
        """What it is fitted to."""
        return self.model.problem

    @property
    def policy(self) -> SearchPolicy:
        """Thresholds."""
        return self.options.policy

    @property
    def n_points(self) -> int:
        """Number of points."""
        return len(self.problem.points)

    def next_step(self, with_pairs: bool, is_quiet: bool) -> Addition | None:
        """The first class of candidates that passes all tests, or None.

        `with_pairs`: there is room for a second effect, so candidates are also judged together with a second
        one; `is_quiet`: the residual is consistent with noise.
        """
        screen = self.screen
        left_out = self._refit_candidates(self.policy.quiet_level if is_quiet else self.options.level)
        if self.model.is_far:
            # One more program costs less than all pairs, which nobody needs if this effect suffices.
            self._refit_until_enough(left_out[:1], {})
            left_out = left_out[1:]
        if not is_quiet:
            self._refit_at_other_sizes()
        reach = self._foresight() if with_pairs else {}
        self._refit_until_enough(left_out, reach)
        step = self._accepted(reach)
        if step is None and not is_quiet:
            # What the free parameters imitate here they may not imitate at another minimum.
            names = [c.name for c in screen.result.candidates if c.status == Testability.HARDLY]
            hardly = [n for n in names if n not in screen.refits.best and self._has_room(screen, n)]
            self._refit_until_enough(hardly, reach)
            step = self._accepted({}) if hardly else None
        return step

    def _refit_candidates(self, level: float) -> list[str]:
        """Refit the significant candidates; return the names of those that were left out.

        All that share the program are fitted, but only the leading ones of those with a program of their own.
        """
        screen, model, policy = self.screen, self.model, self.policy
        # Far from a minimum of the true model even the sign of a score may be wrong, so all are tried.
        significant = [
            c.name
            for c in screen.result.candidates
            if c.p_adjusted <= level or (model.is_far and c.status != Testability.NOT)
        ]
        promise = {name: screen.promise(name) for name in significant if self._has_room(screen, name)}
        effects = {name: screen.directions[name][0].effect for name in promise}
        own = sorted((n for n in promise if effects[n].own_program), key=lambda n: -promise[n])
        shared = [name for name in promise if name not in own]
        for name in shared:
            self._refit(name, len(promise))
        self._polish()
        drops = [r.delta_chi_square for r in screen.refits.best.values()]
        likely = max(drops + list(promise.values()), default=0.0)
        is_lost = model.is_far and not self._is_enough({})
        share = policy.own_program_share_far if is_lost else policy.own_program_share
        worth = [n for n in own if promise[n] >= share * likely][: policy.most_own_programs]

        def refit(together) -> None:
            for effect in together:
                self._refit(effect.name, len(shared) + len(worth))

        in_threads(refit, by_program(effects[name] for name in worth).values())
        self._polish()
        return [name for name in own if name not in worth]

    def _refit_until_enough(self, names: list[str], reach: dict[str, float]) -> None:
        """Refit effects with programs of their own one by one."""
        total = len(self.screen.refits.best) + len(names)
        for name in names:
            if self._is_enough(reach):
                return
            self._refit(name, total)
            self._polish()

    def _refit_at_other_sizes(self) -> None:
        """Refit effects of the particles by a scan of their size, unless an effect leaves only noise."""
        screen = self.screen
        names = [n for n, found in screen.directions.items() if found[0].effect.changes_particles]
        names = [name for name in names if self._has_room(screen, name)]
        for number, name in enumerate(names, start=1):
            lowest = screen.lowest_chi_square
            freedom = max(self.n_points - len(self.model.free) - 1, 1)
            if float(chdtrc(freedom, lowest)) >= self.options.level:
                return
            if not self.problem.deadline.permits(OptionalTask.REFIT, [name]):
                continue
            self.problem.follow(f"refit with {name} at other sizes", StepOf(number, len(names)), lowest)
            if refit_by_scan(screen, name) is not None:
                self._polish()

    def _has_room(self, screen: Screen, name: str) -> bool:
        """Whether the number of free parameters allows for the terms of an effect."""
        most, effect = self.options.max_parameters, screen.directions[name][0].effect
        return most is None or len(screen.model.free) + len(effect.terms) <= most

    def _refit(self, name: str, total: int) -> None:
        """Refit one of so many effects."""
        if self.problem.deadline.permits(OptionalTask.REFIT, [name]):
            step = StepOf(len(self.screen.refits.best) + 1, total)
            self.problem.follow(f"refit with {name}", step, self.screen.lowest_chi_square)
            best_refit(self.screen, name)

    def _polish(self) -> None:
        """Continue the leading refits until they can be compared."""
        refits, problem = self.screen.refits, self.problem
        leading = sorted(refits.best.values(), key=lambda refit: -refit.penalised(self.n_points))
        for refit in leading[: self.policy.most_polished]:
            name, first = refit.effect.name, refits.best[leading[0].effect.name]
            least = self.policy.polish_share * first.delta_chi_square
            is_done = refit.is_polished or refit.solution.search.outcome.converged
            if is_done or refit.delta_chi_square < least:
                continue
            if problem.deadline.permits(OptionalTask.CONVERGENCE, [name]):
                # If it fails, it is as close as it gets.
                refits.keep(dataclasses.replace(refit, is_polished=True))
                with problem.failures.sparing("the end of the refit with {}", name):
                    refits.keep(polished(self.model, refit))

    def _is_enough(self, reach: dict[str, float]) -> bool:
        """Whether one effect, or a pair, leaves little misfit; what is left is for the next screen."""
        policy, n = self.policy, self.n_points
        ends = [r.solution.chi_square for r in self.screen.refits.best.values()]
        least = min(ends + list(reach.values()), default=np.inf)
        excess = self.model.solution.chi_square - n
        return least < n + max((policy.enough_reduced_chi_square - 1) * n, policy.enough_share * excess)

    def _foresight(self) -> dict[str, float]:
        """Chi-square, penalised for terms, that a second effect reaches after each leading one.

        Empty if one effect suffices. Effects with a program of their own are not followed up.
        """
        n, most, problem = self.n_points, self.policy.most_foreseen, self.problem
        ranked = sorted(self.screen.refits.best.values(), key=lambda r: -r.penalised(n))
        if not ranked or self._is_enough({}):
            return {}
        reach: dict[str, float] = {}
        leading = [r for r in ranked if not r.effect.own_program][:most]
        for number, refit in enumerate(leading, start=1):
            name = refit.effect.name
            if not problem.deadline.permits(OptionalTask.PAIR, [name]):
                continue
            problem.follow(f"pairs with {name}", StepOf(number, len(leading)), refit.solution.chi_square)
            with problem.failures.sparing("the combination of {} with a second effect", name):
                reach[name] = self._reach_with_second(refit)
        return reach

    def _reach_with_second(self, refit: Refit) -> float:
        """Chi-square, penalised for terms, that a second effect reaches after a first one."""
        n = self.n_points
        ahead = fit_model(self.problem, (*self.model.accepted, refit.effect), refit.solution.values)
        screen = Screen.of(ahead, with_own=False)
        order = sorted(screen.directions, key=lambda name: -screen.promise(name))
        order = [name for name in order if self._has_room(screen, name)]
        begun = (best_refit(screen, name) for name in order[: self.policy.most_foreseen])
        found = [polished(ahead, second) for second in begun if second is not None]
        ends = [r.solution.chi_square + r.penalty(n) + refit.penalty(n) for r in found]
        return min(ends, default=np.inf)

    def _accepted(self, reach: dict[str, float]) -> Addition | None:
        """The first class of refits that passes all tests.

        If two effects are present, the best single one is often a third that mimics both. Unless one effect
        suffices, candidates are therefore ranked by what they reach together with a second one.
        """
        n, policy, problem = self.n_points, self.policy, self.problem

        def left(refit: Refit) -> float:
            alone = refit.solution.chi_square + refit.penalty(n)
            return min(alone, reach.get(refit.effect.name, np.inf))

        ranked = sorted(self.screen.refits.best.values(), key=left)
        tried: set[str] = set()
        for _ in range(policy.most_tried):
            others = [r for r in ranked if r.effect.name not in tried]
            if not others or others[0].penalised(n) <= 0:
                return None
            best = others[0]
            alike = [r for r in others if r.is_like(best, n, policy.class_delta_chi_square)]
            # Of effects that fit alike, one whose values mean what it says.
            wavelengths = problem.scene.wavelength_nm
            alike.sort(key=lambda r: bool(invalidity(r.effect, r.solution.values, wavelengths)))
            best, members = alike[0], tuple(r.effect.name for r in alike)
            tried.add(best.effect.name)
            error = best.estimates()[best.effect.strength.name].standard_error
            # A strength at a bound of its range has no error, and counts as significant.
            is_clear = error is None or abs(best.strength) > policy.clear_errors * error
            if not is_clear:
                tried |= set(members)
                continue
            gain = self.cross_validation.gain(self.model, best)
            if gain is None:
                problem.deadline.permits(OptionalTask.ACCEPTANCE, [best.effect.name])
                return None
            if gain.improves:
                with problem.failures.sparing("the end of the refit with {}", best.effect.name):
                    end = converged(self.model, best)
                    return Addition(Step.of(self.screen, end, members, gain), end)
            elif gain.gains.size:
                tried |= set(members)
        return None
