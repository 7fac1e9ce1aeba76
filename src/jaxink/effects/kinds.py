"""The kinds of effects: something that a model may lack, with a strength.

A method is implemented once: it is abstract, or it is not overridden. Only the defaults of `forms`,
`settings`, `carrier`, `is_screened`, `changes_structure`, `of_sample`, `form` and `settled` may be replaced,
once. A class with a ``name`` has no subclasses.
"""

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, final

import numpy as np
from jaxtyping import Array, Bool, Float

from jaxink.effects.case import Case
from jaxink.effects.plane import PlaneSample
from jaxink.effects.scene import Field, Scene, Surroundings
from jaxink.errors import InputRefusedError
from jaxink.model import ForwardModel
from jaxink.sample import Parameter, Sample
from jaxink.solver import SolverConfig


class Inapplicable(str):
    """Reason why an effect cannot be in a case, which lies in the sample and not in what was measured."""

    __slots__ = ()


@dataclasses.dataclass(frozen=True)
class Effect(abc.ABC):
    """Something that a model may lack.

    To define an effect, derive from one of the kinds below, with a ``name``, a ``statement``, ``terms`` and
    the method of the kind; see docs/manual/diagnosis.md. All computations must be traceable by JAX.

    Attributes
    ----------
    name
        Its identifier.
    statement
        What is true if it is present.
    numbered
        The same with its numbers, each in braces by the last part of its parameter's name, with a % for a
        share in per cent: ``{share%} of the area has no ink``; empty: the statement, then all numbers.
    group
        ``instrument``, ``surface``, ``volume``, ``geometry``, ``wave optics``, ``constant`` or ``numerics``.
    may_be_negative
        Whether the strength can have either sign.
    usual
        Usual strength; an effect whose detection limit is larger is hardly testable.
    scales
        Whether the change that a setting causes grows with its strength, so that a screen may scale it.
    changes_particles
        Whether it changes how particles scatter, so that its best size of particles may be quite another one.
    handicap
        By how much more than another effect it must lower chi-square, as it fits whatever is left.
    """

    name: ClassVar[str]
    statement: ClassVar[str] = ""
    numbered: ClassVar[str] = ""
    group: ClassVar[str]
    may_be_negative: ClassVar[bool] = False
    usual: ClassVar[float] = np.inf
    scales: ClassVar[bool] = False
    changes_particles: ClassVar[bool] = False
    handicap: ClassVar[float] = 0.0

    @classmethod
    def forms(cls, case: Case) -> "tuple[Effect, ...] | str":
        """The forms in which it may be present in a case, or a sentence why these data cannot test for it."""
        del case
        cls.require_methods()
        return (cls(),)

    @classmethod
    @final
    def require_methods(cls) -> None:
        """Raise `InputRefusedError` unless the class has all methods of its kind."""
        if missing := sorted(cls.__abstractmethods__):
            raise InputRefusedError(
                f"the effect '{cls.name}' has no {' and no '.join(missing)}: it must derive from one of the "
                "kinds in jaxink.effects, such as ReadingEffect, and have the method of its kind."
            )

    @classmethod
    def of_sample(cls, sample: Sample, **form: Any) -> "Effect":
        """The effect as a sample file declares it.

        Parameters
        ----------
        sample
            The sample; what the form does not say follows from it.
        **form
            Keys of the file that are no parameters.
        """
        del sample
        return cls(**form)

    @property
    def form(self) -> dict[str, Any]:
        """What `of_sample` needs to construct this form."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.init}

    def settled(self, scene: Scene, measured: Float[np.ndarray, " points"]) -> "Effect":
        """The effect with what it would otherwise take from the points that are predicted.

        Parameters
        ----------
        scene
            The points of a fit.
        measured
            BSDF there, 1/sr.
        """
        del scene, measured
        return self

    @property
    @abc.abstractmethod
    def terms(self) -> tuple[Parameter, ...]:
        """Its parameters.

        The first is the strength, and its value is that of the declared model; the others have no effect
        while the strength is zero.
        """

    @property
    @abc.abstractmethod
    def program(self) -> str | None:
        """Name of a compiled program that effects share; None for the program of the declared structure."""

    @property
    def settings(self) -> tuple[dict[str, float], ...]:
        """Sets of parameter values, by name, at which the screen evaluates it.

        If a set includes the strength, the direction of the effect is the difference between the model there
        and the declared one, otherwise the derivative at zero.
        """
        return ({},)

    @property
    def carrier(self) -> "Effect":
        """The form that computes it, if it is a special case of another one."""
        return self

    @property
    def is_screened(self) -> bool:
        """Whether the screen evaluates this form; refits also try the other forms of a screened effect."""
        return True

    @property
    @final
    def own_program(self) -> bool:
        """Whether it needs another program than the declared structure."""
        return self.program is not None

    @property
    @final
    def strength(self) -> Parameter:
        """The first term."""
        return self.terms[0]

    @property
    @final
    def neutral(self) -> float:
        """Value of the first term in the declared model."""
        return self.strength.value

    @final
    def largest_share(self, setting: Mapping[str, float]) -> float:
        """Largest strength, in units of the strength of a setting."""
        here = setting.get(self.strength.name)
        if here is None:
            return self.strength.maximum - self.neutral
        return abs((self.strength.maximum - self.neutral) / (here - self.neutral)) if self.scales else 1.0

    @final
    def start(self, setting: Mapping[str, float], step: float) -> dict[str, float]:
        """Start of a refit, for a step of the screen in the direction of a setting."""
        here = setting.get(self.strength.name)
        low, high = self.strength.minimum, self.strength.maximum
        if here is not None and not self.scales:
            return {self.strength.name: here}
        unit = 1.0 if here is None else here - self.neutral
        reach = high - low
        inside = max(low, min(high, self.neutral + step * unit))
        # Off the bound, so that parameters multiplied by the strength have a slope.
        if not self.may_be_negative:
            inside = max(inside, min(self.neutral + 0.02 * reach, high))
        return {self.strength.name: inside}


class SampleEffect(Effect):
    """The sample differs from the declared one.

    Unless the effect ``scales``, a setting with a strength stands for a share of the area with that setting.

    Attributes
    ----------
    shared_program
        Name of a program that several such effects share; if empty, each form has its own.
    """

    group: ClassVar[str] = "volume"
    shared_program: ClassVar[str] = ""

    @property
    def changes_structure(self) -> bool:
        """Whether layers, faces or optical channels change, not only values.

        A separate program is then needed.
        """
        return False

    @property
    @final
    def program(self) -> str | None:
        """Its own if the structure changes."""
        return (self.shared_program or str(self)) if self.changes_structure else None

    @abc.abstractmethod
    def extend(self, sample: Sample) -> Sample:
        """The sample with the effect's terms, equivalent to that without them at a strength of zero."""


