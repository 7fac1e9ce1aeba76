"""The forward model: predicted BSDF at the measured directions from the parameters of a sample."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.model.build import StackBuilder, media_of, stack_builder, structure_of
from jaxink.model.checks import require_predictable
from jaxink.model.depth_profiles import DepthProfiles, at_pairs, profiles_at
from jaxink.model.instrument import Cones
from jaxink.model.points import PredictedPoints, points_of
from jaxink.model.resolution import model_sizes
from jaxink.model.sample_model import SampleModel
from jaxink.model.tables import rough_tables
from jaxink.numerics.batches import at_each
from jaxink.numerics.precision import computing, require_float64
from jaxink.optics import Directions
from jaxink.sample import Sample
from jaxink.solver import (
    DEFAULT_ACCURACY,
    N_FREQUENCIES,
    SolverConfig,
    Stack,
    diffuse_bsdf,
    plan_media,
    polarised_excess,
    regular_power,
)

_KNOWN = ("mie", "rayleigh")


class ForwardModel(SampleModel):
    """Predicts the BSDF of a sample at the points of a measurement.

    Parameters
    ----------
    sample
        The sample.
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        Columns of the measurement, shape ``(points,)``.
    config
        Resolution; by default that of `sizes` for the accuracy, at the values of the sample's table.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.
    layer_method
        See `SolverConfig`.

    Raises
    ------
    InputRefusedError
        If the columns differ in length, a polar angle is not between 0 and 90 degrees, the sample cannot be
        predicted, or it declares effects, which `jaxink.forward_model` applies.
    """

    points: PredictedPoints

    def __init__(
        self,
        sample: Sample,
        theta_i_deg,
        theta_o_deg,
        phi_deg,
        wavelength_nm,
        is_transmission,
        config: SolverConfig | None = None,
        accuracy: float = DEFAULT_ACCURACY,
        layer_method: str = "fastest",
    ):
        cones = Cones(sample.source_half_angle_deg, sample.detector_half_angle_deg)
        points = points_of(cones, theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission)
        require_predictable(sample, points)
        media = media_of(sample, points)
        plan = plan_media(*media, has_backing=sample.backing is not None)
        builder = stack_builder(sample, points.wavelengths_nm, media)
        if config is None:
            config = model_sizes(builder, plan, {}, accuracy, layer_method)
        self.points, self.builder, self.plan, self.config = points, builder, plan, config
        self.rough_tables = rough_tables(builder, plan, config)

    @property
    def wavelength_of_point_nm(self) -> Float[np.ndarray, " points"]:
        """Wavelength of each point."""
        return np.array(self.wavelengths_nm)[self.points.wavelength_of_point]

    @property
    def n_stacks(self) -> int:
        """Number of stacks that one prediction solves, which takes most of its time."""
        each = 1 if self.sample.beam_diameter_mm is None else N_FREQUENCIES
        return each * len(self.wavelengths_nm)

    def sizes(
        self, free_values: Mapping, accuracy: float = DEFAULT_ACCURACY, layer_method: str = "fastest"
    ) -> SolverConfig:
        """Resolution that keeps the BSDF within an accuracy at every wavelength.

        Parameters
        ----------
        free_values
            Known values by name, in place of those of the sample's table.
        accuracy, layer_method
            See `choose_sizes`.
        """
        return model_sizes(self.builder, self.plan, free_values, accuracy, layer_method)

    def bsdf(self, free_values: Mapping | None = None) -> Float[Array, " points"]:
        """Predicted BSDF at the points.

        Parameters
        ----------
        free_values
            Values by name, in place of those of the sample's table; the BSDF is differentiable in each.

        Returns
        -------
        Float[Array, " points"]
            In 1/sr, averaged over the cones of the instrument.

        Raises
        ------
        PrecisionError
            If JAX uses 32 bits.
        """
        require_float64()
        rays, directions = self.points.rays, self.points.rays.directions

        def at_wavelength(wavelength_nm, values, tables):
            stack, plan = self.solvable(wavelength_nm, values, tables)
            diffuse = rays.average(diffuse_bsdf(stack, directions, self.config, plan))
            if self.points.cones.is_ideal:
                return diffuse
            return diffuse + self._regular_peak(stack) * rays.regular_share

        return self._at_points(at_wavelength, free_values, self.rough_tables)

    def regular(self, free_values: Mapping | None = None) -> Float[Array, " points"]:
        """Power of the regular peak on the side of each point, at its angle of incidence.

        Parameters
        ----------
        free_values
            See `bsdf`.

        Returns
        -------
        Float[Array, " points"]
            Share of the incident power.
        """
        require_float64()

        def at_wavelength(wavelength_nm, values):
            return self._regular_peak(self.builder.stack(values, wavelength_nm))

        return self._at_points(at_wavelength, free_values)

    def polarised_excess(self, free_values: Mapping | None = None) -> Float[Array, " points"]:
        """BSDF of polarised light minus that of the scalar theory at the points, to second order.

        Parameters
        ----------
        free_values
            See `bsdf`.

        Returns
        -------
        Float[Array, " points"]
            In 1/sr, averaged over the cones of the instrument; see `jaxink.solver.two_orders`.
        """
        require_float64()
        rays = self.points.rays

        def at_wavelength(wavelength_nm, values):
            return rays.average(excess_at(self.builder, values, wavelength_nm, rays.directions))

        return self._at_points(at_wavelength, free_values)

    def depth_profiles(self, layers: tuple[int, ...], free_values: Mapping | None = None) -> DepthProfiles:
        """Light absorbed and emitted at each depth of some layers, at every wavelength.

        Parameters
        ----------
        layers
            Positions of the layers, of known thickness.
        free_values
            See `bsdf`.
        """
        require_float64()
        directions = self.points.rays.directions

        def at_wavelength(wavelength_nm, values, tables):
            stack, plan = self.solvable(wavelength_nm, values, tables)
            of_sample = self.builder, values, wavelength_nm
            return profiles_at(stack, plan, self.config, *of_sample, directions, layers)

        wavelengths, values = jnp.asarray(self.wavelengths_nm), self.builder.values(free_values)
        return at_each(at_wavelength, wavelengths, values, self.rough_tables)

    def emitted_at_points(
        self, bsdf: Float[Array, "wavelengths sides incidences outgoing"]
    ) -> Float[Array, " points"]:
        """BSDF at the points from that in all directions of `depth_profiles`, averaged over the cones."""
        spectrum = jax.vmap(self.points.rays.average)(at_pairs(bsdf, self.points.rays.directions))
        return spectrum[self.points.wavelength_of_point, self.points.pair_of_point]

    def _at_points(
        self, at_wavelength, free_values: Mapping | None, *by_wavelength
    ) -> Float[Array, " points"]:
        """Evaluate a function of wavelength, values and more for all pairs and select the points."""
        wavelengths, values = jnp.asarray(self.wavelengths_nm), self.builder.values(free_values)
        spectrum = at_each(at_wavelength, wavelengths, values, *by_wavelength)
        return spectrum[self.points.wavelength_of_point, self.points.pair_of_point]

    def _regular_peak(self, stack: Stack) -> Float[Array, " pairs"]:
        """Power of the regular peak on the side of each point, averaged over the cones."""
        directions = self.points.rays.directions
        reflected, transmitted = regular_power(stack, directions.sin_incidence)
        there = directions.incidence
        peak = jnp.where(directions.is_transmission, transmitted[there], reflected[there])
        return self.points.rays.average(peak)


@runtime_checkable
class PredictsBsdf(Protocol):
    """A forward model, possibly with effects."""

    @property
    def sample(self) -> Sample:
        """The sample, with the parameters of its effects."""

    def bsdf(self, free_values: Mapping | None = None) -> Float[Array, " points"]:
        """BSDF at its points, at some values by name in place of those of the sample's table."""


