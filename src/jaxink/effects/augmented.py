"""A forward model with effects applied to it."""

import dataclasses
import functools
import operator
from collections.abc import Collection, Mapping
from typing import TypeVar, overload

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.effects.carried import CarriedModel
from jaxink.effects.declared import declared_effects, in_order, is_of_catalogue
from jaxink.effects.fluorescence import Emission, emission_of
from jaxink.effects.kinds import (
    AddedLight,
    AreaWithOtherSample,
    AreaWithOtherValues,
    DividingEffect,
    Effect,
    EmittingEffect,
    FinerDiscretisation,
    ReadingEffect,
    SampleEffect,
    UnevenSurface,
)
from jaxink.effects.plane import Hemisphere
from jaxink.effects.sample_edits import with_constants, with_parameters
from jaxink.effects.scene import GRID_DEG, Field, Scene, Surroundings
from jaxink.measurement import Columns, GonioData
from jaxink.model import ForwardModel, SampleModel
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig

Model = TypeVar("Model")


class AugmentedModel(CarriedModel):
    """Predicts the BSDF of a sample with effects: those that it declares, and others.

    Parameters
    ----------
    sample
        The sample; effects extend it.
    effects
        Further effects.
    scene
        Points to predict.
    config
        Resolution of the solver; None: that of `ForwardModel.sizes` for the accuracy.
    accuracy, layer_method
        See `ForwardModel`.
    """

    main: ForwardModel
    others: tuple[tuple[int, ForwardModel], ...]
    effects: tuple[Effect, ...] = eqx.field(static=True)
    scene: Scene
    surroundings: Surroundings = eqx.field(static=True)
    hemisphere: Hemisphere | None
    # Of `main`, and of each of `others`.
    emissions: tuple[tuple[Emission, ...], ...]

    def __init__(
        self,
        sample: Sample,
        effects: tuple[Effect, ...],
        scene: Scene,
        config: SolverConfig | None = None,
        accuracy: float = DEFAULT_ACCURACY,
        layer_method: str = "fastest",
    ):
        effects = carriers(sample, effects)
        # Effects that only change the sample have acted on it; programs do not depend on their forms.
        self.effects = tuple(effect for effect in effects if not isinstance(effect, SampleEffect))
        self.scene = scene
        looked_at = (e.looks_at for e in effects if isinstance(e, ReadingEffect))
        self.surroundings = functools.reduce(operator.or_, looked_at, Surroundings.NOTHING)
        directions = scene.all_directions(self.surroundings)
        self.hemisphere = None
        if any(isinstance(e, UnevenSurface) for e in effects):
            self.hemisphere = Hemisphere.beside(directions, scene.waves)
            both = zip(directions, self.hemisphere.columns, strict=True)
            directions = tuple(np.concatenate(columns) for columns in both)

        dividing = tuple(e for e in effects if isinstance(e, DividingEffect))
        whole = extend(sample, undivided(effects))

        def model(sample, config, at=directions):
            divided = dataclasses.replace(extend(sample, dividing), effects=())
            return ForwardModel(divided, *at, config, accuracy, layer_method)

        def emissions(sample, config):
            emitting = (effect for effect in effects if isinstance(effect, EmittingEffect))
            at = functools.partial(model, sample, config)
            divided = extend(sample, dividing)
            found = (emission_of(e, sample, divided, directions, lambda *c: at(c)) for e in emitting)
            return tuple(emission for emission in found if emission is not None)

        self.main = model(whole, config)
        config = self.main.config
        self.emissions = (emissions(whole, config),)
        others = []
        for i, effect in enumerate(self.effects):
            match effect:
                case AreaWithOtherSample():
                    given = as_declared(sample, effect.other(whole)), config
                case FinerDiscretisation():
                    given = whole, effect.refined(config)
                case _:
                    continue
            others.append((i, model(*given)))
            self.emissions += (emissions(*given),)
        self.others = tuple(others)

    @property
    def wavelength_of_point_nm(self) -> Float[np.ndarray, " points"]:
        """See `ForwardModel`."""
        return self.scene.wavelength_nm

    @property
    def n_stacks(self) -> int:
        """See `ForwardModel`; of all models together."""
        return self.main.n_stacks + sum(model.n_stacks for _, model in self.others)

    def own_wavelengths(self, names: Collection[str]) -> dict[str, float]:
        """See `ForwardModel`; none if an effect mixes wavelengths, or one of a user's own might."""
        if any(self.emissions):
            return {}
        kinds = ReadingEffect | AreaWithOtherValues | UnevenSurface
        mixing = (e for e in self.effects if isinstance(e, kinds))
        if not all(is_of_catalogue(effect) for effect in mixing):
            return {}
        models = (self.main, *(model for _, model in self.others))
        found = [model.own_wavelengths(names) for model in models]
        return {name: wave for name, wave in found[0].items() if all(name in each for each in found)}

    def polarised_excess(self, values: Mapping | None = None) -> Float[Array, " points"]:
        """See `ForwardModel`; of the sample with the effects that change it, not those of its areas."""
        return self.main.polarised_excess(values)[: len(self.scene)]

    def bsdf(self, values: Mapping | None = None) -> Float[Array, " points"]:
        """Predicted BSDF at the points of the scene, 1/sr.

        Parameters
        ----------
        values
            Values by name, in place of those of the sample's table; the BSDF is differentiable in each.
        """
        values = self.sample.parameters.values_with({} if values is None else values)
        everywhere, regular = self._mixed(values)
        if self.hemisphere is not None:
            shaped = self.hemisphere.sample(everywhere, regular)
            for effect in self.effects:
                if isinstance(effect, UnevenSurface):
                    shaped = effect.shape(shaped, values)
            everywhere, regular = shaped.bsdf, shaped.regular
        field = self._field(everywhere, regular[: len(self.scene)])
        predicted = field.points
        for effect in self.effects:
            if isinstance(effect, ReadingEffect):
                predicted = effect.change(predicted, values, field)
        return predicted

    def _mixed(self, values):
        """BSDF in all directions and regular power, averaged over the areas of the sample."""
        added = [effect for effect in self.effects if isinstance(effect, AddedLight)]
        with_regular = Surroundings.PLANES in self.surroundings or self.hemisphere is not None

        def of(model, given, emissions):
            light = [emission.bsdf(given) for emission in emissions]
            light += [given[effect.strength.name] * effect.added(model, given) for effect in added]
            everywhere = sum(light, start=model.bsdf(given))
            return everywhere, model.regular(given) if with_regular else jnp.zeros_like(everywhere)

        mixing = (effect for effect in self.effects if isinstance(effect, AreaWithOtherValues))
        mixed = [part for effect in mixing for part in effect.mixture(values)]
        areas = [values, *({**values, **there} for _, there in mixed)]
        if mixed:
            # Sequentially by one traced model; otherwise a copy for each area would be compiled.
            stacked = {name: jnp.stack([jnp.asarray(v[name], float) for v in areas]) for name in values}
            each = jax.lax.map(lambda here: of(self.main, here, self.emissions[0]), stacked)
            found, *others = (jax.tree.map(lambda a, i=i: a[i], each) for i in range(len(areas)))
            for (share, _), other in zip(mixed, others, strict=True):
                found = _blend(found, other, share)
        else:
            found = of(self.main, values, self.emissions[0])
        for (position, model), emissions in zip(self.others, self.emissions[1:], strict=True):
            share = values[self.effects[position].strength.name]
            found = _blend(found, of(model, values, emissions), share)
        return found

    def _field(self, everywhere, regular) -> Field:
        n, planes = len(self.scene), len(self.scene.plane_columns)
        ends = n + (planes * GRID_DEG.size if Surroundings.PLANES in self.surroundings else 0)
        grid = everywhere[n:ends].reshape(-1, GRID_DEG.size)
        lower = upper = None
        if Surroundings.INCIDENCES in self.surroundings:
            lower, upper = everywhere[ends : ends + n], everywhere[ends + n :]
        return Field(self.scene, everywhere[:n], grid, regular, lower, upper)