class DividingEffect(SampleEffect):
    """Divides a layer into several. It acts after all others, which see the layer undivided."""


class BlendedEffect(Effect):
    """Another model, with a program of its own, is blended in; the strength is its share."""

    scales: ClassVar[bool] = True

    @property
    @final
    def program(self) -> str:
        """Its own program."""
        return str(self)


class AreaWithOtherSample(BlendedEffect):
    """A share of the area is another sample; the strength is that share."""

    group: ClassVar[str] = "geometry"

    @abc.abstractmethod
    def other(self, sample: Sample) -> Sample:
        """The other sample."""


class AreaWithOtherValues(Effect):
    """Shares of the area have other values of the sample's parameters; needs no further program."""

    group: ClassVar[str] = "geometry"
    scales: ClassVar[bool] = True
    program: ClassVar[str] = "areas with other values"

    @abc.abstractmethod
    def mixture(self, values: Mapping[str, Any]) -> list[tuple[Any, dict[str, Any]]]:
        """For each area its share, taken from what later ones leave, and the values that differ there."""


class ReadingEffect(Effect):
    """The BSDF is that of the declared sample, but the readings of the instrument differ.

    Attributes
    ----------
    looks_at
        What `change` needs in addition to the BSDF at the points.
    """

    group: ClassVar[str] = "instrument"
    looks_at: ClassVar[Surroundings] = Surroundings.NOTHING
    program: ClassVar[None] = None

    @abc.abstractmethod
    def change(
        self, predicted: Float[Array, " points"], values: Mapping[str, Any], field: Field
    ) -> Float[Array, " points"]:
        """Prediction at the points as read by the instrument.

        Parameters
        ----------
        predicted
            With the effects that precede it, 1/sr.
        values
            Of all parameters, by name.
        field
            The BSDF of the sample at and around the points.
        """


