"""BSDF files of Integra's programs (Lumicept), in the layout of libbsdf's open reader and writer."""

from pathlib import Path

import numpy as np

from jaxink.export.guide import in_words
from jaxink.export.limitations import ExportOptions
from jaxink.export.specular_axes import scattered
from jaxink.export.text import block, provenance, row, stem, write_lines
from jaxink.ink import COMPONENTS, InkTable, exit_angles_deg

_HORIZON_DEG = 90.0
_REGULAR = "share of the incident power in the specular or refracted direction"


def write_integra(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write a ``.ddr`` or ``.ddt`` file per component and wavelength, ``.sdr`` or ``.sdt`` of regular light.

    Parameters and return value: see `jaxink.export.formats.Format`.

    Raises
    ------
    InputRefusedError
        If the axes are too coarse for the table. Axes that are not given are first refined up to four times.

    Notes
    -----
    Values of scattered light are luminance factors, pi times the BSDF. ``sigmat`` is the angle of the
    refracted direction; beyond the critical angle, where there is none, the horizon takes its place.
    """
    contents = {}
    for w in range(len(table.wavelength_nm)):
        for c, component in enumerate(COMPONENTS):
            prefix, suffix = f"{stem(table, w, options.name)}_{component}", component[0].lower()
            name = f"{prefix}.dd{suffix}"
            write_lines(folder / name, _scattered_lines(table, component, w, options))
            contents[name] = in_words(component)
            if table.regular[c, w].any():
                name = f"{prefix}.sd{suffix}"
                write_lines(folder / name, _regular_lines(table, c, w))
                contents[name] = f"regular light: {in_words(component)}"
    return contents


def _scattered_lines(table: InkTable, component: str, w: int, options: ExportOptions) -> list[str]:
    incidence = table.theta_deg
    leaving = exit_angles_deg(table, component, w, incidence)
    leaving = np.where(np.isnan(leaving), _HORIZON_DEG, leaving)
    found = scattered("Integra", table, component, w, incidence, leaving, options)
    lines = [
        *_comments(
            table, component, w, "luminance factor, pi times radiance over irradiance, cosine not included"
        ),
        ";; theta, phi: about the specular direction at sigma, or the refracted one at sigmat",
        "Source Generated",
        "TypeSym PlaneSymmetrical",
        "TypeColorModel spectral 1",
        "TypeData Luminance Absolute",
        f"sigma {len(incidence)}",
        row(incidence),
    ]
    if component[0] == "T":
        lines += ["sigmat", row(leaving)]
    for name, axis in (("phi", found.azimuth_deg), ("theta", found.radial_deg)):
        lines += [f"{name} {len(axis)}", row(axis)]
    lines += [f"wl {table.wavelength_nm[w]:.10g}", "kbdf", row(np.ones(len(incidence))), "def"]
    for angle, rows in zip(incidence, found.values_per_sr, strict=True):
        lines += [f";; Sigma = {angle:.9g}", block(np.pi * rows)]
    return [*lines, "enddef"]


def _regular_lines(table: InkTable, c: int, w: int) -> list[str]:
    return [
        *_comments(table, COMPONENTS[c], w, _REGULAR),
        "Source Generated",
        "TypeColorModel spectral 1",
        f"sigma {len(table.theta_deg)}",
        row(table.theta_deg),
        f"wl {table.wavelength_nm[w]:.10g}",
        "def",
        row(table.regular[c, w]),
        "enddef",
    ]


def _comments(table: InkTable, component: str, w: int, values: str) -> list[str]:
    lines = [*provenance(table, w, values), f"component {component}: {in_words(component)}"]
    return [f";; {line}" for line in lines]
