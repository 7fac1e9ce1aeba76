"""BSDF files of LightTools."""

from pathlib import Path

import numpy as np

from jaxink.export.limitations import ExportOptions
from jaxink.export.text import block, comments, row, stem, write_lines
from jaxink.ink import COMPONENTS, InkTable, diffuse_totals

# Front is the side that the outward normal of the plate points to.
_SIDES = {"I": "Back", "A": "Front"}
# Azimuth of the source in files of isotropic samples.
_INCIDENCE_AZIMUTH_DEG = 90.0


def write_lighttools(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write one ``.bsdf`` file per wavelength, with all four components.

    Parameters and return value: see `jaxink.export.formats.Format`.
    """
    totals = diffuse_totals(table)
    # The full circle in the file's azimuths: the entries of the table and their mirror images.
    own = np.concatenate([table.phi_deg, 360 - table.phi_deg[::-1]])
    azimuth = np.unique(np.round(np.append((own + _INCIDENCE_AZIMUTH_DEG) % 360, [0.0, 360.0]), 9))
    phi = azimuth - _INCIDENCE_AZIMUTH_DEG
    contents = {}
    for w, wavelength_nm in enumerate(table.wavelength_nm):
        lines = [
            *comments(table, w),
            "# Side: that of incidence; Front: light from side A, Back: light from side I, inside the plate",
            "# AOI and ScatterRadial: from the normal, each in the medium of its own side",
            "# ScatterAzimuth: light arrives from azimuth 90, its specular or undeviated direction is at 270",
            "Symmetry Asymmetric",
            "SpectralContent Monochrome",
            f"ScatterAzimuth {len(azimuth)}",
            row(azimuth),
            f"ScatterRadial {len(table.theta_deg)}",
            row(table.theta_deg),
            "DataBegin",
        ]
        for c, component in enumerate(COMPONENTS):
            for i, theta_i in enumerate(table.theta_deg):
                values = table.interpolated(component, theta_i, table.theta_deg, phi[:, None], w)
                lines += [
                    f"AOI {theta_i:.9g}",
                    "POI 0",
                    f"Side {_SIDES[component[2]]}",
                    f"Wavelength {wavelength_nm:.10g}",
                    f"ScatterType {'BRDF' if component[0] == 'R' else 'BTDF'}",
                    f"TIS {totals[c, w, i]:.9g}",
                    block(values),
                ]
        name = f"{stem(table, w, options.name)}.bsdf"
        write_lines(folder / name, [*lines, "DataEnd"])
        contents[name] = f"all four components at {wavelength_nm:g} nm"
    return contents
