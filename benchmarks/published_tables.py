"""What the "scattering" column of a published table of inks can mean; writes docs/published-tables.md.

Sokolov, Potemin, Zhdanov, Barladian 2021, "BSDF Reconstruction of Inks and Paints for Light Guiding Plates",
CEUR-WS 3027, paper 13, describes each ink by a Henyey-Greenstein row and by a Mie row. A coefficient per mm
follows from the former only with a reading of its "scattering" column. Each reading is tested by the
asymmetry parameter that it needs to give the reduced scattering of the Mie description.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax

from jaxink.particles.mie import mie_coefficients

jax.config.update("jax_enable_x64", True)

OUTPUT = Path(__file__).resolve().parents[1] / "docs" / "published-tables.md"
BINDER_INDEX = 1.5


class Ink(NamedTuple):
    """One ink: the numbers quoted of its Henyey-Greenstein row, and the spheres to compare with."""

    name: str
    scattering_value: float
    concentration_percent: float
    radius_nm: float
    particle_index: complex
    volume_fraction: float
    wavelength_nm: float


# Value and concentration: quoted second hand from the publication, whose tables could not be read here.
# Spheres: those of the simulated samples white_ink_mie, white_ink_rough and coloured_ink.
INKS = (
    Ink("1", 12.51, 12.8, 231.0, 2.1076 + 0.000134j, 0.0515, 550.0),
    Ink("2", 26.6, 1.97, 250.0, 1.8 + 0.001j, 0.0177, 550.0),
    Ink("3", 64.95, 31.87, 250.0, 1.8 + 0.00019j, 0.14, 600.0),
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


ADOPTED = "coefficient per mm and per cent of concentration"


def _of_fraction(fraction: float) -> float | None:
    """Coefficient that scatters this fraction in 1 mm; none does if it is 1 or more."""
    return -math.log(1 - fraction) if fraction < 1 else None


def reduced_scattering_per_mm(ink: Ink) -> float:
    """Scattering coefficient times 1 - g of the ink's spheres."""
    result = mie_coefficients(
        ink.radius_nm, ink.particle_index, ink.volume_fraction, BINDER_INDEX, ink.wavelength_nm
    )
    asymmetry = result.phase_function.asymmetry_parameter
    return float(result.scattering_coefficient_per_mm * (1 - asymmetry))


def needed_asymmetry(scattering_per_mm: float | None, reduced_per_mm: float) -> float | None:
    """Asymmetry parameter that links the two coefficients, if one between -1 and 1 does."""
    if scattering_per_mm is None or scattering_per_mm <= reduced_per_mm / 2:
        return None
    return 1 - reduced_per_mm / scattering_per_mm


def report() -> str:
    """The whole page."""
    reduced = [reduced_scattering_per_mm(ink) for ink in INKS]
    lines = [
        "# Readings of a published table of inks",
        "",
        "Written by `benchmarks/published_tables.py`. Publication: Sokolov, Potemin, Zhdanov, Barladian",
        '2021, "BSDF Reconstruction of Inks and Paints for Light Guiding Plates", CEUR-WS 3027, paper 13.',
        "",
        "## Numbers",
        "",
        "* Value and concentration: quoted second hand from the Henyey-Greenstein rows of the publication.",
        "  Its tables could not be read for this page: the published g, the absorption and the Mie rows are",
        "  absent, and the order of the inks is assumed.",
        "* The spheres are those of jaxink's simulated samples `white_ink_mie`, `white_ink_rough` and",
        "  `coloured_ink` (600 nm) in a binder of index 1.5. That they equal the publication's Mie rows is",
        "  not verified.",
        "",
        "| ink | value | concentration, % | radius, nm | index | volume fraction | mu_s (1 - g), 1/mm |",
        "|---|---|---|---|---|---|---|",
    ]
    for ink, value in zip(INKS, reduced, strict=True):
        index = f"{ink.particle_index.real:g} + {ink.particle_index.imag:g}i"
        lines.append(
            f"| {ink.name} | {ink.scattering_value:g} | {ink.concentration_percent:g} | {ink.radius_nm:g} "
            f"| {index} | {ink.volume_fraction:g} | {value:.4g} |"
        )
    lines += [
        "",
        "## Readings",
        "",
        "For each ink: scattering coefficient per mm under the reading, and the g that makes it the reduced",
        'scattering above; "no" where no g between -1 and 1 does.',
        "",
        "| reading of the value | ink 1 | ink 2 | ink 3 | possible for all |",
        "|---|---|---|---|---|",
    ]
    possible = []
    for name, reading in READINGS.items():
        coefficients = [reading(ink.scattering_value, ink.concentration_percent) for ink in INKS]
        needed = [needed_asymmetry(c, r) for c, r in zip(coefficients, reduced, strict=True)]
        if None not in needed:
            possible.append(name)
        cells = " | ".join(_cell(c, g) for c, g in zip(coefficients, needed, strict=True))
        lines.append(f"| {name} | {cells} | {'no' if None in needed else 'yes'} |")
    lines += [
        "",
        "## Verdict",
        "",
        f"If the spheres describe the same inks, {len(READINGS) - len(possible)} of {len(READINGS)} readings",
        "are impossible for at least one ink, whatever its g. Not excluded:",
        *(f"* {name}" for name in possible),
        "",
        f'Adopted where a published row has to be turned into coefficients: "{ADOPTED}", the only reading',
        "that needs a forward-scattering g for all three inks. It is a working choice: without the published g",
        "no reading can be shown to reproduce the reduced scattering of all three, and none does so by itself.",
        "jaxink's own files hold coefficients per mm and leave nothing to read into them.",
        "",
    ]
    return "\n".join(lines)


def _cell(coefficient: float | None, asymmetry: float | None) -> str:
    if coefficient is None:
        return "impossible"
    return f"{coefficient:.4g}, " + ("no" if asymmetry is None else f"g = {asymmetry:.3f}")


if __name__ == "__main__":
    page = report()
    print(page)
    OUTPUT.parent.mkdir(exist_ok=True)
    OUTPUT.write_text(page, encoding="utf-8")
