"""Find the residual, name the missing effect, add it, and say what that changed."""

import dataclasses
import logging
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from jaxink.diagnosis.candidate import ScreenOptions, ScreenResult
from jaxink.diagnosis.consistency import consistency_of
from jaxink.diagnosis.cross_validation import (
    HeldOutGain,
    Observations,
    block_folds,
    held_out_gain,
    scan_folds,
)
from jaxink.diagnosis.discrepancy import SmoothPart, misfit_deviation
from jaxink.diagnosis.further_measurements import Further, further_measurements
from jaxink.diagnosis.location import locate
from jaxink.diagnosis.outcome import CandidateRow, Diagnosis, Step, summary_of
from jaxink.diagnosis.points import Points
from jaxink.diagnosis.stage import (
    FAR,
    Direction,
    Refit,
    Setup,
    Stage,
    deviations,
    finite,
    held_out_predictions,
    in_threads,
)
from jaxink.diagnosis.structure import StructureResult, find_structure
from jaxink.diagnosis.verdict import is_met, judge
from jaxink.effects import CATALOGUE, Effect, Scene
from jaxink.errors import InputRefusedError, require_integer, require_kind
from jaxink.fitting import FitOptions, FitResult, fit
from jaxink.fitting.inputs import read_inputs
from jaxink.fitting.objective import weights_of
from jaxink.measurement import GonioData, noise_of
from jaxink.measurement.masks import USER
from jaxink.model.forward import ForwardModel
from jaxink.numerics.precision import computing
from jaxink.numerics.progress import Progress, log_progress
from jaxink.sample import Sample
from jaxink.solver.stack import SolverConfig

_LOG = logging.getLogger("jaxink")
# Effects with a program of their own are refitted where they promise this share of what others give, less
# where a promise says less, and at most so many of them.
_OWN_SHARE, _OWN_SHARE_FAR, _MOST_OWN = 0.75, 0.25, 4
# A strength this many standard errors from the declared model.
_CLEAR = 2.0
_TRIES = 3
# Reduced chi-square that a single effect has to reach, or pairs are looked at: so many first and second ones.
_ENOUGH, _FORESEEN = 1.3, 4
# Refits that are followed to their minima: so many, of those that gain at least this share of the best.
_POLISHED, _POLISH_SHARE = 6, 0.4
# Standard deviations to either side of a value that 95 % lie within.
_COVERAGE = 1.96
# Candidates that are fitted in the place of an effect, to know its class.
_RIVALS = 6


@dataclasses.dataclass(frozen=True)
class DiagnosisOptions:
    """Choices of a diagnosis.

    Parameters
    ----------
    max_effects
        Most effects that are added.
    max_parameters
        Most parameters that are free at a time, those of the declared sample included; None for no limit.
    level
        Chance that the screen calls any effect where there is none.
    n_bootstrap, seed
        Null data sets of the screen, and their seed.
    fit
        Of the fit of the declared model.
    catalogue
        Classes of effects that are looked for; `CATALOGUE` and any of your own.

    Raises
    ------
    InputRefusedError
        A number is outside its range, what stands in the catalogue is no class of effects, or two effects
        have one name.
    """

    max_effects: int = 3
    max_parameters: int | None = None
    level: float = 0.05
    n_bootstrap: int = 2000
    seed: int = 20260
    fit: FitOptions = FitOptions(profile="none")
    catalogue: tuple[type[Effect], ...] = CATALOGUE

    def __post_init__(self):
        require_integer("max_effects", self.max_effects, 0)
        if self.max_parameters is not None:
            require_integer("max_parameters", self.max_parameters, 1)
        require_kind("fit", self.fit, FitOptions)
        # Refused before the fit, not after it.
        _ = self.screen
        for effect in self.catalogue:
            if not (isinstance(effect, type) and issubclass(effect, Effect)):
                raise InputRefusedError(f"the catalogue takes classes of effects; it was given {effect!r}.")
        names = [effect.name for effect in self.catalogue]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputRefusedError(f"two effects of the catalogue are called '{min(twice)}'.")
        if self.fit.objective != "chi_square" or self.fit.method != "gradient":
            raise InputRefusedError("a diagnosis needs a gradient fit with the objective 'chi_square'.")

    @property
    def screen(self) -> ScreenOptions:
        """What of it the screen is given."""
        return ScreenOptions(self.n_bootstrap, self.level, self.seed)


