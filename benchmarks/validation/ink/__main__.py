"""Verify inks as thin sheets on their plates, by star product and by photons, and write docs/inside.md.

Its figures, docs/sheet-*.png, show measurement, full model and sheet.

python -m benchmarks.validation.ink
"""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import Plate, plate_bsdf
from benchmarks.pages import REPOSITORY, machine, table, write_page
from benchmarks.validation.ink.figure import draw, lines
from benchmarks.validation.simulated.fits import fit_declared
from jaxink.fitting import FitResult
from jaxink.ink import COMPONENTS, InkTable, TableOptions, verify_sheet
from jaxink.ink.sheet import sheets
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.sample import Sample

NAMES = ("plain_hg", "index_step_hg", "white_ink_rough")
INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0)
N_BATCHES, N_PHOTONS = 8, 10_000
# Asymmetry parameter and thickness of inks whose forward peak is narrower.
PEAKS = ((0.6, 80.0), (0.8, 30.0), (0.9, 20.0), (0.95, 20.0))

CONVENTIONS = """# The ink as light inside the plate meets it

A measurement sees the ink through its plate: refraction, Fresnel reflection and total reflection of the plate
are in it. A light guide needs the ink alone. `jaxink.ink_table` takes the ink's layers out of the fitted stack and
tabulates their BSDF between the plate's medium and what lies on the other side:

```python
table = jaxink.ink_table(result)  # of a fit; a Sample or a ForwardModel serves, too, without standard errors
table.to_netcdf("ink.nc")
table = jaxink.read_ink_table("ink.nc")
```

## What the numbers mean

- **Sides.** I is the inside of the plate, with its refractive index (`index_inside`); A is the other side, mostly
  air (`index_outside`). The interface between plate and ink and the one between ink and A belong to the ink.
  Side I is that of the neighbouring layer; where the ink has one on either side, or none, say
  `TableOptions(inside="front")` or `"back"`, in the order in which light meets the layers.
- **Components.** `R_II`, `T_IA`, `T_AI`, `R_AA`: reflection or transmission, the side that light comes from,
  the side that it leaves to.
- **Angles.** `theta_i`, `theta_o` from the normal, each in the medium of its own side: 60 degrees on side I is
  60 degrees *inside the plate*. Beyond the critical angle of side A light from I is still scattered, and transmitted
  diffusely; it has no regular transmission. `phi` is the azimuth of the outgoing direction minus that towards the
  source: 180 is the half-plane of the specular and of the refracted direction, 0 that of the source; 180 to 360
  mirrors 0 to 180.
- **Quantity.** Radiance over irradiance, 1/sr. **No cosine** is included: the share of the power that leaves
  into a solid angle is f cos(theta_o) times that angle.
- **Regular light** is apart: `regular` is the share of the power that leaves in the specular (R) or refracted (T)
  direction. f and regular together are at most 1 of the power at every incidence.
- **Reciprocity** across the index step has the square of the index: f_R(i, o) = f_R(o, i), but
  f(T_IA; i, o) / n_A^2 = f(T_AI; o, i) / n_I^2. A tool that fills in one transmission with the other is wrong by
  n_I^2 / n_A^2, 2.25 for an index of 1.5.
- **Grazing.** Between equal indices the BSDF of light that arrives and leaves grazing grows without limit. The
  entries at 90 degrees are those at `grazing_theta_deg`, a quarter of the last step before.
- **Standard errors** (`bsdf_standard_error_per_sr`, `regular_standard_error`) follow from the covariance of the
  fit by the derivatives of every entry; a parameter on its bound counts as known. They know nothing of what the
  model leaves out.
- **Rough faces.** Light that meets one facet of a rough face and is regular else makes lobes that are narrower than any
  step of such a table. They are part of the entries, and the file holds what they are made of as well (`facet_*`): the
  density of slopes P(s) s, and by polar angle the share of light that passes regularly between either side of the ink
  and the face, times Smith's masking. With it `InkTable.interpolated` takes the lobes off the entries
  (`InkTable.lobes_at`), interpolates the rest and puts them on again in closed form; a reader that knows the entries
  only sees them wrong between the angles by what `interpolation_error_of_entries` says.
- **Between the entries** a ray tracer interpolates linearly. Angles are dense at critical angles and towards grazing;
  `InkTable.interpolation_error` estimates what linear interpolation costs, from the table alone, and more
  `n_theta` reduce it as the square.
"""


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
    drawn = lines(result, of_ink, INCIDENCES)
    shown = []
    for side, word in (("R", "reflection"), ("T", "transmission")):
        path = REPOSITORY / "docs" / f"sheet-{name}-{side}.png"
        draw(result, drawn, side, name, path)
        shown.append(f"![{name}, {word}: measurement, full model and sheet]({path.name})")
    return "\n\n".join(shown)


