"""A measurement as a tidy CSV file, which reads back to the same values."""

import csv
from collections.abc import Sequence
from pathlib import Path

from jaxink.files.spreadsheet import cell, comment
from jaxink.files.writing import written_whole
from jaxink.measurement.dataset import GonioData

_NAMES = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr")


def write_csv(data: GonioData, path: str | Path, comments: Sequence[str] = ()) -> None:
    """Write the columns of docs/manual/measurement-file.md, one row for each point.

    Parameters
    ----------
    data
        The measurement; masks are not written.
    path
        The file.
    comments
        Lines above the header, without their ``#``.

    Raises
    ------
    InputRefusedError
        If the file cannot be written; an existing one is then unchanged.
    """
    path = Path(path)
    names = _NAMES if data.sigma_per_sr is None else (*_NAMES, "sigma_per_sr")
    columns = [getattr(data, name).tolist() for name in names]
    # Blank cells remain blank.
    columns += [["" if v != v else cell(v) for v in values.tolist()] for values in data.extra.values()]
    with written_whole(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        for line in comments:
            file.write(comment(f"# {' '.join(line.split())}") + "\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, *map(cell, data.extra)])
        writer.writerows(zip(*columns, strict=True))
