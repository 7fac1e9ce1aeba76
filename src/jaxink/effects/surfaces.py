"""Effects of surfaces: rough faces, films, gaps, and reliefs."""

import dataclasses

import jax
import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.kinds import AreaWithOtherSample, Inapplicable, SampleEffect, UnevenSurface
from jaxink.effects.sample_edits import with_face, with_film, with_parameters
from jaxink.errors import InputRefusedError
from jaxink.sample import Parameter, Roughness, Sample, terms_of
from jaxink.surfaces import FacetExchange, facet_averages, mirrored_once, reflected_once, regular_share

# Densities of slopes.
_IN_WORDS = {"cauchy": "Cauchy", "beckmann": "Beckmann", "ggx": "GGX"}
_NO_OUTER_FACE = "there is no outer face of an ink that is declared smooth"


def _plate_ink_contact(sample: Sample) -> int | None:
    """Number of layers in front of the first face between a plate and an ink; None if there is none."""
    scatters = [layer.scatters for layer in sample.layers]
    contacts = (k + 1 for k in range(len(scatters) - 1) if scatters[k] != scatters[k + 1])
    return next(contacts, None)


def _outer_ink_face(sample: Sample, effect: str) -> int:
    """Number of layers in front of the outer face of an ink."""
    layers = sample.layers
    if layers[0].scatters:
        return 0
    if layers[-1].scatters and not layers[-1].opaque:
        return len(layers)
    raise InputRefusedError(f"[effects.{effect}] needs an ink with an outer face, and the sample has none.")


def exposed_faces(sample: Sample) -> dict[str, tuple[int, str]]:
    """Faces declared smooth that may be rough: (layer, face) by the name of the effect."""
    layers = sample.layers
    faces: dict[str, tuple[int, str]] = {}
    ends = ((0, "front_roughness"), (len(layers) - 1, "back_roughness"))
    for position, face in ends:
        layer = layers[position]
        if face == "back_roughness" and layer.opaque:
            continue
        faces.setdefault("rough_ink" if layer.scatters else "rough_plate", (position, face))
    for k in range(len(layers) - 1):
        names = (f"{layer.name}.refractive_index" for layer in layers[k : k + 2])
        here, there = (sample.parameters.get(name) for name in names)
        if here is not None and there is not None and here.value != there.value:
            faces.setdefault("rough_contact", (k, "back_roughness"))
    return {
        name: (position, face)
        for name, (position, face) in faces.items()
        if all(r.face != face for r in layers[position].roughness)
    }


@dataclasses.dataclass(frozen=True)
class _RoughFace(SampleEffect):
    """A face that was declared smooth is rough; facets (geometrical optics)."""

    layer: str
    face: str
    density: str

    group, changes_structure = "surface", True

    @property
    def numbered(self):
        density = _IN_WORDS[self.density]
        return f"{self.statement}: its slopes have a {density} density with an angle of {{sigma_deg}}"

    @classmethod
    def forms(cls, case: Case):
        """One for each density of slopes."""
        faces = exposed_faces(case.sample)
        if cls.name not in faces:
            return Inapplicable(
                "there is no such face between different media, or it is already declared rough"
            )
        position, face = faces[cls.name]
        layer = case.sample.layers[position].name
        return tuple(cls(layer, face, density) for density in ("cauchy", "beckmann", "ggx"))

    @property
    def is_screened(self) -> bool:
        """The screen cannot distinguish the densities; refits try all of them."""
        return self.density == "cauchy"

    @property
    def terms(self):
        """The angle of the density. The screen uses a share of the area that is rough by a given angle."""
        angle = f"{self.layer}.{self.face}.sigma_deg"
        return (Parameter(angle, 0.0, True, 0.2, 25.0, "deg", scale="log"),)

    @property
    def settings(self):
        return tuple({self.strength.name: angle} for angle in (1.0, 3.0, 9.0))

    def extend(self, sample: Sample) -> Sample:
        rough = Roughness(self.face, self.density, None, f"{self.layer}.{self.face}")
        return with_parameters(with_face(sample, self.layer, rough), self.strength)


