"""Effects of layers, faces and geometry: the sample is not what was declared."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from jaxink.effects.effect import Case, Effect, freed, with_layer, with_parameters
from jaxink.sample import Backing, Layer, Parameter, Roughness, Sample

_NOT_MIE = "the ink is not made of Mie particles, so nothing of the kind has a parameter"


# Declared constants -----------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class _Constant(Effect):
    """A number that the sample file gives as fixed is wrong."""

    term: Parameter

    sign, group = 0, "constant"

    @property
    def terms(self):
        """The number itself; the strength is its distance from the declared value."""
        return (self.term,)

    def extend(self, sample: Sample) -> Sample:
        """The structure for a number that is not what was declared: where indices differ, blocks do."""
        return with_parameters(sample, self.term)

    @classmethod
    def _of(cls, case: Case, layer: Layer | None, key: str, limits) -> "tuple[Effect, ...] | str":
        name = None if layer is None else f"{layer.name}.{key}"
        if name is None or name not in case.sample.parameters:
            return "the sample has no such number, or one for each wavelength"
        if case.sample.parameters[name].free:
            return f"{name} is free already"
        low, high = limits(case.declared(name))
        return (cls(freed(case.sample, name, low, high)),)


def _index_limits(declared):
    return max(1.0, declared - 0.35), declared + 0.35


def _factor_limits(declared):
    return declared / 4, declared * 4


class _Index(_Constant):
    """A refractive index; where it may vary, the channels are more, so both share a program of their own."""

    own_program, is_scalable, program = True, True, "indices"

    @property
    def settings(self):
        """A step to the side where there is room for it."""
        return ({self.term.name: self.term.value + 0.02},)


class BinderIndex(_Index):
    """Refractive index of the ink's binder."""

    name, keys = "binder_index", ("E14",)
    usual = 0.03
    statement = "the refractive index of the binder is not the declared one"

    @classmethod
    def forms(cls, case):
        """Where another interface than that to the surroundings is seen, or the index is higher."""
        return cls._of(case, case.inks[0], "refractive_index", _index_limits)


class PlateIndex(_Index):
    """Refractive index of the plate."""

    name = "plate_index"
    usual = 0.02
    statement = "the refractive index of the plate is not the declared one"

    @classmethod
    def forms(cls, case):
        """Where there is a plate."""
        return cls._of(case, next(iter(case.plates), None), "refractive_index", _index_limits)


class PlateAbsorption(_Constant):
    """Absorption of the plate."""

    name, keys, sign = "plate_absorption", ("E11",), 1
    usual = 0.01
    statement = "the plate absorbs more than declared"

    @classmethod
    def forms(cls, case):
        """Where there is a plate."""
        plate = next(iter(case.plates), None)
        return cls._of(case, plate, "absorption_per_mm", lambda declared: (declared, declared + 5.0))


class InkThickness(_Constant):
    """Thickness of the ink."""

    name = "ink_thickness"
    statement = "the ink is not as thick as declared"

    @classmethod
    def forms(cls, case):
        """Unless it is opaque."""
        return cls._of(case, case.inks[0], "thickness_um", _factor_limits)


class PlateThickness(_Constant):
    """Thickness of the plate."""

    name = "plate_thickness"
    statement = "the plate is not as thick as declared"

    @classmethod
    def forms(cls, case):
        """Where light can tell: it absorbs, or light is lost sideways."""
        plate = next(iter(case.plates), None)
        if plate is None:
            return "there is no plate"
        absorbs = case.declared(f"{plate.name}.absorption_per_mm") > 0
        if not absorbs and case.sample.beam_diameter_mm is None:
            return (
                "the plate neither absorbs nor does the detector miss light, so its thickness has no effect"
            )
        return cls._of(case, plate, "thickness_mm", _factor_limits)


# Surfaces ---------------------------------------------------------------------------------------------


