"""What a table will contain, known from the sample alone, before anything is computed and without JAX."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from jaxink.display.brief import brief_repr
from jaxink.ink.ink_layers import InkLayers
from jaxink.sample import Layer, Roughness

if TYPE_CHECKING:
    from jaxink.ink.boundary_file import RoughBoundary

# Share of the incident power that is treated as nothing.
NEGLIGIBLE = 1e-6
# Difference of two refractive indices that is treated as none.
SAME_INDEX = 1e-9


@dataclasses.dataclass(frozen=True)
class ExpectedTable:
    """Properties of a table that is still to be computed.

    Parameters
    ----------
    wavelength_nm
        Wavelengths, shape ``(wavelengths,)``.
    index_inside, index_outside
        Refractive indices of side I and side A, shape ``(wavelengths,)``.
    has_regular
        Whether some light may remain regular; True if that is not known.
    rough_faces
        Names of the faces whose facets make lobes that may be narrower than the steps of the table.
    has_standard_errors
        Whether the table will have standard errors.
    """

    __repr__ = brief_repr

    wavelength_nm: tuple[float, ...]
    index_inside: tuple[float, ...]
    index_outside: tuple[float, ...]
    has_regular: bool
    rough_faces: tuple[str, ...]
    has_standard_errors: bool


def expected_table(
    ink: InkLayers, wavelengths_nm: Sequence[float], has_standard_errors: bool
) -> ExpectedTable:
    """What `jaxink.ink.tabulate.tabulate` will give for an ink."""
    inside, outside = zip(*(ink.indices(wavelength) for wavelength in wavelengths_nm), strict=True)
    faces = [face for face in _faces(ink) if face is not None and face.density is not None]
    return ExpectedTable(
        tuple(wavelengths_nm),
        inside,
        outside,
        # Declared effects, such as pinholes, may let light pass.
        bool(ink.sample.effects) or any(_keeps_regular(ink, wavelength) for wavelength in wavelengths_nm),
        tuple(face.name for face in faces),
        has_standard_errors,
    )


def expected_boundary(boundary: "RoughBoundary") -> ExpectedTable:
    """What `jaxink.ink.boundary.boundary_table` will give."""
    return ExpectedTable(
        boundary.wavelengths_nm,
        boundary.index_inside,
        boundary.index_outside,
        # Facets send no light in the regular directions.
        has_regular=boundary.method == "waves",
        rough_faces=(),
        has_standard_errors=boundary.height_scale_standard_error > 0,
    )


def _faces(ink: InkLayers) -> Iterator[Roughness | None]:
    """Roughness of each interface of the ink, from the front; an interface is declared by either layer."""
    layers = ink.sample.layers
    for k in range(ink.first, ink.last + 2):
        before = layers[k - 1].roughness if k > 0 else ()
        after = layers[k].roughness if k < len(layers) else ()
        declared = [face for face in before if face.face == "back_roughness"]
        declared += [face for face in after if face.face == "front_roughness"]
        yield next(iter(declared), None)


def _keeps_regular(ink: InkLayers, wavelength_nm: float) -> bool:
    """Whether light from either side may leave regularly at some incidence, at one wavelength."""
    here = ink.sample.at_wavelength(ink.sample.parameters.values_with({}), wavelength_nm)
    layers = ink.sample.layers[ink.first : ink.last + 1]
    front, back = ink.indices(wavelength_nm)[:: 1 if ink.inside == "front" else -1]
    indices = [front, *(float(here[f"{layer.name}.refractive_index"]) for layer in layers), back]
    faces, thickness = list(_faces(ink)), [_optical_thickness(layer, here) for layer in layers]
    return _way_keeps(indices, faces, thickness) or _way_keeps(indices[::-1], faces[::-1], thickness[::-1])


def _way_keeps(indices: list[float], faces: list[Roughness | None], thickness: list[float]) -> bool:
    """Whether light from the front is reflected by a smooth face that it reaches, or passes all of them."""
    passed = 0.0
    for k, face in enumerate(faces):
        if face is not None and face.density is not None:
            return False
        way_back = math.exp(-2 * passed)
        if abs(indices[k] - indices[k + 1]) > SAME_INDEX and way_back > NEGLIGIBLE:
            return True
        if k < len(thickness):
            passed += thickness[k]
    return math.exp(-passed) > NEGLIGIBLE


def _optical_thickness(layer: Layer, values: Mapping[str, Any]) -> float:
    """Optical thickness of a layer along its normal; 0 if that takes a computation, as for Mie particles."""
    if layer.opaque:
        return math.inf
    kinds = ("scattering_per_mm", "absorption_per_mm") if layer.scatters else ("absorption_per_mm",)
    names = [f"{layer.name}.{kind}" for kind in kinds]
    if any(name not in values for name in names):
        return 0.0
    thickness_mm = (
        values[f"{layer.name}.thickness_um"] / 1000
        if layer.scatters
        else values[f"{layer.name}.thickness_mm"]
    )
    return float(sum(values[name] for name in names) * thickness_mm)
