"""What an effect is, and the kinds of effects: something that a model may lack, with a strength.

A method has one implementation: it is abstract, or nothing overrides it. Only the defaults of `forms`,
`settings`, `carrier` and `is_screened` may be replaced, once. A class with a ``name`` has no subclasses.
"""

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from jaxtyping import Array, Float

from jaxink.effects.case import Case
from jaxink.effects.scene import Field, Surroundings
from jaxink.errors import InputRefusedError
from jaxink.sample import Parameter, Sample
from jaxink.solver.config import SolverConfig


@dataclasses.dataclass(frozen=True)
class Effect(abc.ABC):
    """Something that a model may lack.

    An effect of your own derives from one of the kinds below, with a ``name``, a ``statement``, ``terms`` and
    the method of its kind; see docs/diagnosis.md. Everything that it computes may be traced by JAX.

    Attributes
    ----------
    name
        Its identifier.
    statement
        What is the case if it is present.
    group
        ``instrument``, ``surface``, ``volume``, ``geometry``, ``waves``, ``constant`` or ``numerics``.
    sign
        1 if the strength cannot be negative, 0 if it can have either sign.
    usual
        A usual strength; an effect whose detection limit is larger is hardly testable.
    scales
        Whether what a setting does grows with its strength, so that a screen may scale it.
    """

    name: ClassVar[str]
    statement: ClassVar[str] = ""
    group: ClassVar[str]
    sign: ClassVar[int] = 1
    usual: ClassVar[float] = np.inf
    scales: ClassVar[bool] = False

    @classmethod
    def forms(cls, case: Case) -> "tuple[Effect, ...] | str":
        """The ways in which it may be present in a case, or the sentence why these data cannot tell."""
        del case
        if missing := sorted(cls.__abstractmethods__):
            raise InputRefusedError(
                f"the effect '{cls.name}' has no {' and no '.join(missing)}: it must derive from one of the "
                "kinds in jaxink.effects, such as ReadingEffect, and have the method of its kind."
            )
        return (cls(),)

    @property
    @abc.abstractmethod
    def terms(self) -> tuple[Parameter, ...]:
        """Its parameters.

        The strength comes first, its value is that of the declared model; the others have no meaning while
        the strength is zero.
        """

    @property
    @abc.abstractmethod
    def program(self) -> str | None:
        """Effects of one name share a compiled program; None: they share that of the declared structure."""

    @property
    def settings(self) -> tuple[dict[str, float], ...]:
        """Values of parameters by name at which the screen looks at it, one set after the other.

        If a set includes the strength, the screen takes the difference between the model there and the
        declared one as the direction of the effect, otherwise the derivative at zero.
        """
        return ({},)

    @property
    def carrier(self) -> "Effect":
        """The form by which a model computes it: another one if it is a special case of that."""
        return self

    @property
    def is_screened(self) -> bool:
        """Whether the screen looks at this form; if it looks at another one, refits try this one too."""
        return True

    @property
    @final
    def own_program(self) -> bool:
        """Whether it is computed by another program than the declared structure."""
        return self.program is not None

    @property
    @final
    def strength(self) -> Parameter:
        """The first term."""
        return self.terms[0]

    @property
    @final
    def neutral(self) -> float:
        """Value of the first term at the declared model."""
        return self.strength.value

    @final
    def largest_share(self, setting: Mapping[str, float]) -> float:
        """Largest strength in units of what a setting's own strength does."""
        here = setting.get(self.strength.name)
        if here is None:
            return self.strength.maximum - self.neutral
        return abs((self.strength.maximum - self.neutral) / (here - self.neutral)) if self.scales else 1.0

    @final
    def start(self, setting: Mapping[str, float], step: float) -> dict[str, float]:
        """Where a refit starts, for a step of the screen in the direction of a setting."""
        here = setting.get(self.strength.name)
        low, high = self.strength.minimum, self.strength.maximum
        if here is not None and not self.scales:
            return {self.strength.name: here}
        unit = 1.0 if here is None else here - self.neutral
        reach = high - low
        inside = max(low, min(high, self.neutral + step * unit))
        # Off the bound, so that what the strength multiplies has a slope.
        if self.sign == 1:
            inside = max(inside, min(self.neutral + 0.02 * reach, high))
        return {self.strength.name: inside}


class SampleEffect(Effect):
    """The sample is not the declared one.

    Unless it ``scales``, a setting with a strength stands for a share of the area that is like the setting.

    Attributes
    ----------
    changes_structure
        Whether layers, faces or optical channels change and not values alone: it needs its own program.
    shared_program
        Name of a program that several such effects share; empty: one for each form.
    """

    group: ClassVar[str] = "volume"
    changes_structure: ClassVar[bool] = False
    shared_program: ClassVar[str] = ""

    @property
    @final
    def program(self) -> str | None:
        """Its own where the structure changes."""
        return (self.shared_program or str(self)) if self.changes_structure else None

    @abc.abstractmethod
    def extend(self, sample: Sample) -> Sample:
        """The sample with the effect's terms, at a strength of zero the same as without them."""


class DividingEffect(SampleEffect):
    """It divides a layer into several: it acts after all others, which know the layer as one."""


class AreaWithOtherSample(Effect):
    """A share of the area consists of another sample; the strength is that share."""

    group: ClassVar[str] = "geometry"
    scales: ClassVar[bool] = True

    @property
    @final
    def program(self) -> str:
        """Its own."""
        return str(self)

    @abc.abstractmethod
    def other(self, sample: Sample) -> Sample:
        """The other sample."""


class AreaWithOtherValues(Effect):
    """Shares of the area have other values of the sample's parameters; a screen needs no further program."""

    group: ClassVar[str] = "geometry"
    scales: ClassVar[bool] = True
    program: ClassVar[str] = "areas with other values"

    @abc.abstractmethod
    def mixture(self, values: Mapping[str, Any]) -> list[tuple[Any, dict[str, Any]]]:
        """For each area its share and the values that differ there; a share is of what later ones leave."""


class ReadingEffect(Effect):
    """The BSDF is that of the declared sample, the readings of the instrument are others.

    Attributes
    ----------
    looks_at
        What `change` needs to know beside the BSDF at the points.
    """

    group: ClassVar[str] = "instrument"
    looks_at: ClassVar[Surroundings] = Surroundings.NOTHING
    program: ClassVar[None] = None

    @abc.abstractmethod
    def change(
        self, predicted: Float[Array, " points"], values: Mapping[str, Any], field: Field
    ) -> Float[Array, " points"]:
        """Prediction at the points as the instrument reads it.

        Parameters
        ----------
        predicted
            With the effects that come before it, 1/sr.
        values
            Of all parameters, by name.
        field
            The BSDF around the points, of the sample itself.
        """


class FinerDiscretisation(Effect):
    """The solver's discretisation is too coarse; the strength is the share of the step to a finer one."""

    group: ClassVar[str] = "numerics"
    scales: ClassVar[bool] = True

    @property
    @final
    def program(self) -> str:
        """Its own."""
        return str(self)

    @abc.abstractmethod
    def refined(self, config: SolverConfig) -> SolverConfig:
        """The finer resolution."""
