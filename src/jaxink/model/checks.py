"""Whether a sample can be predicted at the points of a measurement."""

from collections.abc import Iterable, Mapping

from jaxink.errors import InputRefusedError
from jaxink.model.points import PredictedPoints
from jaxink.model.volume import check_phase_table
from jaxink.numerics.validity import require
from jaxink.sample import Sample

_NOT_NEGATIVE = ("scattering_per_mm", "absorption_per_mm", "thickness_mm", "thickness_um")


def require_not_negative(sample: Sample, values: Mapping) -> None:
    """Reject a negative coefficient or thickness; one that is traced or tied passes.

    Parameters
    ----------
    sample
        The sample.
    values
        Values by name, in place of those of the sample's table.
    """
    for name, parameter in sample.parameters.items():
        if parameter.tie is None and name.split("@")[0].rpartition(".")[2] in _NOT_NEGATIVE:
            require(name, values.get(name, parameter.value), lambda v: v >= 0, "be at least 0")


def require_predictable(sample: Sample, points: PredictedPoints) -> None:
    """Reject a sample that does not determine the BSDF at every point.

    Raises
    ------
    InputRefusedError
        With what is wrong and what would be right.
    """
    if sample.effects:
        names = ", ".join(effect.name for effect in sample.effects)
        raise InputRefusedError(
            f"the sample declares effects ({names}), which a ForwardModel does not know; use "
            "jaxink.forward_model(sample, data) instead."
        )
    require_determined(sample, points.wavelengths_nm, bool(points.rays.directions.is_transmission.any()))


def require_determined(sample: Sample, wavelengths_nm: tuple[float, ...], is_transmitted: bool) -> None:
    """Reject a sample that does not determine its stacks.

    Parameters
    ----------
    sample
        The sample.
    wavelengths_nm
        Wavelengths of the measurement.
    is_transmitted
        Whether some of it is transmission.
    """
    _check_wavelengths(sample, wavelengths_nm)
    backing = sample.backing
    if backing is not None and backing.side == "both" and is_transmitted:
        raise InputRefusedError(
            'the measurement has rows of side T, but an opaque backing with side = "both" transmits nothing; '
            'write side = "R" if it was removed for them.'
        )
    for layer in sample.layers:
        check_phase_table(layer)
    require_not_negative(sample, {})


def wavelengths_without_values(sample: Sample, wavelengths_nm: Iterable[float]) -> list[float]:
    """Those of some wavelengths at which parameters that are given by wavelength have no value."""
    named = _named_wavelengths(sample)
    return [wavelength for wavelength in wavelengths_nm if named and f"{wavelength:g}" not in named]


def _named_wavelengths(sample: Sample) -> set[str]:
    return {n.split("@")[1] for n in sample.parameters if "@" in n}


def _check_wavelengths(sample: Sample, wavelengths_nm: tuple[float, ...]) -> None:
    for wavelength in wavelengths_without_values(sample, wavelengths_nm):
        named = sorted(_named_wavelengths(sample), key=float)
        raise InputRefusedError(
            f"the measurement has rows at {wavelength:g} nm, but the sample gives its per-wavelength "
            f"parameters at {', '.join(named)} nm only; list {wavelength:g} in wavelength_nm of the sample "
            "file, and fit again if a fit gave them."
        )
    for dispersion in sample.dispersions:
        dispersion.check(sample.parameters, wavelengths_nm)