def exposed_faces(sample: Sample) -> dict[str, tuple[int, str]]:
    """Faces that may be rough: effect name to (layer, face), of those declared smooth."""
    layers, faces = sample.layers, {}
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
class _RoughFace(Effect):
    """S1, S2: a face that was declared smooth is rough; facets."""

    layer: str
    face: str
    density: str

    own_program, group, keys = True, "surface", ("E1",)

    @classmethod
    def forms(cls, case: Case):
        """One for each density of slopes."""
        faces = exposed_faces(case.sample)
        if cls.name not in faces:
            return "there is no such face between different media, or it is declared rough already"
        position, face = faces[cls.name]
        layer = case.sample.layers[position].name
        return tuple(cls(layer, face, density) for density in ("cauchy", "beckmann", "ggx"))

    @property
    def is_screened(self) -> bool:
        """The densities look alike to a screen; refits try them all."""
        return self.density == "cauchy"

    @property
    def _angle(self) -> str:
        return f"{self.layer}.{self.face}.sigma_deg"

    @property
    def terms(self):
        """The angle of the density. The screen uses a share of the area that is rough by a given angle."""
        return (Parameter(self._angle, 0.0, True, 0.2, 25.0, "deg", scale="log"),)

    @property
    def settings(self):
        """Angles."""
        return tuple({self._angle: angle} for angle in (1.0, 3.0, 9.0))

    def extend(self, sample: Sample) -> Sample:
        """With a rough face."""
        rough = Roughness(self.face, self.density, None, f"{self.layer}.{self.face}")
        return with_parameters(_with_face(sample, self.layer, rough), self.terms[0])


def _with_face(sample: Sample, layer: str, face: Roughness) -> Sample:
    layers = tuple(
        dataclasses.replace(one, roughness=(*(r for r in one.roughness if r.face != face.face), face))
        if one.name == layer
        else one
        for one in sample.layers
    )
    return dataclasses.replace(sample, layers=layers)


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
class SlopeTail(Effect):
    """S3: the slopes of a declared rough face have another tail than its density."""

    face: Roughness
    density: str

    name, own_program, group = "slope_tail", True, "surface"
    statement = "the slopes of the rough face have another tail than declared"

    @classmethod
    def forms(cls, case: Case):
        """A Gaussian core or a heavy tail beside the declared density."""
        rough = [r for layer in case.sample.layers for r in layer.roughness if r.density is not None]
        rough = [r for r in rough if r.second_density is None and r.nodes is None]
        if not rough:
            return "no face is declared rough by a single density of slopes"
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
        """Angles of the second density."""
        return tuple({self.terms[1].name: angle, self.terms[0].name: 0.2} for angle in (3.0, 12.0))

    def extend(self, sample: Sample) -> Sample:
        """With a second density."""
        rough = dataclasses.replace(self.face, second_density=self.density)
        return with_parameters(_with_face(sample, self.face.name.split(".")[0], rough), *self.terms)


@dataclasses.dataclass(frozen=True)
class WaveSurface(Effect):
    """S6: a face scatters by its heights, as waves do."""

    layer: str
    face: str

    name, own_program, group = "wave_surface", True, "surface"
    statement = "a face scatters by the waves of its heights"

    @classmethod
    def forms(cls, case: Case):
        """Only where several wavelengths tell it from facets."""
        if np.unique(case.scene.wavelength_nm).size < 2:
            return "one wavelength does not tell waves from facets; see rough_ink and rough_plate"
        faces = exposed_faces(case.sample)
        outer = next((faces[n] for n in ("rough_ink", "rough_plate") if n in faces), None)
        if outer is None:
            return "no outer face is declared smooth"
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
        """Heights and lengths: two too small to saturate, one that scatters most of the light."""
        height, length, _ = (t.name for t in self.terms)
        return tuple({height: h, length: b} for h, b in ((0.02, 2.0), (0.02, 8.0), (0.15, 8.0)))

    def extend(self, sample: Sample) -> Sample:
        """With a spectrum of heights."""
        stem = f"{self.layer}.{self.face}"
        rough = Roughness(self.face, None, None, stem, "k_correlation", "perturbation")
        return with_parameters(_with_face(sample, self.layer, rough), *self.terms)


