"""What the "scattering" column of a published table of inks can mean; writes docs/published-tables.md.

Sokolov, Potemin, Zhdanov, Barladian 2021, "BSDF Reconstruction of Inks and Paints for Light Guiding Plates",
CEUR-WS 3027, paper 13, describes each of three inks by a Henyey-Greenstein row and by a Mie row (Tables 1-6).
A coefficient per mm follows from the former only with a reading of its "scattering" column. Each reading is
held against the reduced scattering of the Mie row, which the printed g turns it into.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax

from jaxink.particles.mie import mie_coefficients

jax.config.update("jax_enable_x64", True)

OUTPUT = Path(__file__).resolve().parents[2] / "docs" / "published-tables.md"
BINDER_INDEX = 1.5
# Two rows of one ink, fitted to the same measurement, should agree to better than this factor.
AGREES = 1.1


class Ink(NamedTuple):
    """Both rows of one ink, as printed: Henyey-Greenstein, then Mie."""

    name: str
    scattering_value: float
    concentration_percent: float
    asymmetry_parameter: float
    radius_nm: float
    particle_index: complex
    sphere_concentration_percent: float
    wavelength_nm: float


# Tables 1-6. The wavelength is printed for sample 3 alone, 570-630 nm: its middle; else that of green light.
INKS = (
    Ink("1", 12.51, 12.8, 0.35, 231.0, 2.1076 + 0.000134j, 5.15, 550.0),
    Ink("2", 26.6, 1.97, 0.57, 250.0, 1.8 + 0.001j, 1.77, 550.0),
    Ink("3", 64.95, 31.87, -0.57, 250.0, 1.8 + 0.0001j, 14.0, 600.0),
)

# Scattering coefficient per mm from the value and the concentration in percent.
READINGS: dict[str, Callable[[float, float], float | None]] = {
    "coefficient per mm": lambda value, _: value,
    "coefficient per mm and per cent of concentration": lambda value, percent: value * percent,
    "coefficient per mm of undiluted particles": lambda value, percent: value * percent / 100,
    "coefficient per mm, to be divided by the concentration in per cent": lambda value, percent: (
        value / percent
    ),
    "coefficient per mm, to be divided by the volume fraction": lambda value, percent: 100 * value / percent,
    "fraction of a beam scattered in 1 mm": lambda value, _: _of_fraction(value),
    "per cent of a beam scattered in 1 mm": lambda value, _: _of_fraction(value / 100),
    "per cent of a beam scattered in 1 mm at a concentration of 1 %": lambda value, percent: (
        _of_fraction(value / 100) * percent
    ),
}


def _of_fraction(fraction: float) -> float | None:
    """Coefficient that scatters this fraction in 1 mm; none does if it is 1 or more."""
    return -math.log(1 - fraction) if fraction < 1 else None


def reduced_scattering_per_mm(ink: Ink) -> float:
    """Scattering coefficient times 1 - g of the ink's spheres."""
    result = mie_coefficients(
        ink.radius_nm,
        ink.particle_index,
        ink.sphere_concentration_percent / 100,
        BINDER_INDEX,
        ink.wavelength_nm,
    )
    asymmetry = result.phase_function.asymmetry_parameter
    return float(result.scattering_coefficient_per_mm * (1 - asymmetry))


def report() -> str:
    """The whole page."""
    reduced = [reduced_scattering_per_mm(ink) for ink in INKS]
    lines = [
        "# Readings of a published table of inks",
        "",
        "Written by `benchmarks.validation.published_tables`. Publication: Sokolov, Potemin, Zhdanov, Barladian",
        '2021, "BSDF Reconstruction of Inks and Paints for Light Guiding Plates", CEUR-WS 3027, paper 13.',
        "",
        "## Numbers",
        "",
        "Of Tables 1-6: each ink was fitted twice, with Henyey-Greenstein scattering and with Mie spheres. The last",
        f"column is computed here from the latter. Assumed for it: a binder of index {BINDER_INDEX:g}; a wavelength of",
        "550 nm, and for ink 3, whose fit took 570-630 nm, of 600 nm.",
        "",
        "| ink | scattering | concentration, % | g | radius, nm | index | concentration of spheres, % "
        "| mu_s (1 - g) of the spheres, 1/mm |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for ink, value in zip(INKS, reduced, strict=True):
        index = f"{ink.particle_index.real:g} + {ink.particle_index.imag:g}i"
        lines.append(
            f"| {ink.name} | {ink.scattering_value:g} | {ink.concentration_percent:g} "
            f"| {ink.asymmetry_parameter:g} | {ink.radius_nm:g} | {index} "
            f"| {ink.sphere_concentration_percent:g} | {value:.4g} |"
        )
    lines += [
        "",
        "## Readings",
        "",
        "The text defines the column as the part of a parallel beam that is scattered per mm of path, at a",
        "concentration that no printed number settles; values above 1 exclude the literal reading. For each reading",
        "and ink: the scattering coefficient per mm, and the reduced scattering that it gives with the printed g",
        "over that of the spheres. Two descriptions of one ink should agree in it: 1.",
        "",
        "| reading of the value | ink 1 | ink 2 | ink 3 |",
        "|---|---|---|---|",
    ]
    agreeing = []
    for name, reading in READINGS.items():
        coefficients = [reading(ink.scattering_value, ink.concentration_percent) for ink in INKS]
        ratios = [
            None if c is None else c * (1 - ink.asymmetry_parameter) / r
            for c, ink, r in zip(coefficients, INKS, reduced, strict=True)
        ]
        if all(q is not None and 1 / AGREES < q < AGREES for q in ratios):
            agreeing.append(name)
        cells = " | ".join(_cell(c, q) for c, q in zip(coefficients, ratios, strict=True))
        lines.append(f"| {name} | {cells} |")
    lines += [
        "",
        "## Verdict",
        "",
        *_verdict(agreeing),
        "jaxink's own files hold coefficients per mm and leave nothing to read into them.",
        "",
    ]
    return "\n".join(lines)


def _verdict(agreeing: list[str]) -> list[str]:
    if agreeing:
        return [
            f"Within {100 * (AGREES - 1):.0f} % for all three inks:",
            *(f"* {name}" for name in agreeing),
            "",
        ]
    return [
        f"No reading makes the two rows of all three inks agree to {100 * (AGREES - 1):.0f} %, so that none is adopted:",
        "coefficients per mm do not follow from the printed Henyey-Greenstein rows alone.",
    ]


def _cell(coefficient: float | None, ratio: float | None) -> str:
    return "impossible" if coefficient is None else f"{coefficient:.4g}, {ratio:.3g}"


if __name__ == "__main__":
    page = report()
    print(page)
    OUTPUT.parent.mkdir(exist_ok=True)
    OUTPUT.write_text(page, encoding="utf-8")