def diagnose(
    data: GonioData | str | Path,
    sample: Sample | str | Path,
    options: DiagnosisOptions | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Say whether a model lacks something, name it, add it, and report the error before and after.

    Parameters
    ----------
    data
        Measurement, or its file.
    sample
        Sample as declared, or its file.
    options
        Choices; None for the defaults.
    progress
        Called with what is done, the step and the misfit.

    Raises
    ------
    InputRefusedError
        Data or sample cannot be used, or the noise is not known.
    """
    options = DiagnosisOptions() if options is None else options
    require_kind("options", options, DiagnosisOptions)
    data, sample = read_inputs(data, sample)
    data = _without_weightless(data, sample)
    follow = progress or log_progress
    result = fit(data, sample, options.fit, progress)
    with computing():
        return _Loop(result, sample, options, follow).run()


def _without_weightless(data: GonioData, sample: Sample) -> GonioData:
    """Points of weight 0 masked: there is nothing to judge in a residual that does not count."""
    weightless = np.zeros(len(data), bool)
    weightless[data.used] = weights_of(data, sample) == 0
    return data.replace(mask=data.mask | (USER.bit * weightless).astype(np.uint32))


class _Loop:
    """The procedure on one measurement."""

    def __init__(self, result: FitResult, sample: Sample, options: DiagnosisOptions, follow: Progress):
        self.result, self.options, self.follow = result, options, follow
        self.data = result.data
        used = self.data.used
        self.points = Points.of(self.data)
        noise = noise_of(self.data, sample.noise)
        self.screen_options = options.screen
        self.setup = Setup(
            sample,
            self.data,
            noise,
            _sizes(result, sample, options),
            Scene.of(*(column[used] for column in self.data.directions), self.data.row[used]),
            options.catalogue,
            self.screen_options,
            options.fit.accuracy,
        )
        self.observations = Observations(
            self.data.bsdf_per_sr[used],
            np.asarray(noise.sigma_per_sr, float),
            self.points.scan,
            float(noise.scan_relative),
            weights_of(self.data, sample)[np.unique(self.points.scan, return_index=True)[1]],
        )
        self.folds = _folds(self.points)
        self._predictions: dict[tuple, np.ndarray] = {}

    def run(self) -> Diagnosis:
        """Screen, refit, accept, again; then the verdict."""
        stage = first = Stage(self.setup, (), self.result.values)
        steps: list[Step] = []
        screens: list[tuple] = []
        structure_before = self._structure(stage)
        # Effects that make each other needless must not take turns for ever.
        for _ in range(2 * self.options.max_effects + 1):
            self.follow("screen", len(steps) + 1, stage.solution.chi_square)
            if steps and self._is_quiet(stage):
                break
            directions = stage.directions()
            screened = stage.screened(directions)
            room = self.options.max_effects - len(steps)
            if room <= 0:
                screens.append((stage, screened, {}, directions))
                break
            refits, rest = self._refits(stage, screened, directions)
            reach = self._foresight(stage, refits) if room > 1 else {}
            for name in rest:
                if self._is_enough(refits, reach):
                    break
                self._refit(stage, name, directions, refits)
                self._polish(stage, refits)
            screens.append((stage, screened, refits, directions))
            step = self._step(stage, screened, refits, reach)
            if step is None:
                break
            steps.append(step)
            accepted, values = self._without_superfluous(stage, step)
            steps = [s for s in steps if s.form in accepted]
            left, stage = stage, Stage(self.setup, accepted, values)
            left.release()
        if len(steps) > 1:
            steps = [self._with_rivals(stage, step) for step in steps]
        structure_after = self._structure(stage) if steps else structure_before
        further = self._further(screens, steps)
        return self._report(first, stage, steps, screens, (structure_before, structure_after), further)

    def _is_quiet(self, stage: Stage) -> bool:
        """Whether an enlarged model leaves noise, in size and in order."""
        structure = self._structure(stage)
        return min(structure.p_value, structure["chi_square"].p_value) >= self.options.level

    def _with_rivals(self, last: Stage, step: Step) -> Step:
        """A step with the class that it has beside all other effects, instead of without the later ones."""
        others = tuple(e for e in last.accepted if e != step.form)
        terms = tuple(term.name for term in step.form.terms)
        errors = deviations(last.bench, last.solution)
        without = Stage(self.setup, others, {k: v for k, v in last.solution.values.items() if k not in terms})
        directions = without.directions(with_own=False)
        order = sorted(directions, key=lambda name: -without.promise(directions[name]))
        n = len(self.points)
        drop = without.solution.chi_square - last.solution.chi_square
        own = Refit(step.form, last.solution, last.bench, drop)
        rivals = [
            without.polished(without.best_refit(directions[name]))
            for name in order[:_RIVALS]
            if name != step.effect
        ]
        close = [r for r in rivals if r.is_like(own, n) or r.penalised(n) > own.penalised(n)]
        close.sort(key=lambda r: -r.penalised(n))
        return dataclasses.replace(
            step,
            members=(step.effect, *(r.effect.name for r in close)),
            strength=last.solution.values[step.form.strength.name] - step.form.neutral,
            standard_error=finite(errors[step.form.strength.name]),
            terms={name: last.solution.values[name] for name in terms},
            term_errors={name: finite(errors[name]) for name in terms},
        )

    def _structure(self, stage: Stage) -> StructureResult:
        return find_structure(
            stage.residual, stage.jacobian, self.points, at_bound=stage.at_bound, options=self.screen_options
        )

    def _refits(
        self, stage: Stage, screened: ScreenResult, directions: dict[str, list[Direction]]
    ) -> tuple[dict[str, Refit], list[str]]:
        """Refits of the significant candidates, and the names of those that were left out.

        All that share the program are fitted, of those with one of their own the ones that lead.
        """
        # Far from a minimum of the true model a score may even have the wrong sign: all are tried then.
        called = [
            c.name
            for c in screened.candidates
            if c.p_adjusted <= self.options.level or (stage.is_far and c.status != "not_testable")
        ]
        called = [name for name in called if self._has_room(stage, directions[name])]
        promise = {name: stage.promise(directions[name]) for name in called}
        refits: dict[str, Refit] = {}
        own = sorted((n for n in promise if directions[n][0].effect.own_program), key=lambda n: -promise[n])
        for name in (n for n in promise if n not in own):
            self._refit(stage, name, directions, refits)
        self._polish(stage, refits)
        likely = max([r.drop for r in refits.values()] + list(promise.values()), default=0.0)
        share = _OWN_SHARE_FAR if stage.is_far and not self._is_enough(refits, {}) else _OWN_SHARE
        worth = [n for n in own if promise[n] >= share * likely][:_MOST_OWN]
        programs: dict[str, list[str]] = {}
        for name in worth:
            programs.setdefault(directions[name][0].effect.program, []).append(name)
        in_threads(
            lambda names: [self._refit(stage, name, directions, refits) for name in names], programs.values()
        )
        self._polish(stage, refits)
        return refits, [name for name in own if name not in refits]

    def _has_room(self, stage: Stage, directions: list[Direction]) -> bool:
        """Whether the terms of an effect may be free besides the rest."""
        most = self.options.max_parameters
        return most is None or len(stage.free) + len(directions[0].effect.terms) <= most

    def _refit(self, stage: Stage, name: str, directions, refits: dict[str, Refit]) -> None:
        refits[name] = stage.best_refit(directions[name])
        self.follow(f"refit with {name}", len(refits), refits[name].solution.chi_square)

    def _polish(self, stage: Stage, refits: dict[str, Refit]) -> None:
        """Go on with the leading refits to their minima."""
        n = len(self.points)
        leading = sorted(refits, key=lambda name: -refits[name].penalised(n))[:_POLISHED]
        for name in leading:
            if refits[name].drop >= _POLISH_SHARE * refits[leading[0]].drop:
                refits[name] = stage.polished(refits[name])

    def _is_enough(self, refits: dict[str, Refit], reach: dict[str, float]) -> bool:
        """Whether an effect, or a pair of them, leaves little; or there was little to leave."""
        least = min([r.solution.chi_square for r in refits.values()] + list(reach.values()), default=np.inf)
        return least < _ENOUGH * len(self.points)

    def _step(
        self, stage: Stage, screened: ScreenResult, refits: dict[str, Refit], reach: dict[str, float]
    ) -> Step | None:
        """The first class of candidates that stands all tests.

        Of two effects together, the best single one is often a third that imitates both: where one alone is
        not enough, those lead from which a second one leads furthest.
        """
        n = len(self.points)

        def left(refit):
            alone = refit.solution.chi_square + len(refit.effect.terms) * np.log(n)
            return min(alone, reach.get(refit.effect.name, np.inf))

        ranked = sorted(refits.values(), key=left)
        tried: set[str] = set()
        for _ in range(_TRIES):
            others = [r for r in ranked if r.effect.name not in tried]
            if not others or others[0].penalised(n) <= 0:
                return None
            best = others[0]
            members = [r for r in others if r.is_like(best, n)]
            tried |= {r.effect.name for r in members}
            errors = best.deviations()
            error = errors[best.effect.strength.name]
            # A strength that its range stops has no error, and is clear.
            clear = not np.isfinite(error) or abs(best.strength) > _CLEAR * error
            gain = self._gain(stage, best)
            if clear and gain.improves:
                return Step(
                    effect=best.effect.name,
                    form=best.effect,
                    members=tuple(r.effect.name for r in members),
                    predicted_drop=screened[best.effect.name].predicted_drop,
                    actual_drop=best.drop,
                    held_out_gain=gain,
                    strength=best.strength,
                    standard_error=finite(error),
                    unit=best.effect.strength.unit,
                    terms={t.name: best.solution.values[t.name] for t in best.effect.terms},
                    term_errors={t.name: finite(errors[t.name]) for t in best.effect.terms},
                    refit=best,
                )
        return None

    def _foresight(self, stage: Stage, refits: dict[str, Refit]) -> dict[str, float]:
        """Chi-square, terms paid for, that a second effect reaches after each leading one.

        Empty where one alone is enough. Effects with a program of their own are not followed up.
        """
        n = len(self.points)
        ranked = sorted(refits.values(), key=lambda r: -r.penalised(n))
        if not ranked or ranked[0].solution.chi_square < _ENOUGH * n:
            return {}
        reach: dict[str, float] = {}
        for refit in [r for r in ranked if not r.effect.own_program][:_FORESEEN]:
            ahead = stage.after(refit)
            directions = ahead.directions(with_own=False)
            order = sorted(directions, key=lambda name: -ahead.promise(directions[name]))
            order = [name for name in order if self._has_room(ahead, directions[name])]
            found = [ahead.polished(ahead.best_refit(directions[name])) for name in order[:_FORESEEN]]
            costs = len(refit.effect.terms) * np.log(n)
            ends = [r.solution.chi_square + (len(r.effect.terms)) * np.log(n) + costs for r in found]
            reach[refit.effect.name] = min(ends, default=np.inf)
            self.follow(f"foresight with {refit.effect.name}", len(reach), refit.solution.chi_square)
        return reach

    def _gain(self, stage: Stage, refit: Refit) -> HeldOutGain:
        """Gain in the log density of held-out points."""
        before = self._held_out((), stage.bench, stage.solution, stage.accepted)
        after = self._held_out((refit.effect,), refit.bench, refit.solution, stage.accepted)
        return held_out_gain(self.observations, self.folds, before, after)

    def _held_out(self, more, bench, solution, accepted) -> Float[np.ndarray, "folds points"]:
        key = (*accepted, *more)
        if key not in self._predictions:
            self.follow("held out", len(self.folds), solution.chi_square)
            self._predictions[key] = held_out_predictions(bench, solution, self.folds)
        return self._predictions[key]

    def _without_superfluous(self, stage: Stage, step: Step):
        """Effects found so far, without those that the last one made needless."""
        refit, n = step.refit, len(self.points)
        accepted, values = (*stage.accepted, step.form), refit.solution.values
        for effect in stage.accepted:
            terms = {t.name for t in effect.terms}
            free = tuple(name for name in refit.solution.free if name not in terms)
            without = refit.bench.fit(values | {effect.strength.name: effect.neutral}, free)
            if without.chi_square - refit.solution.chi_square < len(terms) * np.log(n):
                accepted = tuple(e for e in accepted if e != effect)
                values = without.values
                _LOG.debug("%s is needed no more", effect.name)
                break
        return accepted, values

    def _further(self, screens, steps: list[Step]) -> tuple[Further, ...]:
        """Measurements that would tell the members of the first class apart."""
        if not steps or len(steps[0].members) < 2:
            return ()
        stage, _, refits, _ = screens[0]
        pair = [refits.get(name) for name in steps[0].members[:2]]
        if len(steps) > 1 or None in pair:
            return ()
        self.follow("further measurements", 1, pair[0].solution.chi_square)
        return further_measurements(self.setup, stage.accepted, *pair)

    def _misfit_errors(self, stage: Stage, smooth: SmoothPart) -> dict[str, float | None]:
        """How far the smooth part of the misfit may have shifted each parameter."""
        if smooth.p_value > self.options.level:
            return {name: 0.0 for name in stage.free}
        shifts = misfit_deviation(smooth, stage.jacobian, self.points, at_bound=stage.at_bound)
        return {name: finite(shift) for name, shift in zip(stage.free, shifts.tolist(), strict=True)}

    def _report(self, first, last, steps, screens, structures, further) -> Diagnosis:
        structure_before, structure_after = structures
        before = summary_of(
            self.data,
            self.observations,
            first,
            self._held_out((), first.bench, first.solution, ()),
            self.folds,
        )
        held = self._held_out((), last.bench, last.solution, last.accepted)
        after = summary_of(self.data, self.observations, last, held, self.folds) if steps else before
        location = locate(
            last.residual, last.jacobian, self.points, at_bound=last.at_bound, options=self.screen_options
        )
        rows = _candidate_rows(screens[0], steps)
        consistency = consistency_of(self.data, self.setup.noise)
        estimates, misfit_errors = _with_errors(last), self._misfit_errors(last, location.smooth)
        remains = not is_met(after, structure_after)
        undetermined = _undetermined(last, estimates, misfit_errors) if remains else ()
        verdict = judge(
            steps, before, after, structure_after, location, rows, further, consistency, undetermined
        )
        return Diagnosis(
            result=self.result,
            verdict=verdict,
            steps=tuple(steps),
            before=before,
            after=after,
            candidates=rows,
            not_testable=first.listed.not_testable,
            structure_before=structure_before,
            structure_after=structure_after,
            location=location,
            parameters_before=_with_errors(first),
            parameters_after=estimates,
            misfit_errors=misfit_errors,
            undetermined=undetermined,
            refined=_refined(last),
            effects=last.accepted,
            settings={
                key: getattr(self.options, key)
                for key in ("level", "n_bootstrap", "seed", "max_effects", "max_parameters")
            },
            further=further,
            consistency=consistency,
            remaining=_candidate_rows(screens[-1], ()) if len(screens) > 1 else (),
        )


def _undetermined(stage: Stage, estimates, misfit_errors) -> tuple[str, ...]:
    """Parameters on a bound, or that the misfit may have shifted so far as to one."""
    names = []
    for name, (value, error) in estimates.items():
        term, misfit = stage.bench.terms[name], misfit_errors[name]
        room = min(value - term.minimum, term.maximum - value)
        if misfit is None or error is None or _COVERAGE * np.hypot(misfit, error) >= room:
            names.append(name)
    return tuple(names)


def _sizes(result: FitResult, sample: Sample, options: DiagnosisOptions) -> SolverConfig:
    """Sizes of the fit, or of its start where the fit is far off: it may have run into a narrow peak."""
    reduced = result.merit.reduced_chi_square
    if options.fit.config is not None or reduced is None or reduced < FAR:
        return SolverConfig(**result.solver)
    used = result.data.used
    directions = (column[used] for column in result.data.directions)
    return ForwardModel(sample, *directions, None, options.fit.accuracy, options.fit.layer_method).config


def _with_errors(stage: Stage) -> dict[str, tuple[float, float | None]]:
    errors = deviations(stage.bench, stage.solution)
    return {n: (stage.solution.values[n], finite(errors[n])) for n in stage.free}


def _folds(points: Points) -> Bool[np.ndarray, "folds points"]:
    """Whole scans; blocks within them where there are too few."""
    return scan_folds(points.scan) if points.n_scans > 2 else block_folds(points)


def _candidate_rows(seen, steps) -> tuple[CandidateRow, ...]:
    """One row for each candidate of a screen, the leading first.

    Where nothing was found, refits tell whether the detection limits hold.
    """
    stage, screened, refits, directions = seen
    members = {name: step.members for step in steps for name in step.members}
    rows = []
    for c in screened.candidates:
        refit = refits.get(c.name)
        # A direction is per unit of what its setting does; strengths are told in a unit of their own.
        direction = directions[c.name][max(c.inner, 0)]
        limit, status, reason = c.detection_limit, c.status, c.reason
        if status == "testable" and not steps and not stage.accepted:
            limit = stage.limit_by_refits(direction, limit, c.critical_z)
        if limit >= direction.largest and status == "testable":
            status, reason = "hardly_testable", "hardly any strength within its range would be seen"
        limit *= direction.column_strength
        if status == "testable" and limit > direction.effect.usual:
            status = "hardly_testable"
            reason = f"its detection limit lies beyond its usual strength, {direction.effect.usual:g}"
        # A linear step beyond its range says nothing.
        step = c.strength * direction.column_strength if abs(c.strength) <= direction.largest else np.nan
        rows.append(
            CandidateRow(
                effect=c.name,
                z=c.z,
                p_raw=c.p_raw,
                p_adjusted=c.p_adjusted,
                absorbed_fraction=c.absorbed_fraction,
                detection_limit=limit,
                detection_limit_unit=direction.unit,
                strength=refit.strength if refit else step,
                unit=refit.effect.strength.unit if refit else direction.unit,
                members=members.get(c.name, (c.name,)),
                predicted_drop=c.predicted_drop,
                refit_drop=refit.drop if refit else None,
                status=status,
                reason=reason,
            )
        )
    return tuple(
        sorted(rows, key=lambda r: -(r.refit_drop if r.refit_drop is not None else r.predicted_drop))
    )


def _refined(stage: Stage) -> Sample:
    """The declared sample with what was found of the sample itself; instrument effects stay out."""
    from jaxink.effects import extend
    from jaxink.sample import ParameterTable

    sample = extend(stage.setup.sample, stage.accepted)
    table = [
        dataclasses.replace(p, value=stage.solution.values.get(p.name, p.value)) if p.tie is None else p
        for p in sample.parameters.values()
    ]
    return dataclasses.replace(sample, parameters=ParameterTable(table))
