"""Tabulated BSDF files of Zemax OpticStudio."""

from pathlib import Path

import numpy as np

from jaxink.export.guide import in_words
from jaxink.export.limitations import ExportOptions
from jaxink.export.specular_axes import scattered
from jaxink.export.text import block, comments, row, stem, write_lines
from jaxink.ink import COMPONENTS, InkTable, critical_angle_deg, exit_angles_deg


def write_zemax(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write one ``.bsdf`` file per component and wavelength.

    Parameters and return value: see `jaxink.export.formats.Format`.

    Raises
    ------
    InputRefusedError
        If the axes are too coarse for the table. Axes that are not given are first refined up to four times.

    Notes
    -----
    ``AngleOfIncidence`` is the angle of the specular or refracted direction, from which the scatter angles
    are measured; a transmission from the denser side only has rows up to the critical angle.
    """
    contents = {}
    for w in range(len(table.wavelength_nm)):
        for component in COMPONENTS:
            name = f"{stem(table, w, options.name)}_{component}.bsdf"
            write_lines(folder / name, _lines(table, component, w, options))
            contents[name] = in_words(component)
    return contents


def _lines(table: InkTable, component: str, w: int, options: ExportOptions) -> list[str]:
    critical = critical_angle_deg(table, component, w)
    incidence = table.theta_deg[table.theta_deg < critical - 1e-6]
    # The last refracted angle is 90 degrees on every grid.
    incidence = np.append(incidence, critical)
    leaving = exit_angles_deg(table, component, w, incidence)
    lines = [
        *comments(table, w),
        f"# component {component}: {in_words(component)}",
        "# AngleOfIncidence: angle of the specular or refracted direction, from the normal on the exit side",
        "Source Measured",
        "Symmetry PlaneSymmetrical",
        "SpectralContent Monochrome",
        f"ScatterType {'BRDF' if component[0] == 'R' else 'BTDF'}",
        "SampleRotation 1",
        "0",
    ]
    found = scattered("Zemax", table, component, w, incidence, leaving, options)
    axes = (
        ("AngleOfIncidence", leaving),
        ("ScatterAzimuth", found.azimuth_deg),
        ("ScatterRadial", found.radial_deg),
    )
    for name, axis in axes:
        lines += [f"{name} {len(axis)}", row(axis)]
    lines += ["", "Monochrome", "DataBegin"]
    for total, rows in zip(found.totals, found.values_per_sr, strict=True):
        lines += [f"TIS {total:.9g}", block(rows)]
    return [*lines, "DataEnd"]
