"""Predicted readings of instruments other than a goniometer, from the parameters of a sample."""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.errors import InputRefusedError
from jaxink.measurement import QUANTITIES, Readings
from jaxink.model.build import media_at, stack_builder
from jaxink.model.checks import require_determined, require_not_negative
from jaxink.model.resolution import model_sizes
from jaxink.model.sample_model import SampleModel
from jaxink.model.tables import rough_tables
from jaxink.model.volume import check_phase_table
from jaxink.numerics.batches import at_each
from jaxink.numerics.precision import require_float64
from jaxink.optics import Directions
from jaxink.sample import Sample
from jaxink.solver import (
    DEFAULT_ACCURACY,
    CollectedLight,
    SolverConfig,
    Stack,
    collected_light,
    plan_media,
    regular_power,
)

# In the order of `_at_wavelength`: of incident light, of light that is seen through, of pairs of directions.
# By reciprocity, diffuse illumination seen at an angle is reflected as light from that angle.
_OF_INCIDENCE = ("R_total", "R_diffuse", "R_specular", "T_total", "T_diffuse", "T_collimated")
_OF_VIEW = ("T_di_8", "T_de_8")
_RECIPROCAL = {"R_di_8": "R_total", "R_de_8": "R_diffuse"}


class SphereGain(eqx.Module):
    """Gain of a sphere with the sample in its port, over that of the reading of 100 %.

    A sphere of mean wall reflectance r_w with a port of area fraction f, closed by what reflects r of diffuse
    light, multiplies the light that is let into it by G = 1 / (1 - (1 - f) r_w - f r). An ideal sphere has
    f = 0. The first reflection from the wall is that of the reference too and cancels. A baffle between port
    and detector makes f r in G smaller by about r_w, which is neglected.

    Parameters
    ----------
    reference
        1 / G of the reading of 100 %; 1 for an ideal sphere.
    wall
        1 - (1 - f) r_w; 1 for an ideal sphere.
    port_fraction
        f.
    facing
        Which diffuse reflectance of the sample faces the sphere: 0 of its front, 1 of its front without a
        backing, 2 of its back.

    References
    ----------
    Pickering, Prahl, van Wieringen, Beek, Sterenborg, van Gemert 1993 Appl. Opt. 32, 399 (single spheres).
    """

    reference: Float[np.ndarray, " readings"]
    wall: Float[np.ndarray, " readings"]
    port_fraction: Float[np.ndarray, " readings"]
    facing: Int[np.ndarray, " readings"]

    def of(self, reflectances: Float[Array, "readings sides"]) -> Float[Array, " readings"]:
        """Gain for each sample, from its diffuse reflectances in the order of ``facing``."""
        facing = reflectances[jnp.arange(len(self.facing)), self.facing]
        return self.reference / (self.wall - self.port_fraction * facing)


def sphere_gain(readings: Readings) -> SphereGain | None:
    """Gain of the spheres of some readings; None if all are ideal."""
    spheres = readings.spheres
    if spheres is None:
        return None
    fraction, reference = (
        np.nan_to_num(column) for column in (spheres.port_fraction, spheres.reference_reflectance)
    )
    wall = 1 - (1 - fraction) * np.nan_to_num(spheres.wall_reflectance)
    facing = [_facing(name) for name in readings.quantity.tolist()]
    return SphereGain(wall - fraction * reference, wall, fraction, np.array(facing))


def _facing(name: str) -> int:
    quantity = QUANTITIES[name]
    if not quantity.is_transmission:
        return 0
    # Diffuse light in front comes from a sphere there, collected light goes to one behind.
    return 1 if quantity.theta_i_deg is None else 2