class RoughInk(_RoughFace):
    """The ink's outer face."""

    name = "rough_ink"
    statement = "the outer face of the ink is rough"


class RoughPlate(_RoughFace):
    """The plate's outer face."""

    name = "rough_plate"
    statement = "the outer face of the plate is rough"


class RoughContact(_RoughFace):
    """A face between two layers of different index."""

    name = "rough_contact"
    statement = "the face between plate and ink is rough"


@dataclasses.dataclass(frozen=True)
class SlopeTail(SampleEffect):
    """The slope density of a declared rough face has another tail."""

    face: Roughness
    density: str

    name, group, changes_structure = "slope_tail", "surface", True
    statement = "the tail of the slope density of the rough face differs from the declared one"
    numbered = (
        "{second_weight%} of the rough face has another slope density, with an angle of {second_sigma_deg}"
    )

    @classmethod
    def forms(cls, case: Case):
        """A heavy tail added to the declared density; for GGX a Gaussian core."""
        rough = [r for layer in case.sample.layers for r in layer.roughness if r.density is not None]
        rough = [r for r in rough if r.second_density is None and r.nodes is None]
        if not rough:
            return Inapplicable("no face is declared rough with a single density of slopes")
        return tuple(cls(rough[0], d) for d in ("ggx", "beckmann") if d != rough[0].density)[:1]

    @property
    def terms(self):
        """Share of the second density and its angle."""
        stem = self.face.name
        return (
            Parameter(f"{stem}.second_weight", 0.0, True, 0.0, 1.0),
            Parameter(f"{stem}.second_sigma_deg", 8.0, True, 0.5, 30.0, "deg", scale="log"),
        )

    @property
    def settings(self):
        return tuple({self.terms[1].name: angle, self.terms[0].name: 0.2} for angle in (3.0, 12.0))

    def extend(self, sample: Sample) -> Sample:
        rough = dataclasses.replace(self.face, second_density=self.density)
        return with_parameters(with_face(sample, self.face.name.split(".")[0], rough), *self.terms)


@dataclasses.dataclass(frozen=True)
class WaveSurface(SampleEffect):
    """A face scatters by its surface heights, treated by wave optics."""

    layer: str
    face: str

    name, group, changes_structure = "wave_surface", "surface", True
    statement = "the surface heights of a face scatter light (wave optics)"
    numbered = (
        "the surface heights of a face scatter light (wave optics): their root mean square is "
        "{height_rms_um}, and their spectrum bends at the inverse of {length_b_um} and falls with an "
        "exponent of {exponent}"
    )

    @classmethod
    def forms(cls, case: Case):
        if np.unique(case.scene.wavelength_nm).size < 2:
            return "one wavelength cannot distinguish wave optics from facets; see rough_ink and rough_plate"
        faces = exposed_faces(case.sample)
        outer = next((faces[n] for n in ("rough_ink", "rough_plate") if n in faces), None)
        if outer is None:
            return Inapplicable("there is no outer face that is declared smooth")
        return (cls(case.sample.layers[outer[0]].name, outer[1]),)

    @property
    def terms(self):
        """Height, length and exponent of a K-correlation spectrum."""
        stem = f"{self.layer}.{self.face}"
        return (
            Parameter(f"{stem}.height_rms_um", 0.0, True, 0.001, 2.0, "um", scale="log"),
            Parameter(f"{stem}.length_b_um", 5.0, True, 0.3, 100.0, "um", scale="log"),
            Parameter(f"{stem}.exponent", 3.0, True, 2.05, 10.0, scale="log"),
        )

    @property
    def settings(self):
        """Heights and lengths: two below saturation, one that scatters most of the light."""
        height, length, _ = (t.name for t in self.terms)
        return tuple({height: h, length: b} for h, b in ((0.02, 2.0), (0.02, 8.0), (0.15, 8.0)))

    def extend(self, sample: Sample) -> Sample:
        stem = f"{self.layer}.{self.face}"
        rough = Roughness(self.face, None, None, stem, "k_correlation", "perturbation")
        return with_parameters(with_face(sample, self.layer, rough), *self.terms)


