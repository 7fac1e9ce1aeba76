"""Verify inks as thin sheets on their plates, by star product and by photons, and write docs/inside.md.

python benchmarks/report_sheet.py
"""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np

import jaxink
from jaxink.export import COMPONENTS, InkTable, TableOptions, verify_sheet
from jaxink.fitting import FitResult
from jaxink.forward import ForwardModel, evaluate
from jaxink.sample import Sample
from report_common import machine, table, write_page
from report_simulated import fit_declared
from sheet_photons import Plate, plate_bsdf

NAMES = ("plain_hg", "index_step_hg")
INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0)
N_BATCHES, N_PHOTONS = 8, 10_000
# Asymmetry parameter and thickness of inks whose forward peak is narrower.
PEAKS = ((0.6, 80.0), (0.8, 30.0), (0.9, 20.0))

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
- **Between the entries** a ray tracer interpolates linearly. Angles are dense at critical angles and towards grazing;
  `InkTable.interpolation_error` estimates what linear interpolation costs, from the table alone, and more
  `n_theta` reduce it as the square.
"""


def cased(name: str) -> tuple[FitResult, InkTable]:
    """Fit of a simulated measurement, and its table as read from a file."""
    result, _ = fit_declared(name)
    with tempfile.TemporaryDirectory() as folder:
        path = jaxink.ink_table(result).to_netcdf(Path(folder) / "ink.nc")
        return result, jaxink.read_ink_table(path)


def by_photons(result: FitResult, ink: InkTable, theta_i: float) -> dict[str, list[str]]:
    """Photons against the full model at one incidence: cells by side."""
    axes = np.meshgrid(np.arange(0.0, 86, 5), [0.0, 90, 180], [False, True], indexing="ij")
    theta_o, phi, side = (axis.ravel() for axis in axes)
    values = result.sample.parameters.values_with({})
    plate = Plate(values["plate.absorption_per_mm"] * values["plate.thickness_mm"])
    batches = [
        plate_bsdf(ink, plate, theta_i, (theta_o, phi, side), N_PHOTONS, seed) for seed in range(N_BATCHES)
    ]
    found = np.mean([bsdf for bsdf, _ in batches], axis=0)
    error = np.sqrt(np.mean([e**2 for _, e in batches], axis=0) / N_BATCHES)
    wavelength = np.full(len(side), ink.wavelength_nm[0])
    full = evaluate(ForwardModel(result.sample, np.full(len(side), theta_i), theta_o, phi, wavelength, side))
    cells = {}
    for name, chosen in (("R", ~side), ("T", side)):
        top, difference = np.max(full[chosen]), (found - full)[chosen]
        worst = np.argmax(np.abs(difference))
        cells[name] = [
            f"{100 * abs(difference[worst]) / top:.2f} +- {100 * error[chosen][worst] / top:.2f}",
            f"{100 * np.mean(difference) / top:+.2f}",
        ]
    return cells


def section(name: str, result: FitResult, ink: InkTable) -> str:
    """Text on one sample."""
    verified = verify_sheet(ink, result, INCIDENCES)
    of_photons = {theta: by_photons(result, ink, theta) for theta in INCIDENCES}
    star = {(c.lit_from, c.side, c.theta_i_deg): c.largest_difference for c in verified.checks}
    rows = [
        [
            f"{theta:g}",
            side,
            f"{100 * star['inside', side, theta]:.2f}",
            *of_photons[theta][side],
            f"{100 * star['outside', side, theta]:.2f}",
        ]
        for side in "RT"
        for theta in INCIDENCES
    ]
    header = [
        "incidence, degrees",
        "side",
        "star product, largest difference, %",
        "photons, largest difference and its standard error, %",
        "photons, mean difference, %",
        "star product, lit from the ink, %",
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


def main() -> None:
    """Write the page."""
    cases = {name: cased(name) for name in NAMES}
    text = f"""{CONVENTIONS}
# The table put back on its plate

What the table is worth is seen when it is used as a user has it: written to a file, read again, and put as an
infinitely thin sheet between plate and air. The plate's BSDF in air is then computed from the table and
Fresnel's formulas alone, and compared with the full model of the whole stack. Two ways: the star product of
plate and sheet in channels of n sin(theta) (`jaxink.export.verify_sheet`), and {N_BATCHES * N_PHOTONS} photons
(`benchmarks/sheet_photons.py`), which share nothing with each other or with the solver but the table. The
measurements are **simulated** by an independent program; the inks are those of a fit to them. Differences are over
the largest BSDF of the full model at the same incidence and side, for outgoing angles to 87.5 degrees (photons:
85). Photons of one incidence share their paths, so that their errors at different angles go together.

{chr(10).join(section(name, *case) for name, case in cases.items())}
## Narrower forward peaks

The ink of `plain_hg` with other asymmetry parameters and thicknesses; largest difference of all incidences, sides
and directions of light.

{peaks(cases[NAMES[0]][0].sample)}

This page is made by `python benchmarks/report_sheet.py` ({machine()}).
"""
    write_page("inside.md", text)


if __name__ == "__main__":
    main()
