"""Anisotropic BSDF text files of Ansys Speos."""

from pathlib import Path

import numpy as np

from jaxink.export.limitations import ExportOptions
from jaxink.export.text import block, provenance, row, stem, write_lines
from jaxink.ink import COMPONENTS, InkTable, diffuse_totals

_SIDES = {"I": "inside", "A": "outside"}
# Half-width of the band of the two spectral entries.
_HALF_BAND_NM = 0.5


def write_speos(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write two ``.anisotropicbsdf`` files per wavelength, one for light from each side.

    Parameters and return value: see `jaxink.export.formats.Format`.

    Notes
    -----
    Values are intensities f |cos(theta)|, because the software misreads BSDF values in transmission. It
    scales each table to the stated percentage, the total at the reference incidence.
    """
    contents = {}
    for w, wavelength_nm in enumerate(table.wavelength_nm):
        for side, where in _SIDES.items():
            name = f"{stem(table, w, options.name)}_{where}.anisotropicbsdf"
            write_lines(folder / name, _lines(table, w, side))
            contents[name] = f"light from side {side}, reflected and transmitted, at {wavelength_nm:g} nm"
    return contents


def _lines(table: InkTable, w: int, side: str) -> list[str]:
    totals = diffuse_totals(table)
    # In the order of the format, reflection first; a component that is zero cannot be scaled.
    components = [c for c, name in enumerate(COMPONENTS) if name[2] == side]
    components.sort(key=lambda c: COMPONENTS[c][0])
    present = [c for c in components if totals[c, w].max() > 0]
    description = "\n".join(
        [
            *provenance(table, w, "radiance over irradiance, times |cos(theta)|, in 1/sr"),
            f"light from side {side}; transmission: theta beyond 90, towards the other side",
            "phi 0: specular or undeviated direction",
        ]
    )
    lines = [
        "OPTIS - Anisotropic BSDF surface file v8.0",
        "0",
        "Comment",
        str(len(description)),
        description,
        "0 1 0",
        " ".join(str(int(c in present)) for c in components),
        "0",
    ]
    for _ in present:
        lines += ["1", "0", str(len(table.theta_deg)), row(table.theta_deg)]
    for c in present:
        # The incidence with most light has the smallest relative error.
        reference = int(np.argmax(totals[c, w]))
        percent = f"{100 * totals[c, w, reference]:.9g}"
        band = (table.wavelength_nm[w] + shift for shift in (-_HALF_BAND_NM, _HALF_BAND_NM))
        lines += [f"{table.theta_deg[reference]:.9g} 0", "Comment", "2"]
        lines += [f"{wavelength_nm:.10g} {percent}" for wavelength_nm in band]
    for c in present:
        lines += _tables(table, w, c)
    return [*lines, "End of file"]


def _tables(table: InkTable, w: int, c: int) -> list[str]:
    """One table per incidence, with one row per polar angle."""
    cosine = np.cos(np.deg2rad(table.theta_deg))
    cosine[-1] = 0.0
    # Full circle of azimuths from the undeviated direction; those of the table start at the source.
    azimuth = np.concatenate([180 - table.phi_deg[::-1], 180 + table.phi_deg[1:]])
    theta = table.theta_deg if COMPONENTS[c][0] == "R" else 180 - table.theta_deg[::-1]
    lines = []
    for values in table.bsdf_per_sr[c, w] * cosine[:, None]:
        around = np.concatenate([values[:, ::-1], values[:, 1:]], axis=1)
        upwards = around if COMPONENTS[c][0] == "R" else around[::-1]
        lines += [f"{len(theta)} {len(azimuth)}", row(azimuth)]
        lines.append(block(np.column_stack([theta, upwards])))
    return lines
