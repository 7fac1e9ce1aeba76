"""Section on the readings of a sphere, with and without the light that comes out beside the port."""

from pathlib import Path

import numpy as np

from benchmarks.pages import filled, table
from benchmarks.validation.totals.beside_port import (
    IN_ALL,
    IN_SLIDES,
    LOSSES,
    N_PHOTONS,
    NO_LOSS,
    REFLECTANCE_ERROR,
    SQUEEZED,
    Inferred,
    inferred,
    losses_in_slides,
)
from benchmarks.validation.totals.layers import refusal
from benchmarks.validation.totals.sphere import REFLECTANCES, SPHERE, slabs

# Name, wavelengths and asymmetry parameter; None: the file's own.
SAMPLES = (
    ("tio2_phantom", (500.0, 633.0, 800.0), 0.6),
    ("phantom_510nm_series", (1055.6, 1253.0, 1604.7), None),
)
HEAD = ["sample", "nm"]
LOSS_HEADER = [f"jaxink: {IN_SLIDES}", "photons: thin ink, in the slides", f"photons: {IN_ALL}"]
# What the files say of the samples and the spheres.
GEOMETRY = {
    "sample, mm": "sample_thickness_mm",
    "each slide, mm": "slide_thickness_mm",
    "beam, mm": "beam_diameter_mm",
    "sphere, mm": "R_sphere_d_mm",
    "sample port, mm": "R_sample_port_mm",
    "third port, mm": "R_entrance_port_mm",
    "detector port, mm": "R_detector_port_mm",
    "wall": "R_wall",
    "standard": "r_standard",
}


def percent(share, error=None) -> str:
    """Shares of R and T in percent."""
    if error is None:
        return ", ".join(f"{100 * one:.2f}" for one in share)
    return ", ".join(f"{100 * one:.2f} ± {100 * e:.2f}" for one, e in zip(share, error, strict=True))


def head(one: Inferred) -> list[str]:
    """First cells of a row."""
    return [f"`{one.slab.name}`", f"{one.slab.wavelength_nm:g}"]


def readings_row(one: Inferred) -> list[str]:
    """Readings, and the totals that meet them."""
    numbers = (*one.slab.readings, *one.totals)
    return [f"{one.slab.asymmetry:.3g}", *(f"{x:.4f}" for x in numbers), f"{one.totals.sum():.3f}"]


def losses_row(one: Inferred) -> list[str]:
    """What comes out beside the port."""
    in_all = percent(one.lost[IN_ALL], one.lost_error)
    return [percent(one.lost[IN_SLIDES]), percent(*one.lost_squeezed), in_all]


def coefficients_row(one: Inferred) -> list[str]:
    """Scattering and absorption, and how the absorption changes."""
    pairs = [f"{np.exp(x[0]):.4g}, {x[1]:.3g}" for x in one.parameters.values()]
    changes = [f"{one.change(loss):+.1f}" for loss in (IN_SLIDES, IN_ALL)]
    changes += [f"{one.changed_to(absorption):+.1f}" for absorption in one.by_reflectance.values()]
    return [*pairs, *changes]


def verdict_row(one: Inferred) -> list[str]:
    """What the readings can tell."""
    return [
        *(f"{misfit:.0e}" for misfit in one.misfits.values()),
        f"{one.rank} of {one.jacobian.shape[1]}",
        f"{one.outside:.0e}",
        f"{one.condition:.1f}",
        one.verdict,
    ]


def geometry(found: list[Inferred]) -> str:
    """Table of samples and spheres."""
    slabs_by_name = {one.slab.name: one.slab for one in found}
    rows = [
        [f"`{name}`", *(f"{slab.length(key):g}" for key in GEOMETRY.values())]
        for name, slab in slabs_by_name.items()
    ]
    return table(["sample", *GEOMETRY], rows)


def comparison(found: list[Inferred]) -> str:
    """Largest loss and change of the absorption of each sample."""
    parts = []
    for name in dict.fromkeys(one.slab.name for one in found):
        of_sample = [one for one in found if one.slab.name == name]
        lost = 100 * np.max([one.lost[IN_ALL] for one in of_sample], axis=0)
        changes = [one.change(IN_ALL) for one in of_sample]
        slab = of_sample[0].slab
        beam, port = slab.radii_mm
        parts.append(
            f"- `{name}`, {slab.thickness_mm:g} mm thick, port {port / beam:.1f} times the beam: up to "
            f"{lost[0]:.1f} % of R and {lost[1]:.1f} % of T are lost, and the absorption changes by "
            f"{min(changes):+.1f} to {max(changes):+.1f} %."
        )
    return "\n".join(parts)


def sphere_section() -> str:
    """The section."""
    found = [inferred(slab) for sample in SAMPLES for slab in slabs(*sample)]
    thin = found[-len(SAMPLES[-1][1])]
    simpler = [
        [name, percent(library), percent(*photons)]
        for name, library, photons in losses_in_slides(thin.slab, thin.parameters[NO_LOSS])
    ]
    changes = [IN_SLIDES, IN_ALL, *(f"{name} + {REFLECTANCE_ERROR:g}" for name in REFLECTANCES)]
    misfits = [f"misfit, {loss}" for loss in LOSSES]
    verdicts = ["rank of the derivatives", "loss beyond the other two", "condition of the other two"]

    def rows_of(row, *header):
        return table([*HEAD, *header], [[*head(one), *row(one)] for one in found])

    return filled(
        Path(__file__).with_name("sphere.md.in"),
        file=SPHERE,
        geometry=geometry(found),
        asymmetry=SAMPLES[0][2],
        readings=rows_of(readings_row, "g", "M_R", "M_T", "R", "T", "R + T"),
        photons=N_PHOTONS,
        squeezed=SQUEEZED,
        losses=rows_of(losses_row, *LOSS_HEADER),
        thin=thin.slab,
        simpler=table(["case", *LOSS_HEADER[:2]], simpler),
        reflectance_error=REFLECTANCE_ERROR,
        coefficients=rows_of(coefficients_row, *LOSSES, *(f"change, {name}, %" for name in changes)),
        comparison=comparison(found),
        verdicts=rows_of(verdict_row, *misfits, *verdicts, "verdict"),
        refusal=refusal(SPHERE, "totals.csv", SAMPLES[0][0]),
    )
