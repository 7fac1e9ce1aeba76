"""The light guide's part of render.md."""

import textwrap

import numpy as np

from benchmarks.pages import table

_QUARTERS = 4


def guide_section(found: dict) -> str:
    """Text with the numbers of `benchmarks.validation.render.guide`."""
    thin, contact, gap, white = (found[case] for case in ("thin", "contact", "gap", "white"))
    shift = white["lights"]["sheet"]["xy_far_less_near"]
    shift_x, shift_y = (
        f"{value:+.4f} ± {error:.4f}"
        for value, error in zip(shift["value"], shift["standard_error"], strict=True)
    )
    rows = [
        [what, name, *_numbers(case["lights"][name])]
        for what, case in (
            ("20 um, printed well", thin),
            ("70 um, corrected model, printed well", contact),
            ("70 um, corrected model, with its gap", gap),
        )
        for name in case["lights"]
    ]
    heads = ["ink", "dots", "luminance, % of the lamp's", "flux out / in, %", "least / largest column"]
    quarters = [
        [f"{first + 1} to {last}", *(_quarter(case, first, last) for case in (thin, contact))]
        for first, last in _bounds(len(thin["lights"]["sheet"]["luminance_of_columns"]["value"]))
    ]
    compared = [
        [
            f"{one['thickness_um']:g}",
            f"{one['radius_mm']:g}",
            *(f"{value:.4f} ± {error:.4f}" for value, error in (one["paths"], one["mitsuba"])),
            _difference(*one["paths"], *one["mitsuba"]),
        ]
        for one in found["dots"].values()
    ]
    cost = contact["comparisons"]["uncorrected_over_sheet_less_1"]["mean_luminance"]
    thin_ratio, thick_ratio = (
        case["comparisons"]["sheet_over_volume_less_1"]["mean_luminance"] for case in (thin, contact)
    )
    flux = {
        name: contact["lights"][name]["flux_out_over_flux_in"]["value"] for name in ("sheet", "uncorrected")
    }
    dark = gap["lights"]["sheet"]["flux_out_over_flux_in"]
    words = "\n".join(textwrap.wrap(f"a {thin['guide']['words']}", 110))
    return f"""## The light guide

![Light guide with sheets, with volumes and with the uncorrected model](../lightguide.png)

`jaxink render` ([scene and numbers](../manual/rendering.md)), by `python -m
benchmarks.validation.render.guide`:
{words}.
All inks are simulated. The picture is that of the corrected ink of 70 um.

{table(heads, rows)}

± is one standard error, from {thin["effort"]["batches"]} and {contact["effort"]["batches"]} batches.

**Sheets against volumes.** The aim is agreement within 2 %. The luminance of sheets over that of volumes,
less 1, is {_percent(thin_ratio)} with dots of 20 um, and {_percent(thick_ratio)} with dots of 70 um: thick
dots miss the aim because of their rim, which a sheet does not have. Light leaves through it into the air
and is no longer guided. The same by columns of dots; of the thin ones, one quarter is above 2 %, by about
one standard error:

{table(["columns", "20 um, %", "70 um, %"], quarters)}

**What an undeclared gap of air costs.** The measurement `undeclared_air_gap` has air between plate and ink,
which its sample file does not declare. The declared model's best fit has a reduced chi-square of 776;
jaxink says so, and its asymmetry parameter ends at its bound. The diagnosis finds the gap (reduced
chi-square 0.87). Whoever prints this ink in contact with a guide and computes it with the uncorrected fit
expects a luminance that is wrong by {_percent(cost)}, and a flux of {100 * flux["uncorrected"]:.1f} %
instead of {100 * flux["sheet"]:.1f} %. Whoever prints it with the same gap gets {100 * dark["value"]:.2f} ±
{100 * dark["standard_error"]:.2f} % of the flux: light from the edge is totally reflected before the gap,
and what is left comes from the area in contact, which the diagnosis puts at 0.14 ± 0.11 %.

**Colour along the guide.** Spheres of rutile (radius 110 nm, 4 % of the volume, 20 um thick) scatter blue
light more than red, and dots near the lamp take it first. Under a lamp of the spectrum D65 from 440 to 680
nm, in 13 wavelengths, the chromaticity of the last 15 % of the guide less that of the first is {shift_x}
in x and {shift_y} in y (sheets).

**The volumes.** They are traced by jaxink in double precision, with nothing of the solver but coefficients
and phase function. The independent check is Mitsuba's `volpath` for one dot at the origin: the share of
diffuse light in the plate that returns into it, with the light that the rim sends up.

{table(["thickness, um", "radius, mm", "jaxink", "Mitsuba", "difference, %"], compared)}

A whole guide cannot be traced by Mitsuba's scalar variants. They have single precision and go on at a
distance from each face of 9e-5 times the coordinate, 4.5 um at 50 mm, where a mean free path in these inks
is 3 to 14 um. Plates of ink in trials 50 mm from the origin reflected less than the solver says, the less
the thinner the ink, and at the origin as much. The booth below shows the same."""


def _numbers(light: dict) -> list[str]:
    def shown(name, factor=1.0, digits=3):
        value, error = (factor * light[name][key] for key in ("value", "standard_error"))
        return f"{value:.{digits}f} ± {error:.{digits}f}"

    return [shown("mean_luminance", 100), shown("flux_out_over_flux_in", 100, 2), shown("uniformity_columns")]


def _bounds(n: int) -> list[tuple[int, int]]:
    ends = np.linspace(0, n, _QUARTERS + 1).astype(int).tolist()
    return list(zip(ends[:-1], ends[1:], strict=True))


def _quarter(case: dict, first: int, last: int) -> str:
    means, errors = [], []
    for name in ("sheet", "volume"):
        columns = case["lights"][name]["luminance_of_columns"]
        means.append(np.mean(columns["value"][first:last]))
        errors.append(np.sqrt(np.sum(np.square(columns["standard_error"][first:last]))) / (last - first))
    ratio = means[0] / means[1]
    error = ratio * np.hypot(errors[0] / means[0], errors[1] / means[1])
    return f"{100 * (ratio - 1):+.1f} ± {100 * error:.1f}"


def _difference(value: float, error: float, other: float, other_error: float) -> str:
    relative = np.hypot(error / value, other_error / other)
    return f"{100 * (value / other - 1):+.2f} ± {100 * value / other * relative:.2f}"


def _percent(one: dict) -> str:
    return f"{100 * one['value']:+.1f} ± {100 * one['standard_error']:.1f} %"