def carriers(sample: Sample, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """All effects of a model in the order in which they act: those that a sample declares, and others."""
    ordered = in_order((*declared_effects(sample), *effects))
    return tuple(dict.fromkeys(effect.carrier for effect in ordered))


def forward_model(
    sample: Sample,
    data: GonioData,
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    layer_method: str = "fastest",
) -> ForwardModel | AugmentedModel:
    """Forward model of a sample at every point of a measurement, with the effects that the sample declares.

    Parameters
    ----------
    sample
        The sample.
    data
        Its directions, sides, wavelengths and rows are used.
    config, accuracy, layer_method
        See `ForwardModel`.

    Raises
    ------
    InputRefusedError
        The sample cannot be predicted there, or lacks what an effect needs.
    """
    return model_at(sample, data.directions, data.reading_order, config, accuracy, layer_method)


def model_at(
    sample: Sample,
    directions: Columns,
    row: ArrayLike,
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    layer_method: str = "fastest",
) -> ForwardModel | AugmentedModel:
    """As `forward_model`, for columns as in `GonioData.directions` and the row of each point."""
    if not sample.effects:
        return ForwardModel(sample, *directions, config, accuracy, layer_method)
    return AugmentedModel(sample, (), Scene.of(*directions, row=row), config, accuracy, layer_method)


@overload
def tabulated(model: ForwardModel) -> ForwardModel: ...
@overload
def tabulated(model: Model) -> Model: ...
def tabulated(model):
    """A model for thousands of evaluations, see `ForwardModel.tabulated`; others than jaxink's as they are.

    The same holds for a model with areas of other values, which may be outside the ranges of a fit.
    """
    if isinstance(model, SampleModel):
        return model.tabulated()
    if not isinstance(model, AugmentedModel) or any(
        isinstance(e, AreaWithOtherValues) for e in model.effects
    ):
        return model

    def models(augmented):
        return augmented.main, tuple(other for _, other in augmented.others)

    tables = model.main.tabulated(), tuple(other.tabulated() for _, other in model.others)
    return eqx.tree_at(models, model, tables)


def _blend(first, second, share):
    return tuple((1 - share) * a + share * b for a, b in zip(first, second, strict=True))


def undivided(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Effects without those that divide a layer, which act after all others."""
    return tuple(e for e in effects if not isinstance(e, DividingEffect))


def extend(sample: Sample, effects: tuple[Effect, ...]) -> Sample:
    """The sample with the parameters of all effects, at strength zero; dividing effects come last."""
    declared = sample
    for effect in sorted(effects, key=lambda e: isinstance(e, DividingEffect)):
        if isinstance(effect, SampleEffect):
            sample = effect.extend(sample)
        else:
            sample = with_constants(sample, effect.terms)
        sample = as_declared(declared, sample)
    return sample


def as_declared(declared: Sample, extended: Sample) -> Sample:
    """An extended sample whose declared effects have the values, ranges and ties of their declaration."""
    names = {effect.name for effect in declared.effects}
    given = (p for name, p in declared.parameters.items() if name.split(".")[0] in names)
    return with_parameters(extended, *given) if names else extended