@eqx.filter_jit
def _compiled_bsdf(model: PredictsBsdf, values):
    return model.bsdf(values)


def evaluate(model: PredictsBsdf) -> np.ndarray:
    """BSDF of a model at the values of its sample's table, in 64 bits whatever JAX's setting.

    Returns
    -------
    np.ndarray
        In 1/sr, shape ``(points,)``.
    """
    with computing():
        values = {name: jnp.asarray(value, float) for name, value in model.sample.parameters.untied.items()}
        # One program serves all samples of a structure.
        return np.asarray(_compiled_bsdf(structure_of(model, frozenset(values)), values))


def why_not_polarised(sample: Sample) -> str:
    """Why it is not known how a sample polarises light; empty if it is."""
    unknown = [layer.name for layer in sample.layers if layer.scatters and layer.phase_function not in _KNOWN]
    if not unknown:
        return ""
    return f"the phase function of '{unknown[0]}' says nothing of polarisation; Mie and Rayleigh particles do"


def excess_at(
    builder: StackBuilder, values: Mapping, wavelength_nm, directions: Directions
) -> Float[Array, " pairs"]:
    """Polarised minus scalar BSDF at one wavelength, 1/sr; rough interfaces count as smooth."""
    stack = builder.stack(values, wavelength_nm)
    return polarised_excess(stack, builder.scattering_matrices(values, wavelength_nm), directions)
