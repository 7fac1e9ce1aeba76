"""Media of a sample, on which the channels of the solver depend."""

from typing import NamedTuple

from jaxink.errors import InputRefusedError
from jaxink.model.points import Points
from jaxink.sample import Sample


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


def media_of(sample: Sample, points: Points) -> Media:
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
