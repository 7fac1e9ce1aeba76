"""The booth's part of render.md."""

import textwrap

import numpy as np

from benchmarks.pages import table
from benchmarks.validation.render.booth import BODIES, CHECKED, SHOWN

# The aims: luminance in per cent, x and y.
_LUMINANCE, _XY = 1.0, 0.001
_UNIFORM = "uniform light"
_COVERAGE = 2


def booth_section(found: dict) -> str:
    """Text with the numbers of `benchmarks.validation.render.booth`."""
    inks = {name: one for name, one in found.items() if name not in (_UNIFORM, *BODIES)}
    bodies = {name: found[name] for name in BODIES if name in found}
    known, seen = found[_UNIFORM]["known"], {k: v for k, v in found[_UNIFORM].items() if k != "known"}
    checked = [
        [way, f"{value:.5f} ± {error:.5f}", f"{100 * (value / known - 1):+.2f} ± {100 * error / known:.2f}"]
        for way, (value, error) in seen.items()
    ]
    shown = inks[SHOWN]
    batches = ", ".join(f"{one['effort']['batches']} for `{name}`" for name, one in inks.items())
    words = "\n".join(textwrap.wrap(f"{shown['booth']['words']}.", 110))
    heads = ["ink", "way", "luminance, % of the white body's", "x", "y"]
    return f"""## The booth

![Sphere of printed plate as a sheet, as a solid and as a volume](../sphere.png)

`jaxink render --scene sphere` ([ways and numbers](../manual/rendering.md#the-booth)), by `python -m
benchmarks.validation.render.booth`:
{words}
Numbers are those of the centre of the sphere. The light is D65 within the band of each ink: 550 nm alone for
the white inks, which have no chromaticity, and 570 to 630 nm for `coloured_ink`. All inks are simulated, with
smooth faces. Mitsuba 3, variant `scalar_rgb`, renders each wavelength by itself. The picture is that of
`{SHOWN}`.

{table(heads, _centre(inks))}

{table(["ink", "ways", "luminance, %", "x", "y"], _compared(inks))}

± is one standard error, from batches with seeds of their own:
{batches}. The second eight of `white_ink_rough` were
added because the first eight had put the sheet 1.80 ± 0.75 % below the volume.

{_verdict(inks)}

**Other bodies** of `{CHECKED}`, a flat disc that faces the camera and a torus, of which the point that is
evaluated is on the outer equator and seen at 40 degrees; its faces are meshes of half a million triangles:

![Torus of printed plate as a sheet, as a solid and as a volume](../torus.png)

{table(["body", "way", "luminance, % of the white body's"], [row[:3] for row in _centre(bodies)])}

{table(["body", "ways", "luminance, %"], [row[:3] for row in _compared(bodies)])}

{_verdict(bodies)}

**Uniform light.** In light of radiance 1 from everywhere, the radiance along the normal of a flat plate is
its directional-hemispherical reflectance, which the solver knows: {known:.5f} for `{CHECKED}`. The sphere in
uniform light:

{table(["way", "radiance", "difference, %"], checked)}

The last row has the centre of the sphere at the origin, so that the face that is looked at is 20 mm away from
it, and nothing else is different: single precision makes the same volume darker. Mitsuba's scalar variants go
on at a distance from each face of 9e-5 (1 + the largest coordinate), in units of the scene. That is 1.8 um at
20 mm, and a mean free path in this ink is 1.7 um. So the point that is evaluated is the origin, in a spot of
0.2 mm, with a unit of 0.05 mm, where the step is some 0.02 um. Towards the outline of the sphere, where the
step is larger, the picture of the volume must be expected to be too dark."""


def _centre(rendered: dict) -> list[list[str]]:
    """Luminance and chromaticity of each way."""
    return [
        [f"`{name}`", way, _shown(light["luminance_over_white_body"], 100, 2), *_xy(light["xy"])]
        for name, one in rendered.items()
        for way, light in one["lights"].items()
    ]


def _compared(rendered: dict) -> list[list[str]]:
    """Differences between the ways."""
    return [
        [
            f"`{name}`",
            pair.replace("_", " "),
            _shown(differences["luminance_ratio_less_1"], 100, 2, "+"),
            *_xy(differences["xy_difference"], "+"),
        ]
        for name, one in rendered.items()
        for pair, differences in one["comparisons"].items()
    ]


def _shown(one: dict, factor: float = 1.0, digits: int = 4, sign: str = "") -> str:
    value, error = factor * one["value"], factor * one["standard_error"]
    return f"{value:{sign}.{digits}f} ± {error:.{digits}f}"


def _xy(one: dict | None, sign: str = "") -> list[str]:
    if one is None:
        return ["", ""]
    both = zip(one["value"], one["standard_error"], strict=True)
    return [_shown({"value": value, "standard_error": error}, sign=sign) for value, error in both]


def _verdict(inks: dict) -> str:
    """Whether the aims are met."""
    light, colour, least, apart = [], [], [], []
    for name, one in inks.items():
        for pair, differences in one["comparisons"].items():
            what = f"`{name}`, {pair.replace('_', ' ')}"
            ratio, xy = differences["luminance_ratio_less_1"], differences["xy_difference"]
            least.append(100 * ratio["standard_error"])
            if abs(100 * ratio["value"]) > _LUMINANCE + _COVERAGE * 100 * ratio["standard_error"]:
                light.append(what)
            if abs(ratio["value"]) > _COVERAGE * ratio["standard_error"]:
                apart.append(f"{what} ({_shown(ratio, 100, 2, '+')} %)")
            if xy is not None:
                over = np.abs(xy["value"]) > _XY + _COVERAGE * np.array(xy["standard_error"])
                if np.any(over):
                    colour.append(what)
    text = (
        "The aim is agreement of luminance within 1 %, and of x and y within 0.001, beyond the Monte Carlo "
        f"error, which is taken as {_COVERAGE} standard errors. "
    )
    text += (
        "All pairs are within it" if not light + colour else f"It is missed by {'; '.join(light + colour)}"
    )
    if apart:
        text += (
            f". Luminances that differ by more than {_COVERAGE} standard errors: {'; '.join(apart)}; "
            "the cause is not known; interpolation of the sheet's table is a candidate that was not tested"
        )
    return "\n".join(
        textwrap.wrap(
            f"{text}. With these numbers of paths, the standard error of a difference in luminance is "
            f"{min(least):.2f} to {max(least):.2f} %.",
            110,
        )
    )