def rough_face(result: FitResult, ink: InkTable) -> str:
    """What becomes of a rough ink whose lobes are read from the entries as all else is."""
    if ink.lobes is None:
        return ""
    entries = verify_sheet(dataclasses.replace(ink, lobes=None), result, INCIDENCES)
    return f"""
Lobes apart, as the file holds them. A reader that takes the {len(ink.theta_deg)} angles of the entries alone makes an
error of {100 * ink.attrs["interpolation_error_of_entries"]:.0f} % between them by the estimate, and of up to
{100 * entries.largest_difference:.0f} % in the star product: lobes lie between its angles.
"""


def section(name: str, result: FitResult, ink: InkTable) -> str:
    """Text on one sample."""
    verified = verify_sheet(ink, result, INCIDENCES)
    of_photons = by_photons(result, ink)
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
    return f"""## `{name}`

Plate of index {values["plate.refractive_index"]:g}, binder of index {values["ink.refractive_index"]:g};
{len(ink.theta_deg)} polar angles, {len(ink.phi_deg)} azimuths. Estimated interpolation error
{100 * ink.attrs["interpolation_error"]:.2f} % of the largest BSDF of an incidence inside.

{table(header, rows)}
{rough_face(result, ink)}
{pictures(name, result, ink)}

Sheet and fit against the measurement, relative root mean square:

{table(["side", "sheet, %", "fit, %"], measured)}

Standard errors of the entries up to 85 degrees, relative:

{table(["component", "median, %", "largest, %"], spread)}
"""


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
    text = f"""{CONVENTIONS}
# The table put back on its plate

What the table is worth is seen when it is used as a user has it: written to a file, read again, and put as an
infinitely thin sheet between plate and air. The plate's BSDF in air is then computed from the table and
Fresnel's formulas alone, and compared with the full model of the whole stack. Two ways: the star product of
plate and sheet in channels of n sin(theta) (`jaxink.export.verify_sheet`), and {N_BATCHES * N_PHOTONS} photons
(`benchmarks.montecarlo.thin_sheet`), which share nothing with each other or with the solver but the table. The
measurements are **simulated** by an independent program; the inks are those of a fit to them. Differences are over
the largest BSDF of the full model at the same incidence and side, for outgoing angles to 87.5 degrees (photons:
85). Photons of one incidence share their paths, so that their errors at different angles go together.

{chr(10).join(section(name, *case) for name, case in cases.items())}
## Narrower forward peaks

The ink of `plain_hg` with other asymmetry parameters and thicknesses; largest difference of all incidences, sides
and directions of light. The default stops at 181 polar angles and 91 azimuths, {_megabytes(181, 91):.0f} MB a wavelength: for
g of 0.95 that is too few. `TableOptions(n_theta=..., n_phi=...)` may ask for more; memory and the time of a table go as
n_theta^2 n_phi, the error as 1 / n_theta^2. Angles dense around the forward peak are not possible in a table whose two
polar angles are apart: the peak lies along their diagonal.

{peaks(cases[NAMES[0]][0].sample)}

This page is made by `python -m benchmarks.validation.ink` ({machine()}).
"""
    write_page("inside.md", text)


if __name__ == "__main__":
    main()
