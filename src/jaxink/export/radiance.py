"""BSDF files of Radiance: XML with a Klems matrix or a tensor tree."""

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from jaxtyping import Float

from jaxink.export.limitations import ExportOptions
from jaxink.export.text import block, provenance, stem
from jaxink.ink import InkTable

# Radiance's front (theta < 90) is the inside of the plate, which the XML format calls back.
_DIRECTIONS = {
    "R_II": "Reflection Back",
    "T_IA": "Transmission Back",
    "R_AA": "Reflection Front",
    "T_AI": "Transmission Front",
}
# Klems full basis: edges of the rings in degrees, and patches in each.
RING_EDGES_DEG = (0, 5, 15, 25, 35, 45, 55, 65, 75, 90)
RING_PATCHES = (1, 8, 16, 20, 24, 24, 24, 16, 12)
# Gauss-Legendre points of equal weight along each side of a patch or cell, for averages.
_FRACTIONS = (1 + np.array([-1, 1]) / np.sqrt(3)) / 2
_TREE_LOG2 = 6


def write_radiance(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write one XML file per wavelength, with all four components.

    Parameters and return value: see `jaxink.export.formats.Format`.

    Notes
    -----
    Both transmissions are always written: the renderer would replace a missing one by the other without the
    squared index ratio.
    """
    is_tree = options.basis == "tensor_tree"
    structure = _TREE_STRUCTURE if is_tree else _klems_structure()
    bases = _TREE_BASIS if is_tree else _KLEMS_BASES
    scattering = _tree if is_tree else _klems_matrix
    contents = {}
    for w, wavelength_nm in enumerate(table.wavelength_nm):
        comment = escape("\n".join(provenance(table, w))).replace("--", "- -")
        parts = [_HEAD.format(comment=comment, name=escape(options.name), structure=structure)]
        for component, direction in _DIRECTIONS.items():
            data = scattering(table, component, w)
            parts.append(_COMPONENT.format(direction=direction, bases=bases, data=data))
        text = "".join([*parts, _TAIL])
        name = f"{stem(table, w, options.name)}.xml"
        (folder / name).write_text(text, encoding="utf-8")
        contents[name] = f"all four components at {wavelength_nm:g} nm"
    return contents


def _klems_structure() -> str:
    rings = []
    for low, high, n in zip(RING_EDGES_DEG, RING_EDGES_DEG[1:], RING_PATCHES, strict=False):
        centre = 0 if low == 0 else (low + high) / 2
        rings.append(_RING.format(centre=f"{centre:g}", n=n, low=low, high=high))
    return _KLEMS_STRUCTURE.format(rings="".join(rings))


def _patch_points() -> tuple[Float[np.ndarray, "patches points"], Float[np.ndarray, "patches points"]]:
    """Polar angles and azimuths, in degrees, of points of equal projected solid angle in the patches."""
    theta, phi = [], []
    for low, high, n in zip(RING_EDGES_DEG, RING_EDGES_DEG[1:], RING_PATCHES, strict=False):
        edges = np.sin(np.deg2rad([low, high])) ** 2
        across = np.rad2deg(np.arcsin(np.sqrt(edges[0] + _FRACTIONS * np.diff(edges))))
        for k in range(n):
            around = 360 / n * (k - 0.5 + _FRACTIONS)
            grid = np.meshgrid(across, around, indexing="ij")
            theta.append(grid[0].ravel())
            phi.append(grid[1].ravel())
    return np.array(theta), np.array(phi)


def _klems_matrix(table: InkTable, component: str, w: int) -> str:
    """Averages over pairs of patches: outgoing in rows, incident in columns."""
    theta, phi = _patch_points()
    matrix = np.empty((len(theta), len(theta)))
    for i, (theta_i, opposite) in enumerate(zip(theta, phi, strict=True)):
        # Incident patches are numbered by the direction of propagation, seen from above.
        turned = phi[:, :, None] - (opposite + 180)
        values = table.interpolated(component, theta_i, theta[:, :, None], turned, w)
        matrix[:, i] = values.mean(axis=(1, 2))
    return block(matrix)


def _tree(table: InkTable, component: str, w: int) -> str:
    """Isotropic tensor tree of full depth: incidence, then the square of the outgoing disc."""
    size = 1 << _TREE_LOG2
    half = size // 2
    cells = (np.arange(size)[:, None] + _FRACTIONS) / size
    x, y = _square_to_disc(*np.meshgrid(cells.ravel(), cells.ravel(), indexing="ij"))
    theta_o = np.rad2deg(np.arcsin(np.minimum(np.hypot(x, y), 1.0)))
    # The tree's azimuth 0 is the direction that the light goes.
    phi = np.rad2deg(np.arctan2(y, x)) + 180
    values = np.empty((half, size, size))
    for i in range(half):
        total = np.zeros(theta_o.shape)
        for sine in 1 - 2 * cells[i]:
            theta_i = np.rad2deg(np.arcsin(sine))
            total = total + table.interpolated(component, theta_i, theta_o, phi, w)
        values[i] = total.reshape(size, 2, size, 2).mean(axis=(1, 3)) / 2
    # The first coordinate varies fastest; its upper half is empty for isotropic samples.
    branches = []
    for third in range(2):
        for second in range(2):
            rows, columns = (slice(k * half, (k + 1) * half) for k in (second, third))
            leaves = values[:, rows, columns].reshape(-1, half)
            branches += [f"{{\n{block(leaves)}\n}}", "{ 0 }"]
    return "{\n" + "\n".join(branches) + "\n}"


def _square_to_disc(u, v):
    """Area-preserving map from the unit square to the unit disc.

    References
    ----------
    P. Shirley, K. Chiu, "A low distortion map between disk and square", J. Graphics Tools 2(3), 1997.
    """
    a, b = 2 * u - 1, 2 * v - 1
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    safe = np.where(radius == 0, 1.0, radius)
    angle = np.pi / 4 * np.where(wide, b / safe, 2 - a / safe)
    return radius * np.cos(angle), radius * np.sin(angle)


_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<!--
{comment}
Front of Radiance (theta below 90): side I, inside of the plate; in this file that side is called Back.
Radiance has no media: directions inside the plate are those in the plate, and no ray is refracted here.
-->
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
<Material>
<Name>{name}</Name>
<Manufacturer>jaxink</Manufacturer>
<DeviceType>Other</DeviceType>
</Material>
{structure}
"""
_KLEMS_STRUCTURE = """<DataDefinition>
<IncidentDataStructure>Columns</IncidentDataStructure>
<AngleBasis>
<AngleBasisName>LBNL/Klems Full</AngleBasisName>
{rings}</AngleBasis>
</DataDefinition>"""
_RING = (
    "<AngleBasisBlock><Theta>{centre}</Theta><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{low}</LowerTheta>"
    "<UpperTheta>{high}</UpperTheta></ThetaBounds></AngleBasisBlock>\n"
)
_TREE_STRUCTURE = """<DataDefinition>
<IncidentDataStructure>TensorTree3</IncidentDataStructure>
</DataDefinition>"""
_KLEMS_BASES = (
    "<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis>\n<RowAngleBasis>LBNL/Klems Full</RowAngleBasis>"
)
_TREE_BASIS = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
_COMPONENT = """<WavelengthData>
<LayerNumber>System</LayerNumber>
<Wavelength unit="Integral">Visible</Wavelength>
<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>
<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>
<WavelengthDataBlock>
<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{bases}
<ScatteringDataType>BTDF</ScatteringDataType>
<ScatteringData>
{data}
</ScatteringData>
</WavelengthDataBlock>
</WavelengthData>
"""
_TAIL = "</Layer>\n</Optical>\n</WindowElement>\n"