@dataclasses.dataclass(frozen=True)
class TopCoat(Effect):
    """S4: a gloss film of another index covers a share of the ink's outer face."""

    position: int

    name, own_program, group = "top_coat", True, "surface"
    usual = 1.0
    statement = "a film of another refractive index lies on the ink"

    @classmethod
    def forms(cls, case: Case):
        """A film of low and of high index."""
        faces = exposed_faces(case.sample)
        if "rough_ink" not in faces:
            return "no outer face of an ink is declared smooth"
        position, face = faces["rough_ink"]
        position += face == "back_roughness"
        return (cls(position),)

    @property
    def terms(self):
        """Share of the area that is covered, and the film's index."""
        return (
            Parameter("top_coat.share", 0.0, True, 0.0, 1.0),
            Parameter("top_coat_film.refractive_index", 1.3, True, 1.05, 2.2),
        )

    @property
    def settings(self):
        """All of it, of a low and of a high index."""
        share, index = (t.name for t in self.terms)
        return tuple({share: 1.0, index: n} for n in (1.3, 1.75))

    def other(self, sample: Sample) -> Sample:
        """With the film."""
        film = with_clear(sample, self.position, "top_coat_film", self.terms[1].value)
        return with_parameters(film, self.terms[1])


def with_clear(sample: Sample, position: int, name: str, index: float) -> Sample:
    """The sample with a film that does not absorb at a position."""
    numbers = {"refractive_index": index, "thickness_mm": 0.01, "absorption_per_mm": 0.0}
    new = (Parameter(f"{name}.{key}", value) for key, value in numbers.items())
    return with_layer(sample, position, Layer(name, "clear"), *new)


@dataclasses.dataclass(frozen=True)
class AirGap(Effect):
    """S5: a share of the area has air between plate and ink."""

    position: int

    name, own_program, group, keys = "air_gap", True, "surface", ("E15",)
    usual = 0.05
    statement = "there is air between plate and ink"

    @classmethod
    def forms(cls, case: Case):
        """Where a plate touches an ink."""
        layers = case.sample.layers
        for k in range(len(layers) - 1):
            if layers[k].scatters != layers[k + 1].scatters:
                return (cls(k + 1),)
        return "no plate touches the ink"

    @property
    def terms(self):
        """Share of the area with a gap."""
        return (Parameter("air_gap.share", 0.0, True, 0.0, 1.0),)

    @property
    def settings(self):
        """All of it."""
        return ({"air_gap.share": 1.0},)

    def other(self, sample: Sample) -> Sample:
        """With a gap."""
        return with_clear(sample, self.position, "air_gap_layer", 1.0)


@dataclasses.dataclass(frozen=True)
class WeakInterface(Effect):
    """S7: the ink's outer face reflects less than its index says, graded or porous.

    An ink that touches nothing but the surroundings has an effective index between theirs and the declared
    one; the face of an ink on a plate has a film of such an index, that is two smaller steps.
    """

    layer: str
    position: int
    declared: float
    alone: bool

    name, group = "weak_interface", "surface"
    usual = 0.5
    statement = "the ink's outer face reflects less than its refractive index says, as a graded or porous one"

    @classmethod
    def forms(cls, case: Case):
        """For the outer face of an ink."""
        layers = case.sample.layers
        faces = exposed_faces(case.sample)
        if "rough_ink" not in faces:
            return "no outer face of an ink is declared smooth"
        position, face = faces["rough_ink"]
        name = f"{layers[position].name}.refractive_index"
        if name not in case.sample.parameters:
            return "the ink's index depends on the wavelength"
        declared = case.declared(name)
        if declared <= 1.0 + 1e-9:
            return "the ink has the index of air already"
        end = position + (face == "back_roughness")
        return (cls(layers[position].name, end, declared, len(layers) == 1),)

    @property
    def own_program(self) -> bool:
        """A film changes the structure."""
        return not self.alone

    @property
    def terms(self):
        """1 - (n_eff - 1) / (n - 1)."""
        return (Parameter("weak_interface.share", 0.0, True, 0.0, 1.0 if self.alone else 0.6),)

    @property
    def settings(self):
        """The derivative for an ink alone; a film half way down else."""
        return ({},) if self.alone else ({"weak_interface.share": 0.5},)

    def extend(self, sample: Sample) -> Sample:
        """With an index, or a film, that follows the strength."""
        tie = f"{self.declared} - weak_interface.share * {self.declared - 1}"
        target = f"{self.layer if self.alone else 'weak_interface_film'}.refractive_index"
        if not self.alone:
            sample = with_clear(sample, self.position, "weak_interface_film", self.declared)
        index = Parameter(target, np.nan, False, 1.0, 4.0, "", tie)
        return with_parameters(sample, self.terms[0], index)