class ScalingEffect(ReadingEffect):
    """All that an instrument reads on a side, of whatever kind, is wrong by one factor."""

    @abc.abstractmethod
    def factor(
        self, values: Mapping[str, Any], is_transmission: Bool[np.ndarray, " points"]
    ) -> Float[Array, "*points"]:
        """Reading over true value, for all or each of the points.

        Parameters
        ----------
        values
            Of all parameters, by name.
        is_transmission
            Side of each point.
        """

    def change(self, predicted, values, field):
        """Return the factor times f."""
        return predicted * self.factor(values, field.scene.is_transmission)


class Couplings(NamedTuple):
    """How strongly wavelengths are coupled, see `DepthProfiles.emitted`.

    Parameters
    ----------
    absorbed
        Light emitted at the second wavelength over the light absorbed at the first.
    unmeasured_per_mm
        Light emitted at a wavelength over the fluence of light shorter than all wavelengths, per length.
    """

    absorbed: Float[Array, "wavelengths wavelengths"]
    unmeasured_per_mm: Float[Array, " wavelengths"]


class EmittingEffect(Effect):
    """A layer emits light, isotropically and where it absorbed light of another wavelength.

    Attributes
    ----------
    layer
        The layer.
    wavelengths_nm
        Those that take part, ascending, whether points have them or not.
    is_resolved
        Whether the detector resolves wavelengths; otherwise it reads all light at the exciting one.
    """

    layer: str
    wavelengths_nm: tuple[float, ...]
    is_resolved: bool

    scales: ClassVar[bool] = True

    @property
    @final
    def program(self) -> str:
        """One for all forms."""
        return self.name

    @abc.abstractmethod
    def couplings(self, values: Mapping[str, Any]) -> Couplings:
        """Couplings of the wavelengths, from the values of all parameters."""


class AddedLight(Effect):
    """Light that the solver leaves out is added to its BSDF; the strength is the share that is added."""

    scales: ClassVar[bool] = True

    @property
    @final
    def program(self) -> str:
        """Its own program."""
        return str(self)

    @abc.abstractmethod
    def added(self, model: ForwardModel, values: Mapping[str, Any]) -> Float[Array, " points"]:
        """The light at a share of 1, in 1/sr.

        Parameters
        ----------
        model
            Forward model of the sample.
        values
            Of all parameters, by name.
        """


class UnevenSurface(Effect):
    """The surface of the sample is not plane; its BSDF follows from that of the plane sample.

    It needs the plane sample over the hemisphere, hence a program of its own, and acts before the instrument
    reads.
    """

    group: ClassVar[str] = "surface"

    @property
    @final
    def program(self) -> str:
        """Its own program."""
        return str(self)

    @abc.abstractmethod
    def shape(self, plane: PlaneSample, values: Mapping[str, Any]) -> PlaneSample:
        """The sample with its uneven surface, at the same directions.

        Parameters
        ----------
        plane
            BSDF and regular reflectance of the sample.
        values
            Of all parameters, by name.
        """


class FinerDiscretisation(BlendedEffect):
    """The solver's resolution is too low; the strength is the share of the step to a higher one."""

    group: ClassVar[str] = "numerics"

    @abc.abstractmethod
    def refined(self, config: SolverConfig) -> SolverConfig:
        """The higher resolution."""