@dataclasses.dataclass(frozen=True)
class TopCoat(AreaWithOtherSample):
    """A gloss film of another refractive index covers a share of the ink's outer face."""

    position: int

    name, group, usual = "top_coat", "surface", 1.0
    statement = "a film of another refractive index covers the ink"
    numbered = "a film of refractive index {refractive_index} covers {share%} of the ink"
    terms = terms_of("top_coat")
    # All of the area, with a film of low and of high index.
    settings = tuple({"top_coat.share": 1.0, "top_coat.refractive_index": n} for n in (1.3, 1.75))

    @classmethod
    def forms(cls, case: Case):
        faces = exposed_faces(case.sample)
        if "rough_ink" not in faces:
            return _NO_OUTER_FACE
        position, face = faces["rough_ink"]
        return (cls(position + (face == "back_roughness")),)

    @classmethod
    def of_sample(cls, sample, position=None):
        """By default on the outer face of the ink, even if that is rough."""
        return cls(_outer_ink_face(sample, cls.name) if position is None else position)

    def other(self, sample: Sample) -> Sample:
        index = self.terms[1]
        return with_parameters(with_film(sample, self.position, "top_coat", index.value), index)


@dataclasses.dataclass(frozen=True)
class AirGap(AreaWithOtherSample):
    """A share of the area has air between plate and ink."""

    position: int

    name, group, usual = "air_gap", "surface", 0.05
    statement = "there is air between plate and ink"
    numbered = "there is air between plate and ink on {share%} of the area"
    terms = terms_of("air_gap")
    settings = ({"air_gap.share": 1.0},)

    @classmethod
    def forms(cls, case: Case):
        position = _plate_ink_contact(case.sample)
        return Inapplicable("no plate is in contact with the ink") if position is None else (cls(position),)

    @classmethod
    def of_sample(cls, sample, position=None):
        """By default where the first plate and ink meet."""
        position = _plate_ink_contact(sample) if position is None else position
        if position is None:
            raise InputRefusedError(
                "[effects.air_gap] needs a plate in contact with the ink, and the sample has none."
            )
        return cls(position)

    def other(self, sample: Sample) -> Sample:
        return with_film(sample, self.position, "air_gap_layer", 1.0)