class Geometries(eqx.Module):
    """Distinct geometries of some readings.

    Parameters
    ----------
    sin_incidence, sin_view
        Sines of the angles of incidence of totals and regular light, and of the views of diffuse light from
        the other side.
    directions
        Pairs of directions of reflectance factors.
    has_azimuth
        Whether the azimuth counts for any pair: not where one of its directions is the normal.
    wavelength_of_reading
        Position of the wavelength of each reading.
    place_of_reading
        Position of each reading among what is predicted at one wavelength: each of `_OF_INCIDENCE` at all
        incidences, each of `_OF_VIEW` at all views, and the pairs.
    """

    sin_incidence: Float[np.ndarray, " incidences"]
    sin_view: Float[np.ndarray, " views"]
    directions: Directions
    has_azimuth: bool = eqx.field(static=True)
    wavelength_of_reading: Int[np.ndarray, " readings"]
    place_of_reading: Int[np.ndarray, " readings"]


class ReadingsModel(SampleModel):
    """Predicts totals, regular light and reflectance factors of a sample.

    Light is parallel, and all of it is collected that leaves the sample into a hemisphere: the cones, beam
    and field of view that the sample declares are those of a goniometer.

    Parameters
    ----------
    sample
        The sample.
    readings
        What is read, with which spheres; their values are not used.
    config
        Resolution; by default that of `sizes` for the accuracy, at the values of the sample's table.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.
    layer_method
        See `SolverConfig`.

    Raises
    ------
    InputRefusedError
        If the sample cannot be predicted, or declares effects; see `jaxink.effects.readings_model`.
    """

    geometries: Geometries
    gain: SphereGain | None

    def __init__(
        self,
        sample: Sample,
        readings: Readings,
        config: SolverConfig | None = None,
        accuracy: float = DEFAULT_ACCURACY,
        layer_method: str = "fastest",
    ):
        _require_predictable(sample, readings)
        wavelengths, wavelength_of_reading = np.unique(readings.wavelength_nm, return_inverse=True)
        media = media_at(sample, tuple(wavelengths.tolist()))
        # As if there were a backing, for what the back reflects.
        self.plan = plan_media(*media, has_backing=True)
        self.builder = stack_builder(sample, tuple(wavelengths.tolist()), media)
        self.geometries = _geometries(readings, wavelength_of_reading.reshape(-1))
        self.gain = sphere_gain(readings)
        if config is None:
            config = model_sizes(self.builder, self.plan, {}, accuracy, layer_method)
        self.config = self._with_orders(config)
        self.rough_tables = rough_tables(self.builder, self.plan, self.config)

    def _with_orders(self, config: SolverConfig) -> SolverConfig:
        """Totals need no azimuthal order but the first, and along the normal all others vanish."""
        return config if self.geometries.has_azimuth else dataclasses.replace(config, n_orders=1)

    @property
    def wavelength_of_point_nm(self) -> Float[np.ndarray, " readings"]:
        """Wavelength of each reading."""
        return np.array(self.wavelengths_nm)[self.geometries.wavelength_of_reading]

    @property
    def n_stacks(self) -> int:
        """Number of stacks that one prediction solves: one at each wavelength, whatever is read."""
        return len(self.wavelengths_nm)

    def sizes(
        self, free_values: Mapping, accuracy: float = DEFAULT_ACCURACY, layer_method: str = "fastest"
    ) -> SolverConfig:
        """See `ForwardModel.sizes`."""
        return self._with_orders(model_sizes(self.builder, self.plan, free_values, accuracy, layer_method))

    def bsdf(self, free_values: Mapping | None = None) -> Float[Array, " readings"]:
        """Predicted values of the readings, by the name that fits call predictions.

        Parameters
        ----------
        free_values
            Values by name, in place of those of the sample's table; the readings are differentiable in each.

        Returns
        -------
        Float[Array, " readings"]
            Shares of the incident power and reflectance factors, as read with the spheres.

        Raises
        ------
        PrecisionError
            If JAX uses 32 bits.
        """
        require_float64()
        wavelengths, values = jnp.asarray(self.wavelengths_nm), self.builder.values(free_values)
        spectrum, reflectances = at_each(self._at_wavelength, wavelengths, values, self.rough_tables)
        wave, place = self.geometries.wavelength_of_reading, self.geometries.place_of_reading
        read = spectrum[wave, place]
        return read if self.gain is None else read * self.gain.of(reflectances[wave])

    def _at_wavelength(self, wavelength_nm, values, tables):
        """Every quantity in every geometry, and the diffuse reflectances that load a sphere."""
        stack, plan = self.solvable(wavelength_nm, values, tables)
        at = self.geometries
        light = collected_light(stack, at.directions, at.sin_incidence, at.sin_view, self.config, plan)
        return _every_quantity(stack, at, light), jnp.stack([light.front, light.front_alone, light.back])


