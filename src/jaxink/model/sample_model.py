"""What the models of a sample have in common: its stacks at every wavelength, solved at one resolution."""

import dataclasses
from collections.abc import Collection, Mapping
from typing import TypeVar

import equinox as eqx
from jaxtyping import Array

from jaxink.display.brief import brief_repr
from jaxink.model.build import StackBuilder
from jaxink.model.tables import Table, index_tables, tabulated_interface
from jaxink.model.volume import LayerCoefficients
from jaxink.numerics.precision import require_float64
from jaxink.sample import Sample
from jaxink.solver import ChannelPlan, SolverConfig, Stack

ModelT = TypeVar("ModelT", bound="SampleModel")


class SampleModel(eqx.Module):
    """Stacks of a sample, from which its models predict what instruments read.

    Parameters
    ----------
    builder
        Builds the stacks.
    plan
        Their channels.
    config
        Resolution of the solver.
    rough_tables
        Table of each rough interface that is computed beforehand; None for the others.
    """

    __repr__ = brief_repr
    # By identity: arrays have no hash, and `jax.jit(model.bsdf)` needs that of the method's model.
    __hash__ = object.__hash__

    builder: StackBuilder
    plan: ChannelPlan
    config: SolverConfig = eqx.field(static=True)
    rough_tables: tuple[Table | None, ...]

    @property
    def sample(self) -> Sample:
        """The sample."""
        return self.builder.sample

    @property
    def wavelengths_nm(self) -> tuple[float, ...]:
        """Wavelengths of what is predicted, ascending."""
        return self.builder.wavelengths_nm

    def tabulated(self: ModelT) -> ModelT:
        """The model for thousands of evaluations: rough faces beside a free refractive index are tabulated.

        The model itself if there are none, or if several indices are free.
        """
        tables = index_tables(self.builder, self.plan, self.config)
        if not any(tables):
            return self
        return eqx.tree_at(lambda m: m.rough_tables, self, tables, is_leaf=lambda leaf: leaf is None)

    def own_wavelengths(self, names: Collection[str]) -> dict[str, float]:
        """Wavelength of each of some parameters that affect no other one.

        Parameters
        ----------
        names
            Names of parameters.
        """
        return self.sample.own_wavelengths(names, self.wavelengths_nm)

    def coefficients(self, free_values: Mapping | None = None) -> dict[str, LayerCoefficients]:
        """Scattering and absorption of each scattering layer, at every wavelength.

        Parameters
        ----------
        free_values
            Values by name, in place of those of the sample's table.

        Returns
        -------
        dict[str, LayerCoefficients]
            By layer name; entries of shape ``(wavelengths,)``.
        """
        require_float64()
        return self.builder.coefficients(self.builder.values(free_values))

    def solvable(
        self, wavelength_nm: float | Array, values: Mapping, tables: tuple[Table | None, ...]
    ) -> tuple[Stack, ChannelPlan]:
        """Stack at one wavelength, and its channels with the rough interfaces that are tabulated.

        Parameters
        ----------
        wavelength_nm
            The wavelength.
        values, tables
            Results of `StackBuilder.values` and ``rough_tables`` there.
        """
        stack = self.builder.stack(values, wavelength_nm)
        tabulated = {
            k: tabulated_interface(table, face, values)
            for k, (table, face) in enumerate(zip(tables, self.builder.faces, strict=True))
            if table is not None and face is not None
        }
        return stack, dataclasses.replace(self.plan, interfaces=tabulated)
