"""Keys of the tables ``[effects.NAME]`` of a sample file, and the parameters that they stand for.

Effects that are properties of a layer have keys there instead; see docs/manual/sample-file.md.
"""

import dataclasses
import math
from collections.abc import Mapping

from jaxink.sample.parameters import Parameter
from jaxink.sample.schema import Entry, Quantity

_POSITIVE = (1e-12, 1e12)


@dataclasses.dataclass(frozen=True)
class EffectKeys:
    """Keys of one effect.

    Parameters
    ----------
    numbers
        Its parameters, the strength first; those with a default may be absent.
    form
        What is no parameter: in which form the effect is present; all of it may be absent unless the entry
        says that it is required.
    """

    numbers: dict[str, Quantity]
    form: Mapping[str, Quantity | Entry] = dataclasses.field(default_factory=dict)


def _relative(meaning: str) -> EffectKeys:
    return EffectKeys({"relative": Quantity("", -0.5, 0.5, meaning=meaning)})


def _angle(meaning: str) -> EffectKeys:
    return EffectKeys({"angle_deg": Quantity("deg", -4.0, 4.0, meaning=meaning)})


def _level(meaning: str) -> EffectKeys:
    return EffectKeys({"level_per_sr": Quantity("1/sr", 0.0, 1.0, meaning=meaning)})


def _step(what: str) -> EffectKeys:
    meaning = f"share of the step to one and a half times as many {what}"
    return EffectKeys({"share": Quantity("", -3.0, 3.0, meaning=meaning)})