# Volume -----------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class SecondLobe(Effect):
    """V6: a second lobe of the phase function."""

    layer: str

    name, group, keys = "second_lobe", "volume", ("E10",)
    usual = 0.1
    statement = "the phase function has a second lobe"

    @classmethod
    def forms(cls, case: Case):
        """For a Henyey-Greenstein ink."""
        ink = case.inks[0]
        if ink.phase_function != "henyey_greenstein":
            return "the phase function is not Henyey and Greenstein's"
        return (cls(ink.name),)

    @property
    def terms(self):
        """Share of the scattering in it, and its asymmetry."""
        return (
            Parameter(f"{self.layer}.second_weight", 0.0, True, 0.0, 0.6),
            Parameter(f"{self.layer}.second_asymmetry_parameter", -0.4, True, -0.9, 0.97),
        )

    @property
    def settings(self):
        """Asymmetries."""
        return tuple({self.terms[1].name: g} for g in (-0.8, -0.4, 0.0, 0.4, 0.8, 0.95))

    def extend(self, sample: Sample) -> Sample:
        """With two terms."""
        return with_parameters(_changed(sample, self.layer, phase_function=_TWO_TERMS), *self.terms)


_TWO_TERMS = "two_term_henyey_greenstein"


def _changed(sample: Sample, layer: str, **changes) -> Sample:
    layers = tuple(dataclasses.replace(x, **changes) if x.name == layer else x for x in sample.layers)
    return dataclasses.replace(sample, layers=layers)


@dataclasses.dataclass(frozen=True)
class _MieTerm(Effect):
    """A further number of a Mie ink that is zero at the declared model."""

    layer: str

    group = "volume"
    key = ""
    maximum = 1.0
    unit = ""

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink that does not have it."""
        mie = [ink for ink in case.inks if ink.phase_function == "mie" and ink.radius_table is None]
        if not mie:
            return _NOT_MIE
        if case.each(f"{mie[0].name}.{cls.key}"):
            return f"{mie[0].name}.{cls.key} is declared already"
        return (cls(mie[0].name),)

    @property
    def terms(self):
        """The number itself."""
        return (Parameter(f"{self.layer}.{self.key}", 0.0, True, 0.0, self.maximum, self.unit),)

    def extend(self, sample: Sample) -> Sample:
        """With the number."""
        return with_parameters(sample, self.terms[0])


class Polydispersity(_MieTerm):
    """V2: the particles' sizes are spread, log-normal; the strength is the variance of ln(radius)."""

    name, keys, key, maximum = "polydispersity", ("E2",), "radius_variance_ln", 0.25
    usual = 0.07
    own_program, is_scalable = True, True
    statement = "the particles are not of one size"

    @property
    def settings(self):
        """A tenth and a third of the radius."""
        return tuple({self.terms[0].name: v} for v in (0.01, 0.09))


class StructureFactor(_MieTerm):
    """V1: particles so dense that they scatter dependently (hard spheres)."""

    name, keys, key = "structure_factor", ("E3",), "structure_factor_weight"
    usual = 1.0
    own_program, is_scalable = True, True
    statement = "the particles are too dense to scatter independently"

    @property
    def settings(self):
        """The whole factor."""
        return ({self.terms[0].name: 1.0},)


