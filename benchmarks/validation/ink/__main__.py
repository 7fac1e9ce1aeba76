"""Verify inks as thin sheets on their plates, by star product and by photons, and write inside.md.

Its figures, docs/sheet-*.png, show measurement, full model and sheet.

python -m benchmarks.validation.ink
"""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import Plate, plate_bsdf
from benchmarks.pages import filled, machine, page_path, table, write_page
from benchmarks.validation.ink.figure import draw, lines
from benchmarks.validation.simulated.fits import fit_declared
from jaxink.fitting import FitResult
from jaxink.ink import COMPONENTS, InkTable, TableOptions, verify_sheet
from jaxink.ink.sheet import sheets
from jaxink.ink.verification import SheetVerification
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.sample import Sample

FOLDER = Path(__file__).parent
NAMES = ("plain_hg", "index_step_hg", "white_ink_rough")
INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0)
N_BATCHES, N_PHOTONS = 8, 10_000
# Asymmetry parameter and thickness of inks whose forward peak is narrower.
PEAKS = ((0.6, 80.0), (0.8, 30.0), (0.9, 20.0), (0.95, 20.0))


def cased(name: str) -> tuple[FitResult, InkTable]:
    """Fit of a simulated measurement, and its table as read from a file."""
    result = fit_declared(name)
    with tempfile.TemporaryDirectory() as folder:
        path = jaxink.ink_table(result).to_netcdf(Path(folder) / "ink.nc")
        return result, jaxink.read_ink_table(path)


def by_photons(result: FitResult, ink: InkTable) -> dict[float, dict[str, list[str]]]:
    """Photons against the full model: cells by incidence and side."""
    axes = np.meshgrid(np.arange(0.0, 86, 5), [0.0, 90, 180], [False, True], indexing="ij")
    directions = tuple(axis.ravel() for axis in axes)
    n = len(directions[0])
    theta_o, phi, side = (np.tile(column, len(INCIDENCES)) for column in directions)
    wavelength = np.full(len(side), ink.wavelength_nm[0])
    model = ForwardModel(result.sample, np.repeat(INCIDENCES, n), theta_o, phi, wavelength, side)
    full = evaluate(model).reshape(len(INCIDENCES), n)
    values = result.sample.parameters.values_with({})
    plate = Plate(values["plate.absorption_per_mm"] * values["plate.thickness_mm"])
    return {
        theta_i: _photon_cells(ink, plate, theta_i, directions, expected)
        for theta_i, expected in zip(INCIDENCES, full, strict=True)
    }


def _photon_cells(ink: InkTable, plate: Plate, theta_i: float, directions, full) -> dict[str, list[str]]:
    batches = [plate_bsdf(ink, plate, theta_i, directions, N_PHOTONS, seed) for seed in range(N_BATCHES)]
    found = np.mean([bsdf for bsdf, _ in batches], axis=0)
    error = np.sqrt(np.mean([e**2 for _, e in batches], axis=0) / N_BATCHES)
    cells, side = {}, directions[2]
    for name, chosen in (("R", ~side), ("T", side)):
        top, difference = np.max(full[chosen]), (found - full)[chosen]
        worst = np.argmax(np.abs(difference))
        cells[name] = [
            f"{100 * abs(difference[worst]) / top:.2f} +- {100 * error[chosen][worst] / top:.2f}",
            f"{100 * np.mean(difference) / top:+.2f}",
        ]
    return cells


def pictures(name: str, result: FitResult, ink: InkTable) -> str:
    """Draw both sides; lines that show them."""
    (of_ink,) = sheets(ink, result)[1]
    drawn = lines(result.sample, of_ink, INCIDENCES)
    shown = []
    for side, word in (("R", "reflection"), ("T", "transmission")):
        path = page_path(f"sheet-{name}-{side}.png")
        draw(result.data, drawn, side, name, path)
        shown.append(f"![{name}, {word}: measurement, full model and sheet]({path.name})")
    return "\n\n".join(shown)


def rough_face(result: FitResult, ink: InkTable) -> str:
    """What becomes of a rough ink whose lobes are read from the entries as all else is."""
    if ink.lobes is None:
        return ""
    entries = verify_sheet(dataclasses.replace(ink, lobes=None), result, INCIDENCES)
    by_estimate = 100 * ink.attrs["interpolation_error_of_entries"]
    return f"""
Lobes apart, as the file holds them. A reader that takes the {len(ink.theta_deg)} angles of the entries alone
makes an error of {by_estimate:.0f} % between them by the estimate, and of up to
{100 * entries.largest_difference:.0f} % in the star product: lobes lie between its angles.
"""


