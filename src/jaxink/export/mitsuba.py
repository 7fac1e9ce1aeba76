"""Export to Mitsuba 3: the table, a plug-in that reads it, and an example scene."""

import dataclasses
from importlib.resources import files
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from jaxink.export.limitations import ExportOptions
from jaxink.files.netcdf import netcdf_bytes
from jaxink.ink import InkTable, diffuse_totals, linear_matrix

_PROGRAMS = {
    "jaxink_table.py": "BSDF plug-in `jaxink_table`, which reads the table",
    "example_scene.py": "scene of an edge-lit plate with the ink on its lower face",
}
# Beyond this angle the BSDF may grow without limit, so that all angles of the table are kept.
_GRAZING_DEG = 85.0
# Every azimuth that is looked at while polar angles are chosen.
_AZIMUTH_STEP = 4
# The errors of the axes add up; where they exceed the bound, each is reduced by this factor.
_TIGHTER = 0.7
_MOST_ROUNDS = 12


def write_mitsuba(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write the netCDF file and the Python files that use it, which do not need jaxink.

    Parameters and return value: see `jaxink.export.formats.Format`.
    """
    few = thinned(table, options.interpolation_error)
    names = "bsdf_per_sr", "regular"
    # A renderer needs no more digits, and the file has half the size.
    few = dataclasses.replace(few, **{name: getattr(few, name).astype(np.float32) for name in names})
    error = f"{100 * options.interpolation_error:.3g} %"
    few.attrs["resolution"] = (
        f"{len(few.theta_deg)} of {len(table.theta_deg)} polar angles and {len(few.phi_deg)} of "
        f"{len(table.phi_deg)} azimuths of the computed table; linear interpolation differs from that table "
        f"by at most {error} of the largest BSDF of an incidence up to 85 degrees, and totals by {error} of "
        "the incident power"
    )
    name = f"{options.name}.nc"
    (folder / name).write_bytes(netcdf_bytes(few.to_dataset()))
    for program in _PROGRAMS:
        source = files("jaxink.export") / "for_mitsuba" / program
        (folder / program).write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    return {name: f"the table with all four components ({few.attrs['resolution']})", **_PROGRAMS}


def thinned(table: InkTable, largest_error: float) -> InkTable:
    """Leave out angles of a table between which linear interpolation gives the entries.

    Parameters
    ----------
    table
        The table.
    largest_error
        Largest error of linear interpolation at the entries that are left out, for angles up to 85 degrees:
        of the BSDF, over the largest at the same incidence; of the regular part and of hemispherical totals,
        over the incident power. 0 leaves out no angles.

    Returns
    -------
    InkTable
        Without standard errors, and with lobes in its entries only.
    """
    target = largest_error / 2
    for _ in range(_MOST_ROUNDS if largest_error else 0):
        found = _with_angles(table, *_chosen(table, target))
        if _error(table, found) <= largest_error:
            return found
        target *= _TIGHTER
    return _with_angles(table, table.theta_deg >= 0, table.phi_deg >= 0)


def _with_angles(table: InkTable, theta: np.ndarray, phi: np.ndarray) -> InkTable:
    """The table at some of its polar angles and azimuths, given as masks; entries only."""
    return dataclasses.replace(
        table,
        theta_deg=table.theta_deg[theta],
        phi_deg=table.phi_deg[phi],
        bsdf_per_sr=table.bsdf_per_sr[:, :, theta][:, :, :, theta][..., phi],
        regular=table.regular[:, :, theta],
        bsdf_standard_error_per_sr=None,
        regular_standard_error=None,
        lobes=None,
    )


def _chosen(table: InkTable, target: float) -> tuple[Bool[np.ndarray, " angles"], Bool[np.ndarray, " phis"]]:
    """Polar angles and azimuths at which each axis by itself is interpolated well enough."""
    looked_at = table.theta_deg <= _GRAZING_DEG
    top = _largest(table)
    every = np.unique(np.append(np.arange(0, len(table.phi_deg), _AZIMUTH_STEP), len(table.phi_deg) - 1))
    relative = table.bsdf_per_sr / top
    sparse = relative[..., every]

    def polar_errors(kept):
        rows = linear_matrix(table.theta_deg[kept], table.theta_deg)
        into = np.abs(np.einsum("ia,cwaop->cwiop", rows, sparse[:, :, kept], optimize=True) - sparse)
        out = np.abs(np.einsum("oa,cwiap->cwiop", rows, sparse[:, :, :, kept], optimize=True) - sparse)
        into, out = (part[:, :, looked_at][:, :, :, looked_at] for part in (into, out))
        found = np.maximum(into.max(axis=(0, 1, 3, 4)), out.max(axis=(0, 1, 2, 4)))
        straight = np.abs(np.einsum("ia,cwa->cwi", rows, table.regular[:, :, kept]) - table.regular)
        errors = np.zeros(len(table.theta_deg))
        errors[looked_at] = np.maximum(found, straight[:, :, looked_at].max(axis=(0, 1)))
        return errors

    def azimuth_errors(kept):
        rows = linear_matrix(table.phi_deg[kept], table.phi_deg)
        here = relative[:, :, looked_at][:, :, :, looked_at]
        return np.abs(np.einsum("pa,cwioa->cwiop", rows, here[..., kept], optimize=True) - here).max(
            axis=(0, 1, 2, 3)
        )

    theta = _refined(~looked_at, polar_errors, target)
    return theta, _refined(np.zeros(len(table.phi_deg), bool), azimuth_errors, target)


def _refined(kept: np.ndarray, errors_of, target: float) -> np.ndarray:
    """Add to the kept angles, and the first and last one, those of largest error, until all are small."""
    kept = kept.copy()
    kept[[0, -1]] = True
    while True:
        errors = np.where(kept, 0.0, errors_of(kept))
        if errors.max() <= target:
            return kept
        ends = np.flatnonzero(kept)
        for start, end in zip(ends, ends[1:], strict=False):
            if errors[start:end].max() > target:
                kept[start + int(np.argmax(errors[start:end]))] = True


def _largest(table: InkTable) -> Float[np.ndarray, "4 wavelengths angles 1 1"]:
    """Largest BSDF of each incidence away from grazing, infinite where there is none."""
    top = table.bsdf_per_sr[:, :, :, table.theta_deg <= _GRAZING_DEG].max(axis=(3, 4), keepdims=True)
    return np.where(top > 0, top, np.inf)


def _error(table: InkTable, found: InkTable) -> float:
    """Largest error of a thinned table, as defined in `thinned`."""
    looked_at = table.theta_deg <= _GRAZING_DEG
    rows = linear_matrix(found.theta_deg, table.theta_deg[looked_at])
    columns = linear_matrix(found.phi_deg, table.phi_deg)
    worst = 0.0
    top = _largest(table)[:, :, looked_at]
    for c, w in np.ndindex(*table.bsdf_per_sr.shape[:2]):
        again = np.einsum("ia,ob,pq,abq->iop", rows, rows, columns, found.bsdf_per_sr[c, w], optimize=True)
        exact = table.bsdf_per_sr[c, w][looked_at][:, looked_at]
        worst = max(worst, float(np.max(np.abs(again - exact) / top[c, w])))
    for of in (lambda t: t.regular, lambda t: diffuse_totals(dataclasses.replace(t, lobes=None))):
        again = np.einsum("ia,cwa->cwi", rows, of(found))
        worst = max(worst, float(np.max(np.abs(again - of(table)[:, :, looked_at]))))
    return worst