class InkAbsorption(_MieTerm):
    """V5: the binder absorbs."""

    name, key, maximum, unit = "ink_absorption", "binder_absorption_per_mm", 50.0, "1/mm"
    statement = "the binder of the ink absorbs"

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink; others have a coefficient of their own, free or fixed."""
        ink = case.inks[0]
        if ink.phase_function == "mie":
            return super().forms(case)
        names = case.each(f"{ink.name}.absorption_per_mm") or case.each(
            f"{ink.name}.single_scattering_albedo"
        )
        if any(case.sample.parameters[n].free for n in names):
            return "the absorption of the ink is a free parameter already"
        name = f"{ink.name}.absorption_per_mm"
        if name not in names:
            return "the ink's albedo is declared, of which absorption is a part"
        return (_DeclaredAbsorption(freed(case.sample, name, *_absorption_limits(case.declared(name)))),)


def _absorption_limits(declared):
    return declared, declared + 50.0


class _DeclaredAbsorption(_Constant):
    """V5 of an ink with coefficients."""

    name, sign, group = "ink_absorption", 1, "volume"
    statement = "the ink absorbs more than declared"


@dataclasses.dataclass(frozen=True)
class SecondPopulation(Effect):
    """V3: a second kind of particles, of the same material and another size."""

    layer: str
    index: float

    name, own_program, group = "second_population", True, "volume"
    statement = "there are particles of a second size"

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink with one kind."""
        ink = case.inks[0]
        if ink.phase_function != "mie":
            return _NOT_MIE + "; second_lobe stands for a second kind of particles"
        names = case.each(f"{ink.name}.particle_index")
        if ink.populations or not names:
            return "there are several kinds of particles already, or their index has a dispersion"
        return (cls(ink.name, case.declared(names[0])),)

    @property
    def terms(self):
        """Volume fraction and radius."""
        stem = f"{self.layer}.second"
        return (
            Parameter(f"{stem}.volume_fraction", 0.0, True, 0.0, 0.3),
            Parameter(f"{stem}.radius_nm", 1000.0, True, 20.0, 3000.0, "nm", scale="log"),
        )

    @property
    def settings(self):
        """Small and large ones."""
        share, radius = (t.name for t in self.terms)
        return ({share: 0.01, radius: 60.0}, {share: 0.005, radius: 600.0}, {share: 0.01, radius: 2000.0})

    def extend(self, sample: Sample) -> Sample:
        """With a second population."""
        from jaxink.sample import Population

        stem = f"{self.layer}.second"
        constants = {"particle_index": self.index, "particle_absorption_index": 0.0}
        new = (Parameter(f"{stem}.{key}", value) for key, value in constants.items())
        changed = _changed(sample, self.layer, populations=(Population("second"),))
        return with_parameters(changed, *self.terms, *new)


@dataclasses.dataclass(frozen=True)
class DepthGradient(_Constant):
    """V4: the ink scatters more towards one side; two halves."""

    term: Parameter
    layer: str

    name, own_program, is_scalable, group = "depth_gradient", True, True, "volume"
    splits = True
    usual = 0.5
    statement = "the ink's scattering changes with depth"

    @classmethod
    def forms(cls, case: Case):
        """For an ink that light passes, with one concentration for all wavelengths."""
        ink = case.inks[0]
        key = "volume_fraction" if ink.phase_function == "mie" else "scattering_per_mm"
        if ink.opaque or ink.populations:
            return "the ink is opaque, or has several kinds of particles"
        if any(n.startswith(f"{ink.name}.") and "@" in n for n in case.sample.parameters):
            return "the ink has a parameter for each wavelength, which its halves could not follow"
        if f"{ink.name}.{key}" not in case.sample.parameters:
            return "the ink has no concentration of its own that could change with depth"
        if ink.roughness and len(ink.roughness) > 1:
            return "the ink has two rough faces"
        slope = Parameter("depth_gradient.slope", 0.0, True, -1.5, 1.5)
        return (cls(slope, ink.name),)

    @property
    def settings(self):
        """Half as much more."""
        return ({self.term.name: 0.5},)

    def extend(self, sample: Sample) -> Sample:
        """Two halves, whose concentrations follow the strength; all else follows the declared layer."""
        position = next(k for k, one in enumerate(sample.layers) if one.name == self.layer)
        ink = sample.layers[position]
        key = "volume_fraction" if ink.phase_function == "mie" else "scattering_per_mm"
        halves, new = [], [self.term]
        for part, sign, face in (("upper", "-", "front_roughness"), ("lower", "+", "back_roughness")):
            name = f"{self.layer}_{part}"
            rough = tuple(
                dataclasses.replace(r, name=f"{name}.{r.face}") for r in ink.roughness if r.face == face
            )
            halves.append(dataclasses.replace(ink, name=name, roughness=rough))
            for own in [p for p in sample.parameters if p.startswith(f"{self.layer}.")]:
                rest = own.split(".", 1)[1]
                if rest.split(".")[0] in ("front_roughness", "back_roughness") and not rest.startswith(face):
                    continue
                tie = own
                if rest == key:
                    tie = f"{own} * (1 {sign} depth_gradient.slope / 2)"
                elif rest == "thickness_um":
                    tie = f"{own} / 2"
                new.append(
                    dataclasses.replace(
                        sample.parameters[own],
                        name=f"{name}.{rest}",
                        value=np.nan,
                        free=False,
                        tie=tie,
                        prior=None,
                        minimum=-np.inf,
                        maximum=np.inf,
                    )
                )
        layers = (*sample.layers[:position], *halves, *sample.layers[position + 1 :])
        return with_parameters(dataclasses.replace(sample, layers=layers), *new)


