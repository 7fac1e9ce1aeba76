"""Options of a diagnosis, and what all stages of its search share."""

import dataclasses
from collections.abc import Collection

import numpy as np

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.search.candidate_objective import CandidateObjective
from jaxink.diagnosis.search.checkpoint import Checkpoint
from jaxink.diagnosis.search.deadline import Deadline
from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.display.brief import brief_repr
from jaxink.effects import (
    CATALOGUE,
    Case,
    Effect,
    Listed,
    Scene,
    declared_effects,
    effects_for,
    extend,
    undivided,
)
from jaxink.errors import InputRefusedError, require_integer, require_kind, require_number, shown
from jaxink.fitting import FitOptions
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.failures import Failures
from jaxink.numerics.progress import Progress, log_progress
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig

# Slots beyond those of the declared sample's free parameters, so that all stages share a program.
_FURTHER_SLOTS = 6
# What failed if an effect spoils the model that it is added to.
MODEL = "the model with {}"


@dataclasses.dataclass(frozen=True)
class SearchProblem:
    """What all stages share: sample, measurement and resolution, classes of effects, and thresholds.

    `options` are those of the screen; `accuracy` is the largest relative error of the discretisation;
    `deadline` is the time for all of them; `failures` takes note of what fails; `follow` is called with
    task, step and chi-square; `checkpoint` keeps what is finished; `rivals` are other minima of the declared
    fit, where refits may start.
    """

    sample: Sample
    data: GonioData
    noise: FitNoise
    config: SolverConfig
    scene: Scene
    catalogue: tuple[type[Effect], ...]
    options: ScreenOptions
    accuracy: float = DEFAULT_ACCURACY
    policy: SearchPolicy = DEFAULT_POLICY
    deadline: Deadline = dataclasses.field(default_factory=Deadline)
    failures: Failures = dataclasses.field(default_factory=Failures)
    follow: Progress = log_progress
    checkpoint: Checkpoint = dataclasses.field(default_factory=Checkpoint)
    rivals: tuple[dict[str, float], ...] = ()

    def without_candidates(self) -> "SearchProblem":
        """The same without any effect to look for."""
        return self.with_candidates(())

    def with_candidates(self, names: Collection[str]) -> "SearchProblem":
        """The same with only some of the effects to look for."""
        return dataclasses.replace(self, catalogue=tuple(c for c in self.catalogue if c.name in names))

    def bench(self, effects: tuple[Effect, ...], n_slots: int, added_at_once: int = 1) -> CandidateObjective:
        """A workbench of the sample with some effects."""
        arguments = self.sample, effects, self.data, self.noise, self.config, self.scene, n_slots
        return CandidateObjective(*arguments, self.checkpoint, added_at_once)

    def listed(self, accepted: tuple[Effect, ...]) -> Listed:
        """Effects that the sample may lack in addition to those accepted, without those that have failed."""
        declared = declared_effects(self.sample)
        names = {effect.name for effect in (*declared, *accepted)} | self.failures.names_with(MODEL)
        rest = tuple(c for c in self.catalogue if c.name not in names)
        relative = float(np.min(self.noise.sigma_per_sr / np.abs(self.data.bsdf_per_sr[self.data.used])))
        # Effects that divide a layer act last: all others see it undivided.
        whole = extend(self.sample, undivided((*declared, *accepted)))
        case, found = Case(whole, self.scene, relative, self.accuracy), Listed((), {})
        for candidate in rest:
            with self.failures.sparing(MODEL, candidate.name):
                one = effects_for(case, (candidate,))
                # Asked for throughout a search; an effect of a user's own may compute them.
                _ = [(form.terms, form.settings, form.program) for form in one.forms]
                found = Listed(found.forms + one.forms, found.not_testable | one.not_testable)
        return found

    def shared_bench(self, accepted: tuple[Effect, ...], listed: Listed) -> CandidateObjective:
        """The workbench of all effects that do not need a program of their own."""
        inside = tuple(e for e in listed.forms if not e.own_program)
        n_accepted = sum(len(e.terms) for e in accepted)
        most = max((len(e.terms) for e in inside), default=1)
        n_slots = len(self.sample.parameters.free) + max(_FURTHER_SLOTS, n_accepted + most)
        return self.bench(accepted + inside, n_slots)


@dataclasses.dataclass(frozen=True)
class DiagnosisOptions:
    """Options of a diagnosis.

    Parameters
    ----------
    max_effects
        Largest number of effects added.
    max_parameters
        Largest number of free parameters, including those of the declared sample; None for no limit.
    level
        Probability that the screen detects any effect although none is present.
    n_bootstrap, seed
        Number of null data sets of the screen, and their seed.
    fit
        Of the fit of the declared model.
    catalogue
        Classes of effects that are considered: `CATALOGUE`, and your own.
    policy
        Thresholds of the search and of its verdict.
    time_limit_s
        Seconds after which the diagnosis ends with the best verdict so far; None for no limit. The declared
        model is fitted in any case, and a fit or a compilation that has begun is ended.

    Raises
    ------
    InputRefusedError
        A number is out of range, an entry of the catalogue is not a class of effects, or two have the same
        name.
    """

    __repr__ = brief_repr

    max_effects: int = 3
    max_parameters: int | None = None
    level: float = 0.05
    n_bootstrap: int = 2000
    seed: int = 20260
    fit: FitOptions = FitOptions(profile="none")
    catalogue: tuple[type[Effect], ...] = CATALOGUE
    policy: SearchPolicy = DEFAULT_POLICY
    time_limit_s: float | None = None

    def __post_init__(self):
        require_integer("max_effects", self.max_effects, 0)
        if self.max_parameters is not None:
            require_integer("max_parameters", self.max_parameters, 1)
        if self.time_limit_s is not None:
            require_number("time_limit_s", self.time_limit_s)
            if not self.time_limit_s > 0:
                raise InputRefusedError(f"time_limit_s is {shown(self.time_limit_s)}; it must be positive.")
        require_kind("fit", self.fit, FitOptions)
        require_kind("policy", self.policy, SearchPolicy)
        _ = self.screen  # Rejected before the fit, not after it.
        for effect in self.catalogue:
            if not (isinstance(effect, type) and issubclass(effect, Effect)):
                raise InputRefusedError(f"catalogue has the entry {effect!r}; it takes classes of effects.")
            effect.require_methods()
        names = [effect.name for effect in self.catalogue]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputRefusedError(f"catalogue has two effects named '{min(twice)}'; names must be unique.")
        if self.fit.objective != "chi_square" or self.fit.method != "gradient":
            raise InputRefusedError("fit: a diagnosis requires method 'gradient' and objective 'chi_square'.")

    @property
    def screen(self) -> ScreenOptions:
        """Options of the screen."""
        return ScreenOptions(self.n_bootstrap, self.level, self.seed)
