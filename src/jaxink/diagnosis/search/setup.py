"""What all stages of a search share: sample, measurement, catalogue and thresholds."""

import dataclasses
from collections.abc import Collection

import numpy as np

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.search.allowance import Allowance
from jaxink.diagnosis.search.pieces import Pieces
from jaxink.diagnosis.search.workbench import Workbench
from jaxink.diagnosis.statistics.screen_options import ScreenOptions
from jaxink.effects import Case, Effect, Listed, Scene, declared_effects, effects_for, extend, undivided
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.failures import Failures
from jaxink.numerics.progress import Progress, log_progress
from jaxink.sample import Sample
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.config import SolverConfig

# Slots beyond those of the declared sample's free parameters, so that all stages share a program.
_FURTHER_SLOTS = 6
# What failed if an effect spoils the model that it is added to.
MODEL = "the model with {}"


@dataclasses.dataclass(frozen=True)
class Setup:
    """What all stages share: sample, measurement and resolution, classes of effects, and thresholds.

    `options` are those of the screen; `accuracy` is the largest relative error of the discretisation;
    `allowance` is the time for all of them; `failures` takes note of what fails; `follow` is called with
    task, step and chi-square; `pieces` keeps what is finished; `rivals` are other minima of the declared
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
    allowance: Allowance = dataclasses.field(default_factory=Allowance)
    failures: Failures = dataclasses.field(default_factory=Failures)
    follow: Progress = log_progress
    pieces: Pieces = dataclasses.field(default_factory=Pieces)
    rivals: tuple[dict[str, float], ...] = ()

    def without_candidates(self) -> "Setup":
        """The same without any effect to look for."""
        return self.with_candidates(())

    def with_candidates(self, names: Collection[str]) -> "Setup":
        """The same with only some of the effects to look for."""
        return dataclasses.replace(self, catalogue=tuple(c for c in self.catalogue if c.name in names))

    def bench(self, effects: tuple[Effect, ...], n_slots: int, added_at_once: int = 1) -> Workbench:
        """A workbench of the sample with some effects."""
        arguments = self.sample, effects, self.data, self.noise, self.config, self.scene, n_slots
        return Workbench(*arguments, self.pieces, added_at_once)

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

    def shared_bench(self, accepted: tuple[Effect, ...], listed: Listed) -> Workbench:
        """The workbench of all effects that do not need a program of their own."""
        inside = tuple(e for e in listed.forms if not e.own_program)
        n_accepted = sum(len(e.terms) for e in accepted)
        most = max((len(e.terms) for e in inside), default=1)
        n_slots = len(self.sample.parameters.free) + max(_FURTHER_SLOTS, n_accepted + most)
        return self.bench(accepted + inside, n_slots)
