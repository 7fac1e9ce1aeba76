"""What an effect is: a change of the model from above, with a strength that is zero at the declared model."""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jaxink.effects.scene import Field, Scene
from jaxink.sample import Layer, Parameter, Sample
from jaxink.solver.config import SolverConfig


@dataclasses.dataclass(frozen=True)
class Case:
    """What an effect may look at before it says how it would change the model.

    Parameters
    ----------
    sample
        As declared, effects that were found before included.
    scene
        Where the points of the measurement lie.
    noise
        Least relative standard deviation of a point.
    accuracy
        Largest relative error that the discretisation may cause.
    """

    sample: Sample
    scene: Scene
    noise: float = 0.0
    accuracy: float = np.inf

    @property
    def inks(self) -> tuple[Layer, ...]:
        """The scattering layers."""
        return tuple(layer for layer in self.sample.layers if layer.scatters)

    @property
    def plates(self) -> tuple[Layer, ...]:
        """The clear layers."""
        return tuple(layer for layer in self.sample.layers if not layer.scatters)

    @property
    def is_opaque(self) -> bool:
        """Whether nothing comes out behind the sample."""
        return self.sample.layers[-1].opaque

    def declared(self, name: str) -> float:
        """Value of a parameter of the sample."""
        return float(self.sample.parameters.values_with({})[name])

    def each(self, name: str) -> tuple[str, ...]:
        """Full names of a quantity: itself, one for each wavelength, or none."""
        return tuple(n for n in self.sample.parameters if n.split("@")[0] == name)


@dataclasses.dataclass(frozen=True)
class Effect:
    """Something that a model may lack.

    An effect of your own is a subclass with a ``name``, ``terms`` and a `change`; see docs/diagnosis.md.
    Everything that it computes may be traced by JAX.

    Attributes
    ----------
    name
        Its identifier.
    sign
        1 where the strength cannot be negative, 0 where it can be either.
    statement
        What is the case where it is present.
    group
        ``instrument``, ``surface``, ``volume``, ``geometry``, ``waves``, ``constant`` or ``numerics``.
    keys
        Effects of the simulated measurements that are meant by it, such as ``E6``.
    terms
        Its parameters: the strength first, whose value is that of the declared model, then those that have
        no meaning while the strength is zero.
    settings
        Values of parameters by name at which the screen looks at it, one set after the other. Where they
        hold the strength, the screen takes the difference between the model there and the declared one for
        its direction (a share of the area that is like that), otherwise the derivative at zero.
    own_program
        Whether it changes the structure of the model, so that a program of its own is compiled for it.
    needs_field
        Whether its `change` looks at the field around the points.
    is_scalable
        Whether what a setting does grows with its strength, so that a screen may scale it; of a share of the
        area it always does.
    splits
        Whether it divides a layer into several: it then acts after all others, which know the layer as one.
    usual
        Strength of usual size; an effect whose detection limit lies beyond it is hardly testable.
    """

    name: ClassVar[str]
    sign: ClassVar[int] = 1
    statement: ClassVar[str] = ""
    group: ClassVar[str] = "instrument"
    keys: ClassVar[tuple[str, ...]] = ()
    own_program: ClassVar[bool] = False
    needs_field: ClassVar[bool] = False
    is_scalable: ClassVar[bool] = False
    splits: ClassVar[bool] = False
    usual: ClassVar[float] = np.inf

    @classmethod
    def forms(cls, case: Case) -> "tuple[Effect, ...] | str":
        """The ways in which it may be present in a case, or the sentence why these data cannot tell."""
        del case
        return (cls(),)

    @property
    def terms(self) -> tuple[Parameter, ...]:
        """See the class."""
        raise NotImplementedError

    @property
    def settings(self) -> tuple[dict[str, float], ...]:
        """See the class."""
        return ({},)

    @property
    def strength(self) -> Parameter:
        """The first term."""
        return self.terms[0]

    @property
    def neutral(self) -> float:
        """Value of the first term at the declared model."""
        return self.strength.value

    @property
    def carrier(self) -> "Effect":
        """The form by which a model computes it: another one where it is a special case of that."""
        return self

    @property
    def is_screened(self) -> bool:
        """Whether the screen looks at this form; where one is, refits try the others too."""
        return True

    @property
    def program(self) -> str:
        """Effects of one name here share their own program."""
        return str(self)

    @property
    def shares_program(self) -> bool:
        """Whether the screen can do with the declared structure at other values: mixtures of areas can."""
        return type(self).mixture is not Effect.mixture

    @property
    def scales(self) -> bool:
        """Whether a screen may scale what a setting does."""
        return self.is_scalable or self.shares_program or type(self).other is not Effect.other

    def largest_share(self, setting: Mapping[str, float]) -> float:
        """Largest strength in units of what a setting's own strength does."""
        here = setting.get(self.strength.name)
        if here is None:
            return self.strength.maximum - self.neutral
        return abs((self.strength.maximum - self.neutral) / (here - self.neutral)) if self.scales else 1.0

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

    def extend(self, sample: Sample) -> Sample:
        """The sample with the effect's parameters, at a strength of zero the same as without them."""
        new = [
            dataclasses.replace(t, free=False, prior=None)
            for t in self.terms
            if t.name not in sample.parameters
        ]
        return with_parameters(sample, *new) if new else sample

    def other(self, sample: Sample) -> Sample | None:
        """Sample of which a share of the area consists, the strength being that share; None: none."""
        del sample
        return None

    def refined(self, config: SolverConfig) -> SolverConfig:
        """Sizes of the discretisation of that other sample."""
        return config

    def mixture(self, values: Mapping[str, Any]) -> list[tuple[Any, dict[str, Any]]]:
        """Shares of the area where other values hold: (share, these values) of each."""
        del values
        return []

    def change(self, predicted, values: Mapping[str, Any], field: Field):
        """Prediction at the points as the instrument sees it.

        Parameters
        ----------
        predicted
            With the effects that come before it, 1/sr.
        values
            By name.
        field
            The BSDF around the points, by the sample alone.

        Returns
        -------
        Float[Array, " points"]
        """
        del values, field
        return predicted


def with_parameters(sample: Sample, *new: Parameter) -> Sample:
    """The sample with further parameters, or with others in the place of those of the same name."""
    from jaxink.sample import ParameterTable

    table = dict(sample.parameters) | {p.name: p for p in new}
    return dataclasses.replace(sample, parameters=ParameterTable(list(table.values())))


def with_layer(sample: Sample, position: int, layer: Layer, *new: Parameter) -> Sample:
    """The sample with a further layer at a position of its own."""
    layers = (*sample.layers[:position], layer, *sample.layers[position:])
    return with_parameters(dataclasses.replace(sample, layers=layers), *new)


def freed(sample: Sample, name: str, minimum: float, maximum: float) -> Parameter:
    """A fixed parameter as the term of an effect: its range, and its declared value."""
    declared = sample.parameters[name]
    scale = "linear"
    return dataclasses.replace(
        declared,
        value=float(sample.parameters.values_with({})[name]),
        free=True,
        minimum=minimum,
        maximum=maximum,
        tie=None,
        prior=None,
        scale=scale,
    )
