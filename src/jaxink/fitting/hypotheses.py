"""Mistakes that people make with the input of a fit, each with the correction that would undo it."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from jaxink.measurement import USER, GonioData
from jaxink.sample import Sample, turned_over

# Closer to grazing, a division by the cosine magnifies every error.
_LEAST_COSINE = 0.02
_THOUSAND = 1e3
# Range of a thickness around its declared value while hypotheses about it are tested.
_SPAN = 1e4
_PERCENT = 100.0
# The scanned angle has at least so many values, and so many times those of the other angle.
_FEWEST_SCANNED, _MORE_SCANNED = 10, 3


@dataclasses.dataclass(frozen=True)
class Corrected:
    """The input without a mistake.

    Parameters
    ----------
    data, sample
        Measurement and sample as they should be.
    noise_as_stated
        For changed values: the same with the noise as it is stated, as the mistake may have been made with
        the values alone; None if that makes no difference.
    held
        Values of parameters that are free in `sample` only so that hypotheses share one program.
    """

    data: GonioData
    sample: Sample
    noise_as_stated: tuple[GonioData, Sample] | None = None
    held: Mapping[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Hypothesis:
    """A mistake that may have been made.

    Parameters
    ----------
    name, statement, remedy
        As in `Mistake`.
    correct
        Undoes the mistake; None if it cannot have been made with this input.
    about_noise
        Whether only the standard deviations are concerned.
    """

    name: str
    statement: str
    remedy: str
    correct: Callable[[GonioData, Sample], Corrected | None]
    about_noise: bool = False


def _divided(factor_of: Callable[[GonioData], np.ndarray]):
    """Divides the values by a factor of each point, with and without the noise that is stated for them."""

    def correct(data: GonioData, sample: Sample) -> Corrected:
        factor = factor_of(data)
        usable = np.isfinite(factor)
        factor = np.where(usable, factor, 1.0)
        mask = data.mask | np.where(usable, 0, USER.bit).astype(np.uint32)
        kept = data.replace(bsdf_per_sr=data.bsdf_per_sr / factor, mask=mask)
        if data.sigma_per_sr is not None and sample.noise.use_file_sigma:
            scaled = kept.replace(sigma_per_sr=data.sigma_per_sr / factor)
            return Corrected(scaled, sample, noise_as_stated=(kept, sample))
        if not sample.noise.floor_per_sr:
            return Corrected(kept, sample)
        floor = sample.noise.floor_per_sr / float(np.exp(np.mean(np.log(factor[usable]))))
        noise = dataclasses.replace(sample.noise, floor_per_sr=floor)
        scaled_sample = dataclasses.replace(sample, noise=noise)
        return Corrected(kept, scaled_sample, noise_as_stated=(kept, sample))

    return correct


def _cosine(data: GonioData) -> np.ndarray:
    """Cosine of the angle of view; nan where it is too small to be divided by."""
    cosine = np.cos(np.deg2rad(data.theta_o_deg))
    return np.where(cosine < _LEAST_COSINE, np.nan, cosine)


def _constant(factor: float):
    return lambda data: np.full(len(data), factor)


def _inverse_cosine(data: GonioData) -> np.ndarray:
    return 1 / _cosine(data)


def _phi_turned(data: GonioData, sample: Sample) -> Corrected:
    turned = np.where(data.phi_deg > 0, data.phi_deg - 180, data.phi_deg + 180)
    return Corrected(data.replace(phi_deg=turned), sample)


def _sides_exchanged(data: GonioData, sample: Sample) -> Corrected:
    return Corrected(data.replace(is_transmission=~data.is_transmission), sample)


def _numbers_of_angles(data: GonioData) -> tuple[int, int]:
    """Number of different values of theta_i and of theta_o."""
    return np.unique(data.theta_i_deg).size, np.unique(data.theta_o_deg).size


def source_is_scanned(data: GonioData) -> bool:
    """Whether theta_i takes many values and theta_o few, which is usual the other way round."""
    incidences, views = _numbers_of_angles(data)
    return incidences >= max(_FEWEST_SCANNED, _MORE_SCANNED * views)


def _angles_exchanged(data: GonioData, sample: Sample) -> Corrected | None:
    """Reflection is reciprocal, so that only transmission shows it, through a sample without symmetry."""
    incidences, views = _numbers_of_angles(data)
    if views > _MORE_SCANNED * incidences:
        # As a goniometer scans: the detector.
        return None
    exchanged = data.replace(theta_i_deg=data.theta_o_deg, theta_o_deg=data.theta_i_deg)
    grazing = np.cos(np.deg2rad(exchanged.theta_i_deg)) < _LEAST_COSINE
    mask = data.mask | np.where(grazing, USER.bit, 0).astype(np.uint32)
    return Corrected(exchanged.replace(mask=mask), sample)


def _other_side(data: GonioData, sample: Sample) -> Corrected | None:
    turned = turned_over(sample)
    return None if turned is None or turned.layers == sample.layers else Corrected(data, turned)


def _sigma(power: int):
    """Standard deviations multiplied by a power of the value."""

    def correct(data: GonioData, sample: Sample) -> Corrected | None:
        if data.sigma_per_sr is None or not sample.noise.use_file_sigma:
            return None
        value = np.abs(data.bsdf_per_sr)
        usable = value > 0
        sigma = data.sigma_per_sr * np.where(usable, value, 1.0) ** power
        mask = data.mask | np.where(usable, 0, USER.bit).astype(np.uint32)
        return Corrected(data.replace(sigma_per_sr=sigma, mask=mask), sample)

    return correct


# The program of the declared fit serves all of these: they change numbers, not the structure.
OF_DATA = (
    Hypothesis(
        "times_cosine",
        "The values read like BSDF x cos(theta_o)",
        "divide bsdf_per_sr by cos(theta_o)",
        _divided(_cosine),
    ),
    Hypothesis(
        "divided_by_cosine",
        "The values read like BSDF / cos(theta_o)",
        "multiply bsdf_per_sr by cos(theta_o)",
        _divided(_inverse_cosine),
    ),
    Hypothesis(
        "times_pi",
        "The values read like pi x BSDF, a radiance or reflectance factor",
        "divide bsdf_per_sr by pi",
        _divided(_constant(np.pi)),
    ),
    Hypothesis(
        "divided_by_pi",
        "The values read like BSDF / pi",
        "multiply bsdf_per_sr by pi",
        _divided(_constant(1 / np.pi)),
    ),
    Hypothesis(
        "per_cent",
        "The values read like 100 x BSDF, in per cent",
        "divide bsdf_per_sr by 100",
        _divided(_constant(_PERCENT)),
    ),
    Hypothesis(
        "reflectance_factor_in_per_cent",
        "The values read like 100 pi x BSDF, a reflectance factor in per cent",
        "divide bsdf_per_sr by 100 pi",
        _divided(_constant(_PERCENT * np.pi)),
    ),
    Hypothesis(
        "phi_turned",
        "The azimuth reads as if it were turned by 180 degrees",
        "add 180 degrees to phi_deg: 180 is the half-plane of the specular direction, 0 that of the source",
        _phi_turned,
    ),
    Hypothesis(
        "sides_exchanged",
        "R and T read as if they were exchanged",
        "exchange R and T in the column side",
        _sides_exchanged,
    ),
)
OF_SIGMA = (
    Hypothesis(
        "sigma_relative",
        "sigma_per_sr reads like a relative standard deviation",
        "multiply sigma_per_sr by bsdf_per_sr: it is absolute, in 1/sr",
        _sigma(1),
        about_noise=True,
    ),
    Hypothesis(
        "sigma_times_value",
        "sigma_per_sr reads as if it had been multiplied by the value",
        "divide sigma_per_sr by bsdf_per_sr: it is absolute, in 1/sr",
        _sigma(-1),
        about_noise=True,
    ),
)
# Each of these needs a program of its own.
LIT_FROM_OTHER_SIDE = Hypothesis(
    "lit_from_other_side",
    "The sample reads as if it were lit from the other side",
    "list the layers in the opposite order, from the illuminated side on",
    _other_side,
)
ANGLES_EXCHANGED = Hypothesis(
    "angles_exchanged",
    "theta_i and theta_o read as if they were exchanged",
    "exchange the columns theta_i_deg and theta_o_deg",
    _angles_exchanged,
)


def of_lengths(sample: Sample) -> Iterator[Hypothesis]:
    """Thicknesses off by 10^3 that the file fixes and that matter; all share one program."""
    table = sample.parameters
    named = ((layer, f"{layer.name}.thickness_{unit}") for layer in sample.layers for unit in ("um", "mm"))
    declared = {
        name: table[name].value
        for layer, name in named
        if name in table and table[name].is_fixed and table[name].value > 0 and _matters(layer, sample)
    }
    for name, value in declared.items():
        table = table.replace(name, free=True, minimum=value / _SPAN, maximum=value * _SPAN, scale="log")
    opened = dataclasses.replace(sample, parameters=table)
    for name, value in declared.items():
        layer, unit = name.rpartition(".thickness_")[::2]
        for factor, much in ((_THOUSAND, "small"), (1 / _THOUSAND, "large")):
            yield Hypothesis(
                f"thickness_of_{layer}_too_{much}",
                f"The thickness of {layer}, {value:g} {unit}, reads as if it were off by 1000: "
                f"{value * factor:g} {unit}",
                f"check the unit of the thickness of {layer}",
                with_values_held(opened, declared | {name: value * factor}),
            )


def with_values_held(opened: Sample, held: Mapping[str, float]) -> Callable[[GonioData, Sample], Corrected]:
    """Correction by a sample some of whose free parameters are held at values."""
    return lambda data, _: Corrected(data, opened, held=held)


def _matters(layer, sample: Sample) -> bool:
    """Whether the thickness of a layer has any effect."""
    absorption = sample.parameters.get(f"{layer.name}.absorption_per_mm")
    is_clear = absorption is not None and absorption.is_fixed and absorption.value == 0
    return layer.scatters or not is_clear or sample.beam_diameter_mm is not None