@dataclasses.dataclass(frozen=True)
class ShadowHiding(Effect):
    """V7: near the source no particle sees the shadow of another.

    The strength B0 multiplies the reflected BSDF by 1 + B0 / (1 + tan(psi / 2) / h), psi the angle from the
    source; all of it instead of its first order, which it overstates for bright samples.
    """

    name, group = "shadow_hiding", "volume"
    usual = 0.2
    statement = "the reflection is enhanced around the source, as by hidden shadows"

    terms = (
        Parameter("shadow_hiding.amplitude", 0.0, True, 0.0, 1.0),
        Parameter("shadow_hiding.width", 0.05, True, 0.01, 0.4, scale="log"),
    )

    @classmethod
    def forms(cls, case: Case):
        """Where reflection was measured."""
        reflects = ~case.scene.is_transmission
        near = np.asarray(case.scene.from_retro_deg)[reflects]
        if not np.any(near < 20):
            return "no point in reflection lies within 20 degrees of the source"
        return (cls(),)

    @property
    def settings(self):
        """Widths."""
        return tuple({self.terms[1].name: h} for h in (0.03, 0.1, 0.3))

    def change(self, predicted, values, field):
        """See the class."""
        lobe = 1 / (1 + jnp.tan(jnp.deg2rad(field.scene.from_retro_deg) / 2) / values["shadow_hiding.width"])
        reflects = ~field.scene.is_transmission
        return predicted * (1 + values["shadow_hiding.amplitude"] * lobe * reflects)


# Geometry ---------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class LateralLoss(Effect):
    """G1: light comes out beside the field of the detector."""

    thickness_mm: float

    name, own_program, group, keys = "lateral_loss", True, "geometry", ("E9",)
    statement = "light comes out beside the field that the detector sees"

    @classmethod
    def forms(cls, case: Case):
        """Where plates let light walk sideways."""
        if case.sample.beam_diameter_mm is not None:
            return "beam and field are declared"
        if not case.plates:
            return "there is no plate in which light would walk sideways"
        thickness = max(case.declared(f"{p.name}.thickness_mm") for p in case.plates)
        return (cls(thickness),)

    @property
    def terms(self):
        """Diameters of the field and of the beam; the strength is 1 / diameter of the field."""
        return (
            Parameter("instrument.detector_diameter_mm", 1e3, True, 0.3, 1e3, "mm", scale="log"),
            Parameter("instrument.beam_diameter_mm", 2.0, True, 0.1, 1e3, "mm", scale="log"),
        )

    @property
    def settings(self):
        """Fields of a few thicknesses of the plate, with beams half as wide, and a narrow beam.

        A wide field misses of a narrow beam what went far in the plate, as if the plate absorbed it.
        """
        detector, beam = (t.name for t in self.terms)
        widths = ((4.0, 2.0), (15.0, 7.5), (50.0, 25.0), (15.0, 2.0))
        return tuple({detector: d * self.thickness_mm, beam: b * self.thickness_mm} for d, b in widths)

    def extend(self, sample: Sample) -> Sample:
        """With a beam and a field."""
        changed = dataclasses.replace(sample, beam_diameter_mm=2.0, detector_diameter_mm=1e3)
        return with_parameters(changed, *self.terms)