_INK = {"layer": Entry("name", "the first scattering layer", "the ink")}
_FULL_SCALE = Quantity(
    "1/sr",
    *_POSITIVE,
    otherwise="the largest of the points",
    meaning="signal v_max; a fit and a diagnosis write the value they used",
)
_ROW = "a fit and a diagnosis write the row they used"
_POSITION = "number of layers in front of it, seen from the illuminated side"
EFFECTS: dict[str, EffectKeys] = {
    "angle_offset": _angle("true angle of view minus its label in reflection; in transmission its negative"),
    "incidence_angle": _angle("true angle of incidence minus its label"),
    "blur": EffectKeys(
        {
            "core_variance_deg2": Quantity("deg^2", 0.0, 9.0, 0.0, meaning="variance of the Gaussian core"),
            "wing_share": Quantity("", 0.0, 0.5, 0.0, meaning="share of the power in Cauchy wings"),
            "wing_half_width_deg": Quantity("deg", 1.0, 20.0, 4.0, meaning="half-width of the wings"),
        }
    ),
    "gain": _relative("s in y = (1 + s) f"),
    "side_gain": _relative("s in y = (1 + s) f, in reflection only"),
    "stray_light": _level("constant added to the BSDF"),
    "signal_floor": _level("s in y = f + s / cos(theta_o)"),
    "nonlinearity": EffectKeys(
        {"relative": Quantity("", -0.5, 0.5, meaning="s in y = f (1 + s v / v_max), v = f cos(theta_o)")},
        {"full_scale_per_sr": _FULL_SCALE},
    ),
    "drift": EffectKeys(
        {"relative": Quantity("", -0.5, 0.5, meaning="s in y = f (1 + s t), t from -1/2 to 1/2")},
        {
            "first_row": Quantity(
                "", 0, 1e12, otherwise="the first of the points", meaning=f"t = -1/2; {_ROW}"
            ),
            "last_row": Quantity("", 0, 1e12, otherwise="the last of the points", meaning=f"t = 1/2; {_ROW}"),
        },
    ),
    "top_coat": EffectKeys(
        {
            "share": Quantity("", 0.0, 1.0, meaning="share of the area that the film covers"),
            "refractive_index": Quantity("", 1.05, 2.2, 1.3, meaning="of the film"),
        },
        {"position": Entry("integer", "the ink's outer face", f"of the film: {_POSITION}")},
    ),
    "air_gap": EffectKeys(
        {"share": Quantity("", 0.0, 1.0, meaning="share of the area with air between plate and ink")},
        {"position": Entry("integer", "between plate and ink", f"of the gap: {_POSITION}")},
    ),
    "weak_interface": EffectKeys(
        {"share": Quantity("", 0.0, 1.0, meaning="1 - (n_eff - 1) / (n - 1), n_eff of the graded face")}
    ),
    "relief": EffectKeys(
        {"slope_variance": Quantity("", 0.0, 0.5, meaning="variance of the facets' slope along each axis")}
    ),
    "thin_patches": EffectKeys(
        {
            "share": Quantity("", 0.0, 0.6, meaning="share of the area with the other thickness"),
            "thickness_ratio": Quantity("", 0.02, 3.0, 0.4, "log", meaning="its thickness over the declared"),
        },
        _INK,
    ),
    "thickness_variance": EffectKeys(
        {"relative": Quantity("", 0.0, 0.2, meaning="relative variance of the ink's thickness")}, _INK
    ),
    "pinholes": EffectKeys({"share": Quantity("", 0.0, 0.6, meaning="share of the area without ink")}),
    "depth_gradient": EffectKeys(
        {
            "slope": Quantity(
                "",
                -1.5,
                1.5,
                meaning="scattering of the half away from the light minus that of the half towards it, over "
                "their mean",
            ),
            "asymmetry_slope": Quantity(
                "", -1.5, 1.5, 0.0, meaning="the same of (1 - g) / (1 + g), g being the asymmetry parameter"
            ),
        },
        _INK,
    ),
    "surface_layer": EffectKeys(
        {
            "optical_thickness": Quantity("", 0.0, 5.0, meaning="of the layer, scattering and absorption"),
            "asymmetry_parameter": Quantity("", -0.9, 0.95, 0.0, meaning="of its Henyey–Greenstein function"),
            "single_scattering_albedo": Quantity("", 0.0, 1.0, 0.995, "one_minus", meaning="of the layer"),
        },
        {"layer": Entry("name", "the first scattering layer", "the ink, opaque")},
    ),
    "shadow_hiding": EffectKeys(
        {
            "amplitude": Quantity("", 0.0, 1.0, meaning="B0"),
            "width": Quantity("", 0.01, 0.4, 0.05, "log", meaning="h of 1 + B0 / (1 + tan(psi / 2) / h)"),
        }
    ),
    "fluorescence": EffectKeys(
        {
            "quantum_yield": Quantity(
                "",
                0.0,
                1.0,
                meaning="photons emitted for each that the ink absorbs at an exciting wavelength",
            ),
            "excitation": Quantity(
                "", 0.0, 1.0, 1.0, spectral=True, meaning="share of the absorbed photons that excite"
            ),
            "emission": Quantity(
                "",
                0.0,
                1.0,
                spectral=True,
                meaning="share of the photons emitted at this or a longer wavelength that this one has",
            ),
            "absorption_below_per_mm": Quantity(
                "1/mm",
                0.0,
                1e6,
                0.0,
                meaning="of exciting light shorter than all of `wavelength_nm`, as far as `illumination` "
                "contains it",
            ),
        },
        _INK,
    ),
    "coherent_backscatter": EffectKeys(
        {
            "enhancement": Quantity("", 0.0, 1.0, meaning="relative height of the peak towards the source"),
            "half_width_deg": Quantity("deg", 0.05, 2.5, 0.5, "log", meaning="w of 1 / (1 + psi / w)^2"),
        }
    ),
    "polarisation": EffectKeys(
        {
            "share": Quantity(
                "", 0.0, 4.0, meaning="of what polarisation changes in light scattered once and twice"
            )
        }
    ),
    "dispersion": EffectKeys(
        {"b_um2": Quantity("um^2", -0.02, 0.04, meaning="Cauchy's B of the binder's refractive index")},
        {
            **_INK,
            "middle_nm": Quantity(
                "nm", 100.0, 1e5, otherwise="required", meaning="wavelength of the declared index"
            ),
        },
    ),
    "interference": EffectKeys(
        {
            "amplitude": Quantity("", 0.0, 0.5, meaning="of the fringes"),
            "phase_rad": Quantity("rad", -math.pi, math.pi, 0.0, meaning="of the fringes"),
        },
        {
            "thickness_um": Quantity("um", 1e-3, 100.0, otherwise="required", meaning="of the thin layer"),
            "refractive_index": Quantity("", 1.0, 4.0, otherwise="required", meaning="of the thin layer"),
        },
    ),
    "solver_streams": _step("streams"),
    "solver_moments": _step("moments of the phase function"),
    "solver_orders": _step("azimuthal orders"),
}
# Where effects are declared that have no table of their own.
ELSEWHERE = {
    "rough_ink": "front_roughness or back_roughness of the ink's layer",
    "rough_plate": "front_roughness or back_roughness of the plate's layer",
    "rough_contact": "back_roughness of the layer in front of the face",
    "slope_tail": "second_density of the rough face",
    "wave_surface": "a spectrum in front_roughness or back_roughness of the layer",
    "structure_factor": "structure_factor_weight of the ink's layer",
    "polydispersity": "radius_variance_ln of the ink's layer",
    "second_population": "[[layers.populations]] of the ink's layer",
    "ink_absorption": "absorption_per_mm of the ink's layer, or binder_absorption_per_mm if it consists of "
    "Mie particles",
    "second_lobe": 'phase_function = "two_term_henyey_greenstein" of the ink\'s layer',
    "lateral_loss": "beam_diameter_mm and detector_diameter_mm of [instrument]",
    "backing": "[backing]",
    "binder_index": "refractive_index of the ink's layer",
    "plate_index": "refractive_index of the plate's layer",
    "plate_absorption": "absorption_per_mm of the plate's layer",
    "ink_thickness": "thickness_um of the ink's layer",
    "plate_thickness": "thickness_mm of the plate's layer",
}


def defaults_of(effect: str) -> tuple[Parameter, ...]:
    """The parameters that a table may leave out and that have one value for all wavelengths."""
    numbers = EFFECTS[effect].numbers
    return tuple(
        term
        for term, q in zip(terms_of(effect), numbers.values(), strict=True)
        if q.default is not None and not q.spectral
    )


def terms_of(effect: str) -> tuple[Parameter, ...]:
    """The parameters of an effect, free within the range of their keys; the strength is 0."""
    return tuple(
        Parameter(
            f"{effect}.{key}",
            0.0 if q.default is None else q.default,
            True,
            q.lowest,
            q.highest,
            q.unit,
            scale=q.scale,
        )
        for key, q in EFFECTS[effect].numbers.items()
    )
