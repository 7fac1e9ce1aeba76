"""Media of a sample: what the channels of the solver depend on."""

from typing import NamedTuple

from jaxink.model.instrument import require_equal_surroundings
from jaxink.model.points import Points
from jaxink.sample import Sample


class Media(NamedTuple):
    """Front, layers and back of a sample.

    Parameters
    ----------
    indices
        Refractive indices; that of the wavelength where it is highest.
    scatters
        Whether each scatters.
    free
        Whether its index is free, or not the same at every wavelength.
    """

    indices: list[float]
    scatters: list[bool]
    free: list[bool]

    def are_one(self, first: int, second: int) -> bool:
        """Whether two media always have the same index."""
        is_fixed = not (self.free[first] or self.free[second])
        return is_fixed and self.indices[first] == self.indices[second]


def media_of(sample: Sample, points: Points) -> Media:
    """Media of a sample at the points of a measurement.

    Parameters
    ----------
    sample
        The sample.
    points
        The points.

    Raises
    ------
    InputRefusedError
        As `require_equal_surroundings`.
    """
    names = index_names(sample)
    start = sample.parameters.values_with({})
    each = [sample.at_wavelength(start, w) for w in points.wavelengths_nm]
    media = Media(
        # An index that the wavelength changes counts where it is highest: no block may be missing there.
        [max(float(values[n]) for values in each) for n in names],
        [False, *(layer.scatters for layer in sample.layers), False],
        [sample.varies(n) or len({float(values[n]) for values in each}) > 1 for n in names],
    )
    if sample.backing is None or not sample.backing.contact:
        require_equal_surroundings(media.indices[0], media.indices[-1], points.cones)
    return media


def index_names(sample: Sample) -> tuple[str, ...]:
    """Names of the refractive indices of front, layers and back."""
    inside = (f"{layer.name}.refractive_index" for layer in sample.layers)
    return "surroundings.index_front", *inside, index_behind(sample)


def index_behind(sample: Sample) -> str:
    """Name of the refractive index behind the last face: no gap is between what touches optically."""
    in_contact = sample.backing is not None and sample.backing.contact
    return f"{sample.layers[-1].name}.refractive_index" if in_contact else "surroundings.index_back"
