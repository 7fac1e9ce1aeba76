"""Stack of a sample, and the media that its channels depend on, from the values of its parameters."""

import dataclasses
from collections.abc import Collection, Mapping
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.model.checks import require_not_negative
from jaxink.model.points import PredictedPoints
from jaxink.model.size_classes import MieSizes, mie_sizes
from jaxink.model.volume import LayerCoefficients, layer_optics, scattering_matrix
from jaxink.numerics.batches import at_each
from jaxink.optics import ScatteringMatrix
from jaxink.sample import Roughness, Sample
from jaxink.solver import LateralField, Stack
from jaxink.surfaces import (
    LAWS,
    GaussianSpectrum,
    KCorrelation,
    PowerSpectrum,
    SlopeDensity,
    SlopeLaw,
    SlopeMixture,
    TabulatedSlopes,
    TabulatedSpectrum,
    WaveFace,
    slope_density,
)

TreeT = TypeVar("TreeT")


class Media(NamedTuple):
    """Front, layers and back of a sample.

    Parameters
    ----------
    indices
        Largest refractive index of each at any of the wavelengths.
    scatters
        Whether each scatters.
    free
        Whether its index is free or varies with wavelength.
    sources
        Name of the parameter that gives its index: media of one name have the same index at all its values.
    """

    indices: list[float]
    scatters: list[bool]
    free: list[bool]
    sources: list[str]


def media_of(sample: Sample, points: PredictedPoints) -> Media:
    """Media of a sample at the points of a measurement.

    Raises
    ------
    InputRefusedError
        If source or detector has a cone and the surroundings differ, which would refract the beam's cone.
    """
    media = media_at(sample, points.wavelengths_nm)
    index_front, index_back = media.indices[0], media.indices[-1]
    in_contact = sample.backing is not None and sample.backing.contact
    if not (in_contact or points.cones.is_ideal or index_front == index_back):
        raise InputRefusedError(
            f"source or detector cones are declared, but index_front = {index_front:g} and index_back = "
            f"{index_back:g} differ; cones need the same medium on both sides."
        )
    return media


def media_at(sample: Sample, wavelengths_nm: tuple[float, ...]) -> Media:
    """Media of a sample at some wavelengths."""
    names = index_names(sample)
    start = sample.parameters.values_with({})
    each = [sample.at_wavelength(start, w) for w in wavelengths_nm]
    return Media(
        # The highest index at any wavelength, for no block of channels to be missing there.
        [max(float(values[n]) for values in each) for n in names],
        [False, *(layer.scatters for layer in sample.layers), False],
        [sample.varies(n) or len({float(values[n]) for values in each}) > 1 for n in names],
        [sample.parameters.source(n) for n in names],
    )


def index_names(sample: Sample) -> tuple[str, ...]:
    """Names of the refractive indices of front, layers and back."""
    inside = (f"{layer.name}.refractive_index" for layer in sample.layers)
    return "surroundings.index_front", *inside, index_behind(sample)


def index_behind(sample: Sample) -> str:
    """Name of the refractive index behind the last face; a backing in optical contact leaves no gap."""
    in_contact = sample.backing is not None and sample.backing.contact
    return f"{sample.layers[-1].name}.refractive_index" if in_contact else "surroundings.index_back"


class StackBuilder(eqx.Module):
    """Builds the stack of a sample from the values of its parameters.

    Parameters
    ----------
    sample
        The sample.
    wavelengths_nm
        Wavelengths in vacuum.
    faces
        Rough face of each interface; None if it is smooth.
    mie_sizes
        Sizes of the Mie series.
    laws
        Of the facets of each interface, one or two; none if it has none, or those of a height map.
    """

    __repr__ = brief_repr

    sample: Sample = eqx.field(static=True)
    wavelengths_nm: tuple[float, ...] = eqx.field(static=True)
    faces: tuple[Roughness | None, ...] = eqx.field(static=True)
    mie_sizes: MieSizes = eqx.field(static=True)
    laws: tuple[tuple[SlopeLaw, ...], ...]

    def without_values(self, given: Collection[str]) -> "StackBuilder":
        """The builder of all samples that differ in some values only, which are always given to it.

        The laws of facets are arrays of it: samples may also differ in these.
        """
        sample, laws = self.sample.without_values(given), jax.tree.map(jnp.asarray, self.laws)
        layers = tuple(
            dataclasses.replace(layer, roughness=tuple(map(_of_any_law, layer.roughness)))
            for layer in sample.layers
        )
        sample = dataclasses.replace(sample, layers=layers)
        faces = tuple(face and _of_any_law(face) for face in self.faces)
        return dataclasses.replace(self, sample=sample, faces=faces, laws=laws)

    def values(self, free_values: Mapping | None) -> dict[str, Float[Array, " wavelengths"]]:
        """Value of every parameter at each wavelength, by name without wavelength.

        Parameters
        ----------
        free_values
            Values by name, in place of those of the sample's table; None for these alone.
        """
        free_values = {} if free_values is None else free_values
        values = self.sample.parameters.values_with(free_values)
        require_not_negative(self.sample, free_values)
        each = [self.sample.at_wavelength(values, w) for w in self.wavelengths_nm]
        return {name: jnp.stack([jnp.asarray(here[name], float) for here in each]) for name in each[0]}

    def stack(self, values: Mapping, wavelength_nm) -> Stack:
        """The stack at one wavelength, from the values there of every parameter by name."""
        sample = self.sample
        lateral = _lateral(sample, values)
        faces = tuple(
            None if face is None else _face(face, laws, values, wavelength_nm)
            for face, laws in zip(self.faces, self.laws, strict=True)
        )
        layers = (layer_optics(layer, values, wavelength_nm, self.mie_sizes)[0] for layer in sample.layers)
        return Stack(
            tuple(layers),
            values["surroundings.index_front"],
            values[index_behind(sample)],
            faces,
            None if sample.backing is None else values["backing.reflectance"],
            lateral,
        )

    def scattering_matrices(self, values: Mapping, wavelength_nm) -> dict[int, ScatteringMatrix]:
        """Scattering matrix of each scattering layer by its position, from the arguments of `stack`."""
        return {
            k: scattering_matrix(layer, values, wavelength_nm, self.mie_sizes)
            for k, layer in enumerate(self.sample.layers)
            if layer.scatters
        }

    def coefficients(self, values: Mapping) -> dict[str, LayerCoefficients]:
        """Scattering and absorption of each scattering layer by name, from the result of `values`."""

        def of(layer):
            return lambda wavelength_nm, here: layer_optics(layer, here, wavelength_nm, self.mie_sizes)[1]

        wavelengths = jnp.asarray(self.wavelengths_nm)
        scattering = (layer for layer in self.sample.layers if layer.scatters)
        return {layer.name: at_each(of(layer), wavelengths, values) for layer in scattering}


