"""What a search is about: sample, measurement, noise and catalogue, its thresholds, and the time for it."""

import dataclasses
from collections.abc import Collection, Iterable
from functools import cached_property

import numpy as np

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.search.candidate_objective import CandidateObjective
from jaxink.diagnosis.search.checkpoint import Checkpoint
from jaxink.diagnosis.search.deadline import Deadline
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.diagnosis.statistics.points import Points
from jaxink.effects import (
    Case,
    Effect,
    Listed,
    Scene,
    declared_effects,
    effects_for,
    extend,
    model_at,
    undivided,
)
from jaxink.fitting import FitResult, UnitScale
from jaxink.measurement import FitNoise, GonioData, noise_of
from jaxink.numerics.failures import Failures
from jaxink.numerics.progress import Progress, log_progress
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig

# Slots beyond those of the declared sample's free parameters, so that all models share a program.
_FURTHER_SLOTS = 6
# Minima closer together than this fraction of the scanned range count as one.
_ANOTHER_MINIMUM = 0.02
# What failed if an effect spoils the model that it is added to.
MODEL = "the model with {}"


@dataclasses.dataclass(frozen=True)
class SearchProblem:
    """What all models of a search share.

    Parameters
    ----------
    sample, data, noise
        As declared, and the measurement with its noise.
    config, scene
        Resolution of the solver, and the settings of the used points.
    catalogue
        Classes of effects to look for.
    screen_options
        Of the screen.
    accuracy
        Largest relative error that the discretisation may cause.
    policy
        Thresholds.
    deadline
        Time for the whole search.
    failures
        Takes note of what fails.
    follow
        Called with task, step and chi-square.
    checkpoint
        Keeps what is finished.
    rivals
        Other minima of the declared fit, lowest first, where refits may start.
    """

    sample: Sample
    data: GonioData
    noise: FitNoise
    config: SolverConfig
    scene: Scene
    catalogue: tuple[type[Effect], ...]
    screen_options: ScreenOptions
    accuracy: float = DEFAULT_ACCURACY
    policy: SearchPolicy = DEFAULT_POLICY
    deadline: Deadline = dataclasses.field(default_factory=Deadline)
    failures: Failures = dataclasses.field(default_factory=Failures)
    follow: Progress = log_progress
    checkpoint: Checkpoint = dataclasses.field(default_factory=Checkpoint)
    rivals: tuple[dict[str, float], ...] = ()

    @cached_property
    def points(self) -> Points:
        """Settings of the used points."""
        return Points.of(self.data)

    def without_candidates(self) -> "SearchProblem":
        """The same without any effect to look for."""
        return self.with_candidates(())

    def with_candidates(self, names: Collection[str]) -> "SearchProblem":
        """The same with only some of the effects to look for."""
        return dataclasses.replace(self, catalogue=tuple(c for c in self.catalogue if c.name in names))

    def listed(self, accepted: tuple[Effect, ...]) -> Listed:
        """Effects that the sample may lack in addition to those accepted, without those that have failed."""
        declared = declared_effects(self.sample)
        names = {effect.name for effect in (*declared, *accepted)} | self.failures.names_with(MODEL)
        rest = tuple(c for c in self.catalogue if c.name not in names)
        relative = float(np.min(self.noise.sigma_per_sr / np.abs(self.data.bsdf_per_sr[self.data.used])))
        # Effects that divide a layer act last: all others see it undivided.
        whole = extend(self.sample, undivided((*declared, *accepted)))
        return listed_in(Case(whole, self.scene, relative, self.accuracy), rest, self.failures)

    def objective(
        self, effects: tuple[Effect, ...], n_slots: int, added_at_once: int = 1
    ) -> CandidateObjective:
        """Objective of the sample with some effects; see `CandidateObjective`."""
        arguments = self.sample, effects, self.data, self.noise, self.config, self.scene, n_slots
        return CandidateObjective(*arguments, self.checkpoint, added_at_once)

    def shared_objective(self, accepted: tuple[Effect, ...], listed: Listed) -> CandidateObjective:
        """Objective of the accepted effects and of all candidates that need no program of their own."""
        inside = tuple(e for e in listed.forms if not e.own_program)
        n_accepted = sum(len(e.terms) for e in accepted)
        most = max((len(e.terms) for e in inside), default=1)
        n_slots = len(self.sample.parameters.free) + max(_FURTHER_SLOTS, n_accepted + most)
        return self.objective(accepted + inside, n_slots)


def listed_in(case: Case, candidates: Iterable[type[Effect]], failures: Failures) -> Listed:
    """Effects that a case may have; those that fail are left out, and noted."""
    found = Listed((), {})
    for candidate in candidates:
        with failures.sparing(MODEL, candidate.name):
            one = effects_for(case, (candidate,))
            # Asked for throughout a search; an effect of a user's own may compute them.
            _ = [(form.terms, form.settings, form.program) for form in one.forms]
            found = Listed(found.forms + one.forms, found.not_testable | one.not_testable)
    return found


def problem_of(
    fit: FitResult,
    sample: Sample,
    options: DiagnosisOptions,
    follow: Progress,
    deadline: Deadline,
    failures: Failures,
    checkpoint: Checkpoint,
) -> SearchProblem:
    """The problem that a fit of the declared sample poses; the others as in `SearchProblem`."""
    data, noise = fit.data, noise_of(fit.data, sample.noise)
    return SearchProblem(
        sample,
        data,
        noise,
        _resolution(fit, sample, options),
        Scene.of_used(data),
        options.catalogue,
        dataclasses.replace(options.screen, noise_freedom=noise.degrees_of_freedom),
        options.fit.accuracy,
        options.policy,
        deadline,
        failures,
        follow,
        checkpoint,
        _rivals(fit, sample, options.policy),
    )


def _resolution(fit: FitResult, sample: Sample, options: DiagnosisOptions) -> SolverConfig:
    """Resolution of the fit, or of its start if the fit is far off: it may have run into a narrow peak."""
    reduced, far = fit.merit.reduced_chi_square, options.policy.far_reduced_chi_square
    if options.fit.config is not None or reduced is None or reduced < far:
        return fit.config
    data = fit.data
    at = data.used_directions, data.reading_order[data.used]
    method = options.fit.layer_method
    return model_at(sample, *at, accuracy=options.fit.accuracy, layer_method=method).config


def _rivals(fit: FitResult, sample: Sample, policy: SearchPolicy) -> tuple[dict[str, float], ...]:
    """Other minima of the fit along a parameter for which the misfit has several, lowest first."""
    free = {p.name: p for p in sample.parameters.free}
    rugged = next((p for p in free.values() if p.multimodal), None)
    if rugged is None:
        return ()
    scale = UnitScale.of((rugged,))

    def place(values):
        return float(scale.to_unit(np.array([values[rugged.name]]))[0])

    at, found = [place(fit.values)], list[dict[str, float]]()
    for search in sorted((s for s in fit.searches if s.is_single), key=lambda s: s.loss):
        there = place(search.values)
        if all(abs(there - other) > _ANOTHER_MINIMUM for other in at):
            at.append(there)
            found.append({name: search.values[name] for name in free})
    return tuple(found[: policy.rival_minima])