@dataclasses.dataclass(frozen=True)
class WeakInterface(SampleEffect):
    """The ink's outer face reflects less than its refractive index implies, as a graded or porous one does.

    If the ink is the only layer, it gets an effective index between that of the surroundings and the declared
    one. Otherwise its outer face gets a film of such an index, that is two smaller steps.
    """

    layer: str
    position: int
    is_single: bool

    name, group, usual = "weak_interface", "surface", 0.5
    statement = "the ink's outer face reflects less than its refractive index implies (graded or porous)"
    numbered = (
        "the step of the refractive index at the ink's outer face is {share%} smaller (graded or porous)"
    )

    @classmethod
    def forms(cls, case: Case):
        layers = case.sample.layers
        faces = exposed_faces(case.sample)
        if "rough_ink" not in faces:
            return _NO_OUTER_FACE
        position, face = faces["rough_ink"]
        name = f"{layers[position].name}.refractive_index"
        if name not in case.sample.parameters:
            return Inapplicable("the ink's index depends on the wavelength")
        if case.declared(name) <= 1.0 + 1e-9:
            return Inapplicable("the ink already has the index of air")
        end = position + (face == "back_roughness")
        return (cls(layers[position].name, end, len(layers) == 1),)

    @classmethod
    def of_sample(cls, sample):
        position = _outer_ink_face(sample, cls.name)
        ink = sample.layers[0 if position == 0 else -1].name
        index = sample.parameters.get(f"{ink}.refractive_index")
        if index is None or (len(sample.layers) == 1 and not index.is_fixed):
            raise InputRefusedError(
                f"[effects.weak_interface] needs one refractive index of '{ink}' for all wavelengths, fixed "
                "if the ink is the only layer."
            )
        return cls(ink, position, len(sample.layers) == 1)

    @property
    def form(self):
        return {}

    @property
    def changes_structure(self) -> bool:
        """Only a film changes it."""
        return not self.is_single

    @property
    def terms(self):
        """1 - (n_eff - 1) / (n - 1)."""
        (share,) = terms_of("weak_interface")
        return (share if self.is_single else dataclasses.replace(share, maximum=0.6),)

    @property
    def settings(self):
        """The derivative if the ink is the only layer; otherwise a film with half of the step."""
        return ({},) if self.is_single else ({"weak_interface.share": 0.5},)

    def extend(self, sample: Sample) -> Sample:
        """With an index, or a film, tied to the strength."""
        name = f"{self.layer}.refractive_index"
        start = float(sample.parameters.values_with({})[name])
        # The only layer's own index is tied; it cannot occur in its tie.
        declared = repr(start) if self.is_single else name
        tie = f"{declared} - weak_interface.share * ({declared} - 1)"
        target = self.layer if self.is_single else "weak_interface_film"
        if not self.is_single:
            sample = with_film(sample, self.position, target, start)
        index = Parameter(f"{target}.refractive_index", np.nan, False, 1.0, 4.0, "", tie)
        return with_parameters(sample, self.strength, index)


SURFACES = (RoughInk, RoughPlate, RoughContact, SlopeTail, TopCoat, AirGap, WaveSurface, WeakInterface)


@dataclasses.dataclass(frozen=True)
class Relief(UnevenSurface):
    """An opaque ink has a relief of facets that are large against the distances that light travels in it."""

    # Not ``scales``: a face mirrors light into lobes that widen with the variance.
    name = "relief"
    statement = "the surface of the ink is a relief of facets, each of which reflects as the ink does"
    numbered = (
        "the surface of the ink is a relief of facets, each of which reflects as the ink does, with a "
        "variance of the slope of {slope_variance}"
    )
    terms = terms_of("relief")
    settings = tuple({"relief.slope_variance": variance} for variance in (0.005, 0.03, 0.2))

    @classmethod
    def forms(cls, case: Case):
        return _why_without(case.sample) or (cls(),)

    @classmethod
    def of_sample(cls, sample):
        if reason := _why_without(sample):
            raise InputRefusedError(f"[effects.relief] does not suit this sample: {reason}.")
        return cls()

    def shape(self, plane, values):
        """Facets in place of the plane surface: the change by the series, added to the BSDF."""
        variance = values["relief.slope_variance"]
        here = plane.hemisphere
        averages = facet_averages(here.pairs, variance)
        once = reflected_once(here.pairs, here.wave, plane.coefficients, averages, variance)
        exchanged = FacetExchange.of(plane.coefficients, plane.mirror, variance).at(here.theta_deg, here.wave)
        mirrored = mirrored_once(here.pairs, jax.tree.map(lambda x: x[here.wave], plane.mirror), variance)
        bsdf = plane.bsdf + once.facets - once.plane + exchanged + mirrored
        return plane._replace(bsdf=bsdf, regular=plane.regular * regular_share(variance))


def _why_without(sample: Sample) -> str:
    """Why a sample cannot have a relief; empty if it can."""
    layers = sample.layers
    if not (layers[0].scatters and layers[-1].opaque):
        return Inapplicable("a relief is computed for an opaque ink without a plate in front of it")
    if any(layer.roughness for layer in layers):
        return Inapplicable("a face of the ink is declared rough, and both together are not computed")
    if sample.source_half_angle_deg or sample.detector_half_angle_deg:
        return Inapplicable("the source or the detector has a cone, with which a relief is not computed")
    return ""


RELIEF = (Relief,)
