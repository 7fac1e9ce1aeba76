"""The forward model: parameters in, predicted BSDF at the measured directions out."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.errors import InputRefusedError
from jaxink.model.instrument import ConeRays, Cones, cone_rays, require_equal_surroundings
from jaxink.model.volume import MieSizes, check_phase_table, mie_sizes, volume_scattering
from jaxink.numerics.precision import computing, require_float64
from jaxink.optics.layers import OPAQUE_OPTICAL_THICKNESS, ClearLayer, ScatteringLayer
from jaxink.sample import Layer, Roughness, Sample
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.bsdf import diffuse_bsdf, regular_power
from jaxink.solver.lateral import LateralField
from jaxink.solver.resolution import demand, sizes_for
from jaxink.solver.stack import SolverConfig, Stack, block_media
from jaxink.surfaces.height_map import TabulatedSlopes
from jaxink.surfaces.slopes import DENSITIES, SlopeDensity, SlopeMixture, slope_density
from jaxink.surfaces.spectrum import GaussianSpectrum, KCorrelation, PowerSpectrum
from jaxink.surfaces.table import RoughTable, rough_table
from jaxink.surfaces.tabulated_spectrum import TabulatedSpectrum
from jaxink.surfaces.wave_face import WaveFace


def _at_each(of, *by_wavelength):
    """What a function gives at each wavelength; one alone needs no batch, which takes longer to trace."""
    if jax.tree.leaves(by_wavelength)[0].shape[0] > 1:
        return eqx.filter_vmap(of)(*by_wavelength)
    found = of(*jax.tree.map(lambda column: column[0], by_wavelength))
    return jax.tree.map(lambda value: jnp.asarray(value)[None], found)


class LayerCoefficients(eqx.Module):
    """Volume scattering of one layer at one wavelength.

    Parameters
    ----------
    scattering_per_mm, absorption_per_mm
        Coefficients.
    asymmetry_parameter
        Mean cosine g of the scattering angle.
    reduced_scattering_per_mm
        scattering (1 - g).
    reduced_optical_thickness
        scattering (1 - g) thickness; infinite where opaque.
    """

    scattering_per_mm: Float[Array, ""]
    absorption_per_mm: Float[Array, ""]
    asymmetry_parameter: Float[Array, ""]
    reduced_scattering_per_mm: Float[Array, ""]
    reduced_optical_thickness: Float[Array, ""]


def _columns(**given) -> list[np.ndarray]:
    """Columns of one length, with polar angles of one hemisphere: others would become NaN in silence."""
    points = {name: np.asarray(column, float) for name, column in given.items()}
    length = points["theta_i_deg"].shape
    for name, column in points.items():
        if column.ndim != 1 or column.shape != length:
            raise InputRefusedError(
                f"{name} has shape {column.shape}; all columns must have the shape (points,), here {length}."
            )
    for name in ("theta_i_deg", "theta_o_deg"):
        outside = ~((points[name] >= 0) & (points[name] <= 90))
        if outside.any():
            raise InputRefusedError(f"{name} is {points[name][outside][0]:g}; it must lie in 0 ... 90.")
    return list(points.values())


class ForwardModel(eqx.Module):
    """Predicts the BSDF of a sample at the points of a measurement.

    Parameters
    ----------
    sample
        What is known of the sample.
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        Points, shape ``(points,)``.
    config
        Sizes of the discretisation; None: `sizes` for the accuracy, at the values of the sample's table.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.
    layer_method
        As of `SolverConfig`.

    Raises
    ------
    InputRefusedError
        If the columns of the points differ in length, a polar angle is not 0 ... 90, or the sample cannot be
        solved.
    """

    sample: Sample = eqx.field(static=True)
    config: SolverConfig = eqx.field(static=True)
    cones: Cones = eqx.field(static=True)
    wavelengths_nm: tuple[float, ...] = eqx.field(static=True)
    wavelength_of_point: np.ndarray
    pair_of_point: np.ndarray
    rays: ConeRays
    block_media: tuple[int, ...] = eqx.field(static=True)
    exposed: bool = eqx.field(static=True)
    rarest: tuple[int, ...] = eqx.field(static=True)
    rough_faces: tuple[Roughness | None, ...] = eqx.field(static=True)
    rough_tables: tuple[RoughTable | None, ...]
    mie_sizes: MieSizes = eqx.field(static=True)

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
        self.sample = sample
        self.cones = Cones(sample.source_half_angle_deg, sample.detector_half_angle_deg)
        *columns, wavelength_nm = _columns(
            theta_i_deg=theta_i_deg,
            theta_o_deg=theta_o_deg,
            phi_deg=phi_deg,
            is_transmission=is_transmission,
            wavelength_nm=wavelength_nm,
        )
        # Every wavelength is predicted at the same pairs, so that one batch serves the spectrum.
        pairs, self.pair_of_point = np.unique(np.column_stack(columns), axis=0, return_inverse=True)
        wavelengths, self.wavelength_of_point = np.unique(wavelength_nm, return_inverse=True)
        self.wavelengths_nm = tuple(wavelengths.tolist())
        self.rays = cone_rays(self.cones, *pairs[:, :3].T, pairs[:, 3] > 0.5)
        self._check_wavelengths()
        self._check_backing(np.any(pairs[:, 3] > 0.5))
        for layer in sample.layers:
            check_phase_table(layer)
        self.block_media, self.exposed, self.rarest, self.rough_faces = self._channel_layout()
        self.mie_sizes = mie_sizes(sample, self.wavelengths_nm)
        self.rough_tables = ()
        self.config = self.sizes({}, accuracy, layer_method) if config is None else config
        self.rough_tables = tuple(self._rough_table(k) for k in range(len(self.rough_faces)))

    def _rough_table(self, interface: int) -> RoughTable | None:
        """An interface computed beforehand at each wavelength, where at most its angle is free."""
        face, table = self.rough_faces[interface], self.sample.parameters
        if face is None or face.density not in DENSITIES or face.second_density is not None:
            return None
        names = self._index_names()
        if any(not p.is_fixed and p.name.startswith(names) for p in table.values()):
            return None
        sigma = table.get(f"{face.name}.sigma_deg")
        if sigma is None or sigma.tie is not None:
            return None
        span = (sigma.minimum, sigma.maximum) if sigma.free else (sigma.value, sigma.value)

        def at_wavelength(wavelength_nm, values):
            stack = self.stack(values, wavelength_nm)
            outer, inner, _, n_orders, sizes = stack.rough_arguments(interface, self.config)
            grid = stack.grid(self.config)
            return rough_table(grid, (outer, inner), face.density, span, n_orders, sizes.n_outer)

        # Numbers, even where a model is made within a function that is being compiled.
        with computing(), jax.ensure_compile_time_eval():
            values = self._at_each_wavelength(table.values_with({}))
            return _at_each(at_wavelength, jnp.asarray(self.wavelengths_nm), values)

    def _index_names(self) -> tuple[str, ...]:
        """Names of the refractive indices of front, layers and back."""
        inside = (f"{layer.name}.refractive_index" for layer in self.sample.layers)
        return "surroundings.index_front", *inside, self._index_behind()

    def _index_behind(self) -> str:
        """Name of the refractive index behind the last face: no gap is between what touches optically."""
        backing = self.sample.backing
        in_contact = backing is not None and backing.contact
        return f"{self.sample.layers[-1].name}.refractive_index" if in_contact else "surroundings.index_back"

    def _channel_layout(self):
        table, names = self.sample.parameters, self._index_names()
        start = table.values_with({})
        each = [self.sample.at_wavelength(start, w) for w in self.wavelengths_nm]
        # An index that the wavelength changes counts where it is highest: no block may be missing there.
        indices = [max(float(values[n]) for values in each) for n in names]
        free = [self.sample.varies(n) or len({float(values[n]) for values in each}) > 1 for n in names]
        scatters = [False, *(layer.scatters for layer in self.sample.layers), False]
        if self.sample.backing is None or not self.sample.backing.contact:
            require_equal_surroundings(indices[0], indices[-1], self.cones)
        # A backing sends light in all directions, too.
        chosen = block_media(indices, [*scatters[:-1], self.sample.backing is not None], free)
        lowest = chosen[0]
        exposed = any(
            scatters[k] and not free[k] and abs(indices[k] / indices[lowest] - 1) < 1e-5
            for k in range(len(indices))
        )
        rarest = tuple(
            k for k, n in enumerate(indices) if not free[lowest] and not free[k] and n == indices[lowest]
        )
        # Facets between equal media neither reflect nor refract.
        faces = tuple(
            None if indices[k] == indices[k + 1] and not (free[k] or free[k + 1]) else face
            for k, face in enumerate(_rough_faces(self.sample))
        )
        return chosen, exposed, rarest, faces

    def _check_backing(self, has_transmission):
        backing = self.sample.backing
        if backing is not None and backing.side == "both" and has_transmission:
            raise InputRefusedError(
                'the measurement has rows of side T, but behind an opaque backing with side = "both" nothing '
                'is transmitted; write side = "R" if it was taken away for them.'
            )

    def _check_wavelengths(self):
        named = {n.split("@")[1] for n in self.sample.parameters if "@" in n}
        for wavelength in self.wavelengths_nm:
            if named and f"{wavelength:g}" not in named:
                raise InputRefusedError(
                    f"the measurement has rows at {wavelength:g} nm, but the sample file gives its "
                    f"per-wavelength parameters at {', '.join(sorted(named))} nm only; list "
                    f"{wavelength:g} in its wavelength_nm."
                )
        for dispersion in self.sample.dispersions:
            dispersion.check(self.sample.parameters, self.wavelengths_nm)

    def _at_each_wavelength(self, values: Mapping) -> dict[str, Float[Array, " wavelengths"]]:
        """Values by plain name, one for each wavelength."""
        each = [self.sample.at_wavelength(values, w) for w in self.wavelengths_nm]
        return {name: jnp.stack([jnp.asarray(here[name], float) for here in each]) for name in each[0]}

    def stack(self, values: Mapping, wavelength_nm, rough_tables: tuple = ()) -> Stack:
        """The stack at one wavelength.

        Parameters
        ----------
        values
            Value of every parameter, by plain name.
        wavelength_nm
            Wavelength in vacuum.
        rough_tables
            Those of the model at this wavelength; empty: rough interfaces are computed when needed.
        """
        sizes = self.mie_sizes
        layers = tuple(_layer(layer, values, wavelength_nm, sizes)[0] for layer in self.sample.layers)
        return Stack(
            layers,
            values["surroundings.index_front"],
            values[self._index_behind()],
            self.block_media,
            self.exposed,
            tuple(face and _face(face, values, wavelength_nm) for face in self.rough_faces),
            tuple(
                table and table.at(values[f"{face.name}.sigma_deg"])
                for table, face in zip(rough_tables, self.rough_faces, strict=bool(rough_tables))
            ),
            self.rarest,
            None if self.sample.backing is None else values["backing.reflectance"],
            self._lateral(values),
        )

    def _lateral(self, values: Mapping) -> LateralField | None:
        """Where light is seen; ways in the ink are not followed."""
        sample = self.sample
        if sample.beam_diameter_mm is None:
            return None
        thickness = [
            jnp.zeros(()) if layer.scatters else values[f"{layer.name}.thickness_mm"]
            for layer in sample.layers
        ]
        thickness = jnp.stack([jnp.asarray(one, float) for one in thickness])
        diameters = (
            values.get(f"instrument.{key}", getattr(sample, key))
            for key in ("beam_diameter_mm", "detector_diameter_mm")
        )
        return LateralField(*(diameter / 2 for diameter in diameters), thickness)

    def sizes(
        self, free_values: Mapping, accuracy: float = DEFAULT_ACCURACY, layer_method: str = "fastest"
    ) -> SolverConfig:
        """Sizes of the discretisation that keep the BSDF within an accuracy at every wavelength.

        Parameters
        ----------
        free_values
            Known values by name that replace those of the sample's table.
        accuracy, layer_method
            As of `choose_sizes`.
        """
        with computing():
            values = self._at_each_wavelength(self.sample.parameters.values_with(free_values))
            sizes = sizes_for(self._demand(values), accuracy, layer_method)
        # A fit visits other values than those it starts from, and has to rank them.
        return sizes.at_least(SolverConfig()) if self.sample.parameters.free else sizes

    @eqx.filter_jit
    def _demand(self, values):
        return _at_each(lambda w, v: demand(self.stack(v, w)), jnp.asarray(self.wavelengths_nm), values)

    def bsdf(self, free_values: Mapping | None = None) -> Float[Array, " points"]:
        """Predicted BSDF at the points.

        Parameters
        ----------
        free_values
            Values by name that replace those of the sample's table; differentiable in each.

        Returns
        -------
        Float[Array, " points"]
            1/sr, averaged over the cones of the instrument where these are not zero.

        Raises
        ------
        PrecisionError
            While JAX is in 32 bits.
        """
        require_float64()
        values = self._at_each_wavelength(self.sample.parameters.values_with(free_values or {}))

        def at_wavelength(wavelength_nm, values_here, rough_tables):
            stack = self.stack(values_here, wavelength_nm, rough_tables)
            diffuse = self.rays.average(diffuse_bsdf(stack, self.rays.directions, self.config))
            if self.cones.is_ideal:
                return diffuse
            directions = self.rays.directions
            sines, side = directions.sin_incidence, directions.is_transmission
            reflected, transmitted = regular_power(stack, sines)
            regular = jnp.where(side, transmitted[directions.incidence], reflected[directions.incidence])
            return diffuse + self.rays.average(regular) * self.rays.regular_share

        spectrum = _at_each(at_wavelength, jnp.asarray(self.wavelengths_nm), values, self.rough_tables)
        return spectrum[self.wavelength_of_point, self.pair_of_point]

    def regular(self, free_values: Mapping | None = None) -> Float[Array, " points"]:
        """Power of the regular peak on each point's side, for a beam of each point's incidence.

        Parameters
        ----------
        free_values
            As in `bsdf`.

        Returns
        -------
        Float[Array, " points"]
            Share of the incident power.
        """
        require_float64()
        values = self._at_each_wavelength(self.sample.parameters.values_with(free_values or {}))
        directions = self.rays.directions

        def at_wavelength(wavelength_nm, values_here, rough_tables):
            stack = self.stack(values_here, wavelength_nm, rough_tables)
            reflected, transmitted = regular_power(stack, directions.sin_incidence)
            there = directions.incidence
            chosen = jnp.where(directions.is_transmission, transmitted[there], reflected[there])
            return self.rays.average(chosen)

        spectrum = _at_each(at_wavelength, jnp.asarray(self.wavelengths_nm), values, self.rough_tables)
        return spectrum[self.wavelength_of_point, self.pair_of_point]

    def coefficients(self, free_values: Mapping | None = None) -> dict[str, LayerCoefficients]:
        """Scattering and absorption of each scattering layer, at every wavelength.

        Parameters
        ----------
        free_values
            As in `bsdf`.

        Returns
        -------
        dict[str, LayerCoefficients]
            By layer name; entries of shape ``(wavelengths,)``.
        """
        require_float64()
        values = self._at_each_wavelength(self.sample.parameters.values_with(free_values or {}))
        return {
            layer.name: _at_each(
                lambda w, v, layer=layer: _layer(layer, v, w, self.mie_sizes)[1],
                jnp.asarray(self.wavelengths_nm),
                values,
            )
            for layer in self.sample.layers
            if layer.scatters
        }


@eqx.filter_jit
def _compiled_bsdf(model: ForwardModel):
    return model.bsdf()


def evaluate(model: ForwardModel) -> np.ndarray:
    """BSDF of a model with the values of its own table, in 64 bits whatever the session's setting.

    Parameters
    ----------
    model
        The model.

    Returns
    -------
    np.ndarray
        1/sr, shape ``(points,)``.
    """
    with computing():
        return np.asarray(_compiled_bsdf(model))


def _rough_faces(sample: Sample) -> list[Roughness | None]:
    """Rough face of each interface; None where it is smooth."""
    faces: list = [None] * (len(sample.layers) + 1)
    for k, layer in enumerate(sample.layers):
        for face in layer.roughness:
            strength = sample.parameters.get(face.strength)
            flat = strength is not None and strength.is_fixed and strength.value == 0
            if flat and face.second_density is None:
                continue
            interface = k if face.face == "front_roughness" else k + 1
            if faces[interface] is not None:
                raise InputRefusedError(
                    f"{faces[interface].name} and {face.name} are the same interface; declare it once."
                )
            faces[interface] = face
    return faces


def _face(face: Roughness, values: Mapping, wavelength_nm) -> SlopeDensity | WaveFace:
    """What makes an interface rough, at one wavelength."""

    def get(key):
        return values[f"{face.name}.{key}"]

    if face.spectrum is not None:
        return WaveFace(_spectrum(face, get), wavelength_nm, face.amplitude)
    if face.nodes is not None:
        slopes, log_density, _ = face.nodes
        return TabulatedSlopes(get("height_scale"), np.array(slopes), np.array(log_density))
    first = slope_density(face.density, get("sigma_deg"))
    if face.second_density is None:
        return first
    return SlopeMixture(
        first, slope_density(face.second_density, get("second_sigma_deg")), get("second_weight")
    )


def _spectrum(face: Roughness, get) -> PowerSpectrum:
    if face.nodes is not None:
        log_frequency, log_shape, variance = face.nodes
        variance = variance * get("height_scale") ** 2
        return TabulatedSpectrum(variance, np.array(log_frequency), np.array(log_shape))
    variance = get("height_rms_um") ** 2
    if face.spectrum == "gaussian":
        return GaussianSpectrum(variance, get("correlation_length_um"))
    return KCorrelation(variance, get("length_b_um"), get("exponent"))


def _layer(layer: Layer, values: Mapping, wavelength_nm, sizes: MieSizes):
    """Optics of one layer at one wavelength, and its coefficients."""

    def get(key):
        return values[f"{layer.name}.{key}"]

    if not layer.scatters:
        return ClearLayer(get("refractive_index"), get("absorption_per_mm") * get("thickness_mm")), None
    phase, scattering, absorption = volume_scattering(layer, values, wavelength_nm, sizes)
    extinction = scattering + absorption
    asymmetry = phase.moments(2)[1]
    if layer.opaque:
        thickness, reduced = jnp.asarray(OPAQUE_OPTICAL_THICKNESS), jnp.asarray(jnp.inf)
    else:
        thickness_mm = get("thickness_um") / 1000
        thickness = extinction * thickness_mm
        reduced = scattering * (1 - asymmetry) * thickness_mm
    # A layer with no extinction has no albedo; any value serves.
    albedo = scattering / jnp.where(extinction > 0, extinction, 1.0)
    optics = ScatteringLayer(get("refractive_index"), thickness, albedo, phase)
    if layer.opaque and layer.phase_function != "mie":
        # Only the albedo of such a layer is known: no length gives its coefficients a scale.
        scattering = absorption = jnp.asarray(jnp.nan)
    return optics, LayerCoefficients(scattering, absorption, asymmetry, scattering * (1 - asymmetry), reduced)