@dataclasses.dataclass(frozen=True)
class _Thicknesses(Effect):
    """Base of effects by which the ink is not equally thick everywhere."""

    layer: str

    group, own_program, program = "geometry", True, "thicknesses"

    @classmethod
    def forms(cls, case: Case):
        """Unless the ink is opaque."""
        ink = case.inks[0]
        return "the ink is opaque" if ink.opaque else (cls(ink.name),)

    def _thicker(self, values, factor):
        name = f"{self.layer}.thickness_um"
        return {name: values[name] * factor}


class ThinPatches(_Thicknesses):
    """G2 with two thicknesses: a share of the area has another thickness."""

    name, keys = "thin_patches", ("E4",)
    usual = 0.1
    statement = "a share of the area carries ink of another thickness"
    terms = (
        Parameter("thin_patches.share", 0.0, True, 0.0, 0.6),
        Parameter("thin_patches.thickness_ratio", 0.4, True, 0.02, 3.0, scale="log"),
    )

    @property
    def settings(self):
        """Ratios of the thicknesses."""
        return tuple({self.terms[1].name: r, self.terms[0].name: 0.2} for r in (0.05, 0.2, 0.5, 1.8))

    def mixture(self, values):
        """Two areas."""
        ratio = values["thin_patches.thickness_ratio"]
        return [(values["thin_patches.share"], self._thicker(values, ratio))]


class ThicknessVariance(_Thicknesses):
    """G2: the thickness varies around its mean; the strength is its relative variance."""

    name = "thickness_variance"
    usual = 0.02
    statement = "the thickness of the ink varies"
    terms = (Parameter("thickness_variance.relative", 0.0, True, 0.0, 0.2),)
    _SPREAD = 0.5

    @property
    def settings(self):
        """A relative variance of 0.1."""
        return ({self.terms[0].name: 0.1},)

    def mixture(self, values):
        """The same variance by areas half as thick and half as thick again."""
        share = values["thickness_variance.relative"] / (2 * self._SPREAD**2)
        # The second share is taken of all that the first one left.
        thin = (share / (1 - share), self._thicker(values, 1 - self._SPREAD))
        return [thin, (share, self._thicker(values, 1 + self._SPREAD))]


@dataclasses.dataclass(frozen=True)
class Pinholes(Effect):
    """G3: a share of the area carries no ink: what is left scatters less, the rest is regular."""

    name, group = "pinholes", "geometry"
    usual = 0.01
    statement = "a share of the area carries no ink"
    terms = (Parameter("pinholes.share", 0.0, True, 0.0, 0.6),)

    def change(self, predicted, values, field):
        """Return f (1 - s): a clear area has no BSDF beside the regular peaks."""
        return predicted * (1 - values["pinholes.share"])


@dataclasses.dataclass(frozen=True)
class UndeclaredBacking(Effect):
    """G4: something behind the sample reflects during the scans in reflection."""

    name, group, keys = "backing", "geometry", ("E5",)
    usual = 0.05
    statement = "something behind the sample reflects light"
    terms = (Parameter("backing.reflectance", 0.0, True, 0.0, 1.0),)

    @classmethod
    def forms(cls, case: Case):
        """Where light gets through, and reflection was measured."""
        if case.sample.backing is not None:
            return "a backing is declared"
        if case.is_opaque:
            return "the sample is opaque"
        if np.all(case.scene.is_transmission):
            return "reflection was not measured"
        return (cls(),)

    def extend(self, sample: Sample) -> Sample:
        """With a backing in air during the scans in reflection."""
        return with_parameters(dataclasses.replace(sample, backing=Backing("R", False)), self.terms[0])


SAMPLE = (
    RoughInk,
    RoughPlate,
    RoughContact,
    SlopeTail,
    TopCoat,
    AirGap,
    WaveSurface,
    WeakInterface,
    StructureFactor,
    Polydispersity,
    SecondPopulation,
    DepthGradient,
    InkAbsorption,
    SecondLobe,
    ShadowHiding,
    LateralLoss,
    ThinPatches,
    ThicknessVariance,
    Pinholes,
    UndeclaredBacking,
    BinderIndex,
    PlateIndex,
    PlateAbsorption,
    InkThickness,
    PlateThickness,
)
