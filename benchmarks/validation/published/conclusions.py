"""Numbers by which the page says what the published protocols determine."""

import numpy as np

from benchmarks.pages import table
from benchmarks.validation.published.fits import kept, made
from benchmarks.validation.published.judgement import truth_values
from benchmarks.validation.published.problems import (
    COLOURED,
    EVERYTHING,
    PROTOCOL,
    ROUGH,
    SHEET,
    WEIGHTED,
    WHITE,
    WITH_R,
    WITH_T_45,
)


def side_percent(found: dict, side: str) -> float | None:
    """Relative rms of the prediction in R or T over all incidences, in per cent; None if not measured."""
    chosen = [m["relative_rms"] for m in found["misfits"] if m["side"] == side]
    return 100 * float(np.sqrt(np.mean(np.square(chosen)))) if chosen else None


def inside_percent(found: dict, *components: str) -> float:
    """Root mean square error of components of the ink's BSDF, in per cent."""
    chosen = [e["rms_percent"] for e in found["inside"] if e["component"] in components]
    return float(np.sqrt(np.mean(np.square(chosen))))


def added_scans() -> str:
    """What each choice of scans makes of R, T and the ink of the white inks."""
    columns = {
        PROTOCOL: "T at 0, published objective",
        WEIGHTED: "T at 0",
        WITH_T_45: "T at 0 and 45",
        WITH_R: "T and R at 0",
        EVERYTHING: "R and T at 0 to 60",
    }
    rows = []
    for name in (f"{ink}-{model}" for ink in (WHITE, ROUGH) for model in ("mie", "hg")):
        cells = []
        for scans in columns:
            if scans not in made(name):
                cells.append("")
                continue
            found = kept(name, scans)
            sides = [f"{side_percent(found, side):.2g}" for side in "TR"]
            cells.append(f"{sides[0]}, {sides[1]}, {inside_percent(found, 'R_II'):.2g}")
        rows.append([f"`{name}`", *cells])
    return table(["T, R and R_II inside, wrong by %", *columns.values()], rows)


def numbers() -> dict[str, str]:
    """Fields of the page."""
    coloured, shaped, lobe = (
        kept(f"{COLOURED}-{model}", scans)
        for model, scans in (("mie", EVERYTHING), ("mie", PROTOCOL), ("hg", PROTOCOL))
    )
    sheet = kept(f"{SHEET}-mie", EVERYTHING)
    truth = truth_values(f"{SHEET}-mie")

    def off(key: str) -> str:
        return f"{100 * (sheet['parameters'][key]['value'] / truth[key] - 1):+.1f}"

    return {
        "added_scans": added_scans(),
        "coloured_r": f"{side_percent(coloured, 'R'):.2g}",
        "coloured_t_inside": f"{inside_percent(coloured, 'T_IA', 'T_AI'):.2g}",
        "shaped_r": f"{side_percent(shaped, 'R'):.2g}",
        "shaped_t_inside": f"{inside_percent(shaped, 'T_IA', 'T_AI'):.2g}",
        "lobe_r": f"{side_percent(lobe, 'R'):.2g}",
        "lobe_t_inside": f"{inside_percent(lobe, 'T_IA', 'T_AI'):.2g}",
        "sheet_radius": off("ink.radius_nm"),
        "sheet_index": off("ink.particle_index"),
        "sheet_r_inside": f"{inside_percent(sheet, 'R_II'):.2g}",
    }