def checks_table(verified: SheetVerification, of_photons: dict) -> str:
    """Table of the star product and of the photons, by side and incidence."""
    star = {(c.lit_from, c.side, c.theta_i_deg): c for c in verified.checks}

    def both(lit, side, theta):
        check = star[lit, side, theta]
        return f"{100 * check.largest_difference:.2f} ({100 * check.largest_away_from_grazing:.2f})"

    rows = [
        [
            f"{theta:g}",
            side,
            both("inside", side, theta),
            *of_photons[theta][side],
            both("outside", side, theta),
        ]
        for side in "RT"
        for theta in INCIDENCES
    ]
    header = [
        "incidence, degrees",
        "side",
        "star product, largest difference (to 75 degrees), %",
        "photons, largest difference and its standard error, %",
        "photons, mean difference, %",
        "star product, lit from the ink (to 75 degrees), %",
    ]
    return table(header, rows)


def section(name: str, result: FitResult, ink: InkTable) -> str:
    """Text on one sample."""
    verified = verify_sheet(ink, result, INCIDENCES)
    away = ink.theta_deg <= 85
    errors = (ink.bsdf_standard_error_per_sr / ink.bsdf_per_sr)[:, :, away][:, :, :, away]
    spread = [
        [f"`{c}`", f"{100 * np.median(errors[k]):.2f}", f"{100 * np.max(errors[k]):.2f}"]
        for k, c in enumerate(COMPONENTS)
    ]
    measured = [
        [s, f"{100 * verified.sheet_rms[s]:.2f}", f"{100 * verified.model_rms[s]:.2f}"]
        for s in verified.sheet_rms
    ]
    values = result.sample.parameters.values_with({})
    return filled(
        FOLDER / "sample.md.in",
        name=name,
        plate_index=values["plate.refractive_index"],
        ink_index=values["ink.refractive_index"],
        n_theta=len(ink.theta_deg),
        n_phi=len(ink.phi_deg),
        interpolation=100 * ink.attrs["interpolation_error"],
        checks=checks_table(verified, by_photons(result, ink)),
        rough_face=rough_face(result, ink),
        pictures=pictures(name, result, ink),
        measured=table(["side", "sheet, %", "fit, %"], measured),
        errors=table(["component", "median, %", "largest, %"], spread),
    )


def peaks(sample: Sample) -> str:
    """What narrower forward peaks and more angles do to the star product."""
    rows = []
    for g, thickness in PEAKS:
        parameters = sample.parameters.replace("ink.asymmetry_parameter", value=g)
        parameters = parameters.replace("ink.thickness_um", value=thickness)
        here = dataclasses.replace(sample, parameters=parameters)
        for n_theta in (31, None):
            ink = jaxink.ink_table(here, options=TableOptions(n_theta=n_theta))
            verified = verify_sheet(ink, here, INCIDENCES)
            rows.append(
                [
                    f"{g:g}",
                    f"{thickness:g}",
                    f"{len(ink.theta_deg)}{'' if n_theta else ' (default)'}",
                    f"{100 * ink.attrs['interpolation_error']:.2f}",
                    f"{100 * verified.largest_difference:.2f}",
                ]
            )
    header = ["g", "thickness, um", "polar angles", "estimated interpolation error, %", "star product, %"]
    return table(header, rows)


def _megabytes(n_theta: int, n_phi: int) -> float:
    """Size of the four components at one wavelength, without standard errors."""
    return 4 * n_theta**2 * n_phi * 8 / 1e6


def main() -> None:
    """Write the page."""
    cases = {name: cased(name) for name in NAMES}
    text = filled(
        FOLDER / "inside.md.in",
        photons=N_BATCHES * N_PHOTONS,
        samples="\n".join(section(name, *case) for name, case in cases.items()),
        megabytes=_megabytes(181, 91),
        peaks=peaks(cases[NAMES[0]][0].sample),
        machine=machine(),
    )
    write_page("inside.md", text)


if __name__ == "__main__":
    main()