def _every_quantity(stack: Stack, at: Geometries, light: CollectedLight) -> Float[Array, " places"]:
    specular, collimated = regular_power(stack, at.sin_incidence)
    ratio = stack.index_back / stack.index_front
    _, seen_regularly = regular_power(stack, ratio * at.sin_view)
    of_incidence = [
        light.reflectance,
        light.reflectance - specular,
        specular,
        light.transmittance,
        light.transmittance - collimated,
        collimated,
    ]
    of_view = [light.seen_through, light.seen_through - ratio**2 * seen_regularly]
    return jnp.concatenate([*of_incidence, *of_view, jnp.pi * light.bsdf])


def _geometries(readings: Readings, wavelength_of_reading: Int[np.ndarray, " readings"]) -> Geometries:
    names = [_RECIPROCAL.get(name, name) for name in readings.quantity.tolist()]
    quantity = np.array(names)
    # The angle that counts for a single one: of incidence, or of view for diffuse light.
    angle = np.where(np.isnan(readings.theta_i_deg), readings.theta_o_deg, readings.theta_i_deg)
    incident, viewed = np.isin(quantity, _OF_INCIDENCE), np.isin(quantity, _OF_VIEW)
    paired = ~(incident | viewed)
    place = np.zeros(len(readings), int)
    # Normal light, which nothing reads, where there is none.
    incidences, at_incidence = np.unique(angle[incident], return_inverse=True)
    views, at_view = np.unique(angle[viewed], return_inverse=True)
    incidences, views = (each if each.size else np.zeros(1) for each in (incidences, views))
    rank = np.array([(*_OF_INCIDENCE, *_OF_VIEW, name).index(name) for name in names])
    place[incident] = rank[incident] * incidences.size + at_incidence.reshape(-1)
    first = len(_OF_INCIDENCE) * incidences.size
    place[viewed] = first + (rank[viewed] - len(_OF_INCIDENCE)) * views.size + at_view.reshape(-1)
    columns = np.column_stack([readings.theta_i_deg, readings.theta_o_deg, readings.phi_deg])[paired]
    pairs, at_pair = np.unique(columns, axis=0, return_inverse=True)
    place[paired] = first + len(_OF_VIEW) * views.size + at_pair.reshape(-1)
    theta_i, theta_o, phi = (pairs if len(pairs) else np.array([[0.0, 0.0, 180.0]])).T
    return Geometries(
        np.sin(np.deg2rad(incidences)),
        np.sin(np.deg2rad(views)),
        Directions.from_degrees(theta_i, theta_o, phi, np.zeros(len(phi), bool)),
        bool(((theta_i > 0) & (theta_o > 0)).any()),
        wavelength_of_reading,
        place,
    )


def _require_predictable(sample: Sample, readings: Readings) -> None:
    if sample.effects:
        names = ", ".join(effect.name for effect in sample.effects)
        raise InputRefusedError(
            f"the sample declares effects ({names}), which this model does not have; use "
            "jaxink.effects.readings_model."
        )
    wavelengths = tuple(np.unique(readings.wavelength_nm).tolist())
    transmitted = any(QUANTITIES[name].is_transmission for name in readings.quantity.tolist())
    require_determined(sample, wavelengths, transmitted)
    for layer in sample.layers:
        check_phase_table(layer)
    require_not_negative(sample, {})
