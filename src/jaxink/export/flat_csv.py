"""Plain CSV columns, for programs without a specific format."""

from pathlib import Path

import numpy as np

from jaxink.export.limitations import ExportOptions
from jaxink.export.text import comments
from jaxink.files.spreadsheet import comment
from jaxink.ink import COMPONENTS, InkTable, diffuse_totals


def write_csv(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write ``<name>_bsdf.csv``, one row per direction, and ``<name>_totals.csv``, one row per incidence.

    Parameters and return value: see `jaxink.export.formats.Format`.
    """
    head = [comment(line) for line in comments(table, 0)[1:]]
    head.append(
        "# phi: azimuth of the outgoing direction minus that towards the source; 180 to 360 mirrors 180 to 0"
    )
    bsdf, totals = (f"{options.name}_{what}.csv" for what in ("bsdf", "totals"))
    _write_bsdf(table, folder / bsdf, head)
    _write_totals(table, folder / totals, head)
    return {
        bsdf: "BSDF of all four components, one row per direction",
        totals: "refractive indices, diffuse totals and regular parts, one row per incidence",
    }


def _write_bsdf(table: InkTable, path: Path, head: list[str]) -> None:
    names = ["component", "wavelength_nm", "theta_i_deg", "theta_o_deg", "phi_deg", "bsdf_per_sr"]
    quantities = [table.bsdf_per_sr]
    if table.bsdf_standard_error_per_sr is not None:
        names.append("bsdf_standard_error_per_sr")
        quantities.append(table.bsdf_standard_error_per_sr)
    theta, phi = table.theta_deg.tolist(), table.phi_deg.tolist()
    # The azimuths, and the columns before them, are formatted once.
    azimuths = [repr(p) for p in phi]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join([*head, ",".join(names), ""]))
        for c, component in enumerate(COMPONENTS):
            for w, wavelength_nm in enumerate(table.wavelength_nm.tolist()):
                for i, theta_i in enumerate(theta):
                    for o, theta_o in enumerate(theta):
                        start = f"{component},{wavelength_nm!r},{theta_i!r},{theta_o!r},"
                        columns = [map(repr, values[c, w, i, o].tolist()) for values in quantities]
                        rows = zip(azimuths, *columns, strict=True)
                        file.writelines(f"{start}{','.join(cells)}\n" for cells in rows)


def _write_totals(table: InkTable, path: Path, head: list[str]) -> None:
    names = ["component", "wavelength_nm", "theta_i_deg", "index_in", "index_out", "diffuse_total", "regular"]
    diffuse = diffuse_totals(table)
    errors = table.regular_standard_error
    if errors is not None:
        names.append("regular_standard_error")
    lines = [*head, ",".join(names)]
    for c, component in enumerate(COMPONENTS):
        into, out = table.index_of_sides(component)
        for w, i in np.ndindex(diffuse.shape[1:]):
            cells = [table.wavelength_nm[w], table.theta_deg[i], into[w], out[w], diffuse[c, w, i]]
            cells.append(table.regular[c, w, i])
            if errors is not None:
                cells.append(errors[c, w, i])
            lines.append(",".join([component, *(repr(float(cell)) for cell in cells)]))
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
