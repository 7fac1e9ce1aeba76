"""Effects of geometry: areas that differ, light outside the detector's field, an object behind the sample."""

import dataclasses

import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.kinds import AreaWithOtherValues, Inapplicable, ReadingEffect, SampleEffect
from jaxink.effects.sample_edits import ink_of, with_parameters
from jaxink.errors import InputRefusedError
from jaxink.sample import Backing, Layer, Parameter, Sample, terms_of

# A varying thickness is represented by areas that are thinner and thicker than the mean by this share.
_THICKNESS_STEP = 0.5


@dataclasses.dataclass(frozen=True)
class LateralLoss(SampleEffect):
    """Light leaves the sample outside the field of the detector."""

    thickness_mm: float

    name, group, changes_structure = "lateral_loss", "geometry", True
    statement = "light leaves the sample outside the field of the detector"
    numbered = (
        "light leaves the sample outside the field of the detector, which is "
        "{detector_diameter_mm} wide, with a beam of {beam_diameter_mm}"
    )

    # Diameters of field and beam; in the declared model the field has its largest width.
    terms = (
        Parameter("instrument.detector_diameter_mm", 1e3, True, 0.3, 1e3, "mm", scale="log"),
        Parameter("instrument.beam_diameter_mm", 2.0, True, 0.1, 1e3, "mm", scale="log"),
    )

    @classmethod
    def forms(cls, case: Case):
        if case.sample.beam_diameter_mm is not None:
            return Inapplicable("beam and field of view are declared")
        if not case.plates:
            return Inapplicable("there is no plate in which light could spread laterally")
        thickness = max(case.declared(f"{p.name}.thickness_mm") for p in case.plates)
        return (cls(thickness),)

    @property
    def settings(self):
        """Fields a few plate thicknesses wide, with beams half as wide, and one with a narrow beam.

        With a narrow beam a wide field only misses light that travelled far in the plate, which resembles
        absorption.
        """
        detector, beam = (t.name for t in self.terms)
        widths = ((4.0, 2.0), (15.0, 7.5), (50.0, 25.0), (15.0, 2.0))
        return tuple({detector: d * self.thickness_mm, beam: b * self.thickness_mm} for d, b in widths)

    def extend(self, sample: Sample) -> Sample:
        changed = dataclasses.replace(sample, beam_diameter_mm=2.0, detector_diameter_mm=1e3)
        return with_parameters(changed, *self.terms)


_NO_OWN_THICKNESS = "the ink is opaque, or its thickness is tied or depends on the wavelength"


def _has_own_thickness(sample: Sample, ink: Layer) -> bool:
    thickness = sample.parameters.get(f"{ink.name}.thickness_um")
    return thickness is not None and thickness.tie is None


@dataclasses.dataclass(frozen=True)
class _OtherThickness(AreaWithOtherValues):
    """The thickness of the ink is not uniform."""

    layer: str

    @classmethod
    def forms(cls, case: Case):
        ink = case.inks[0]
        return (cls(ink.name),) if _has_own_thickness(case.sample, ink) else _NO_OWN_THICKNESS

    @classmethod
    def of_sample(cls, sample, layer=None):
        found = ink_of(sample, cls.name, layer)
        if not _has_own_thickness(sample, found):
            raise InputRefusedError(
                f"[effects.{cls.name}] does not suit '{found.name}': {_NO_OWN_THICKNESS}."
            )
        return cls(found.name)

    def _times(self, factor, values):
        """The ink with a multiple of its thickness."""
        name = f"{self.layer}.thickness_um"
        return {name: values[name] * factor}


class ThinPatches(_OtherThickness):
    """A share of the area has ink of another thickness."""

    name, usual = "thin_patches", 0.1
    statement = "a share of the area has ink of another thickness"
    numbered = "{share%} of the area has ink of {thickness_ratio} times the thickness"
    terms = terms_of("thin_patches")
    settings = tuple(
        {"thin_patches.thickness_ratio": ratio, "thin_patches.share": 0.2} for ratio in (0.05, 0.2, 0.5, 1.8)
    )

    def mixture(self, values):
        ratio = values["thin_patches.thickness_ratio"]
        return [(values["thin_patches.share"], self._times(ratio, values))]


class ThicknessVariance(_OtherThickness):
    """The thickness varies around its mean; the strength is its relative variance."""

    name, usual = "thickness_variance", 0.02
    statement = "the thickness of the ink varies"
    numbered = "the thickness of the ink varies, with a relative variance of {relative}"
    terms = terms_of("thickness_variance")
    settings = ({"thickness_variance.relative": 0.1},)

    def mixture(self, values):
        """Equal areas with half and one and a half times the thickness that have this variance."""
        share = values["thickness_variance.relative"] / (2 * _THICKNESS_STEP**2)
        # The second area also takes its share of the first one.
        thin = (share / (1 - share), self._times(1 - _THICKNESS_STEP, values))
        return [thin, (share, self._times(1 + _THICKNESS_STEP, values))]


@dataclasses.dataclass(frozen=True)
class Pinholes(ReadingEffect):
    """A share of the area has no ink; it scatters nothing, so its BSDF is zero outside the regular peaks."""

    name, group, usual = "pinholes", "geometry", 0.01
    statement = "a share of the area has no ink"
    numbered = "{share%} of the area has no ink"
    terms = terms_of("pinholes")

    def change(self, predicted, values, field):
        """Return f (1 - s)."""
        return predicted * (1 - values["pinholes.share"])


@dataclasses.dataclass(frozen=True)
class UndeclaredBacking(SampleEffect):
    """An object behind the sample reflects light during the scans in reflection."""

    name, group, usual = "backing", "geometry", 0.05
    statement = "an object behind the sample reflects light"
    numbered = "an object behind the sample reflects {reflectance%} of the light"
    terms = (Parameter("backing.reflectance", 0.0, True, 0.0, 1.0),)

    @classmethod
    def forms(cls, case: Case):
        if case.sample.backing is not None:
            return Inapplicable("a backing is declared")
        if case.is_opaque:
            return Inapplicable("the sample is opaque")
        if np.all(case.scene.is_transmission):
            return "reflection was not measured"
        return (cls(),)

    def extend(self, sample: Sample) -> Sample:
        """With a backing, separated by air, during the scans in reflection."""
        return with_parameters(dataclasses.replace(sample, backing=Backing("R", False)), self.terms[0])


GEOMETRY = (LateralLoss, ThinPatches, ThicknessVariance, Pinholes, UndeclaredBacking)
