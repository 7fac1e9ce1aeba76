"""What the "scattering" column of a published table of inks can mean; writes docs/published-tables.md.

Sokolov, Potemin, Zhdanov, Barladian 2021, "BSDF Reconstruction of Inks and Paints for Light Guiding Plates",
CEUR-WS 3027, paper 13, describes each of three inks by a Henyey-Greenstein row and by a Mie row (Tables 1-6).
A coefficient per mm follows from the former only with a reading of its "scattering" column. Each reading is
held against the reduced scattering of the Mie row, which the printed g turns it into.

python -m benchmarks.validation.published_tables
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax

from benchmarks.pages import filled, table, write_page
from jaxink.particles.mie import mie_coefficients

jax.config.update("jax_enable_x64", True)

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


def inks_table(reduced: list[float]) -> str:
    """Both rows of each ink as printed, and the reduced scattering of its spheres."""
    header = ["ink", "scattering", "concentration, %", "g", "radius, nm", "index"]
    header += ["concentration of spheres, %", "mu_s (1 - g) of the spheres, 1/mm"]
    rows = [
        [
            ink.name,
            *(f"{x:g}" for x in (ink.scattering_value, ink.concentration_percent, ink.asymmetry_parameter)),
            f"{ink.radius_nm:g}",
            f"{ink.particle_index.real:g} + {ink.particle_index.imag:g}i",
            f"{ink.sphere_concentration_percent:g}",
            f"{value:.4g}",
        ]
        for ink, value in zip(INKS, reduced, strict=True)
    ]
    return table(header, rows)


def page() -> str:
    """The whole page."""
    reduced = [reduced_scattering_per_mm(ink) for ink in INKS]
    agreeing, rows = [], []
    for name, reading in READINGS.items():
        coefficients = [reading(ink.scattering_value, ink.concentration_percent) for ink in INKS]
        ratios = [
            None if c is None else c * (1 - ink.asymmetry_parameter) / r
            for c, ink, r in zip(coefficients, INKS, reduced, strict=True)
        ]
        if all(q is not None and 1 / AGREES < q < AGREES for q in ratios):
            agreeing.append(name)
        rows.append([name, *(_cell(c, q) for c, q in zip(coefficients, ratios, strict=True))])
    return filled(
        Path(__file__).with_suffix(".md.in"),
        binder=BINDER_INDEX,
        inks=inks_table(reduced),
        readings=table(["reading of the value", *(f"ink {ink.name}" for ink in INKS)], rows),
        verdict=_verdict(agreeing),
    )


def _verdict(agreeing: list[str]) -> str:
    percent = f"{100 * (AGREES - 1):.0f} %"
    if agreeing:
        return "\n".join([f"Within {percent} for all three inks:", *(f"* {name}" for name in agreeing), ""])
    return (
        f"No reading makes the two rows of all three inks agree to {percent}, so that none is adopted:\n"
        "coefficients per mm do not follow from the printed Henyey-Greenstein rows alone."
    )


def _cell(coefficient: float | None, ratio: float | None) -> str:
    return "impossible" if coefficient is None else f"{coefficient:.4g}, {ratio:.3g}"


if __name__ == "__main__":
    write_page("published-tables.md", page())