def structure_of(tree: TreeT, given: Collection[str]) -> TreeT:
    """A tree of all samples that differ in the values of some parameters only, which are always given to it.

    Its arrays are JAX's, so that they, too, are given to a program of it.
    """

    def kept(leaf):
        if isinstance(leaf, StackBuilder):
            return leaf.without_values(given)
        return jnp.asarray(leaf) if isinstance(leaf, np.ndarray) else leaf

    return jax.tree.map(kept, tree, is_leaf=lambda leaf: isinstance(leaf, StackBuilder))


def stack_builder(sample: Sample, wavelengths_nm: tuple[float, ...], media: Media) -> StackBuilder:
    """Builder of the stacks of a sample with the given media.

    Raises
    ------
    InputRefusedError
        If an interface is declared twice, or particles are too large for the Mie series.
    """
    indices, free = media.indices, media.free
    # Facets between equal media neither reflect nor refract.
    faces = tuple(
        None if indices[k] == indices[k + 1] and not (free[k] or free[k + 1]) else face
        for k, face in enumerate(_declared_faces(sample))
    )
    laws = tuple(() if face is None else _laws(face) for face in faces)
    return StackBuilder(sample, wavelengths_nm, faces, mie_sizes(sample, wavelengths_nm), laws)


def _lateral(sample: Sample, values: Mapping) -> LateralField | None:
    """Beam and field of view; lateral transport within the ink is neglected."""
    if sample.beam_diameter_mm is None:
        return None
    each = [
        jnp.zeros(()) if layer.scatters else values[f"{layer.name}.thickness_mm"] for layer in sample.layers
    ]
    thickness = jnp.stack([jnp.asarray(one, float) for one in each])
    beam, detector = (
        values.get(f"instrument.{key}", getattr(sample, key)) / 2
        for key in ("beam_diameter_mm", "detector_diameter_mm")
    )
    return LateralField(beam, detector, thickness)


def _declared_faces(sample: Sample) -> list[Roughness | None]:
    """Rough face of each interface; None if it is smooth."""
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
                    f"{faces[interface].name} and {face.name} are the same interface; declare one of them."
                )
            faces[interface] = face
    return faces


def _laws(face: Roughness) -> tuple[SlopeLaw, ...]:
    return tuple(LAWS[name] for name in (face.density, face.second_density) if name in LAWS)


def _of_any_law(face: Roughness) -> Roughness:
    """The face without the names of its densities if they have laws."""
    return dataclasses.replace(face, density=None, second_density=None) if _laws(face) else face


def _face(
    face: Roughness, laws: tuple[SlopeLaw, ...], values: Mapping, wavelength_nm
) -> SlopeDensity | WaveFace:
    """Roughness of an interface at one wavelength."""

    def get(key):
        return values[f"{face.name}.{key}"]

    match face:
        case Roughness(spectrum=str(), amplitude=str(amplitude)):
            return WaveFace(_spectrum(face, get), wavelength_nm, amplitude)
        case Roughness(nodes=(slopes, log_density, _)):
            columns = jnp.asarray(np.array(slopes)), jnp.asarray(np.array(log_density))
            return TabulatedSlopes(get("height_scale"), *columns)
    density = slope_density(laws[0], get("sigma_deg"))
    if len(laws) == 1:
        return density
    second = slope_density(laws[1], get("second_sigma_deg"))
    return SlopeMixture(density, second, get("second_weight"))


def _spectrum(face: Roughness, get) -> PowerSpectrum:
    if face.nodes is not None:
        log_frequency, log_shape, variance = face.nodes
        variance = variance * get("height_scale") ** 2
        columns = jnp.asarray(np.array(log_frequency)), jnp.asarray(np.array(log_shape))
        return TabulatedSpectrum(variance, *columns)
    variance = get("height_rms_um") ** 2
    if face.spectrum == "gaussian":
        return GaussianSpectrum(variance, get("correlation_length_um"))
    return KCorrelation(variance, get("length_b_um"), get("exponent"))
