"""Write the tables of src/jaxink/materials from a clone of refractiveindex.info's database (CC0 1.0).

python -m benchmarks.material_tables CLONE

CLONE is a git directory of https://github.com/polyanskiy/refractiveindex.info-database.
"""

import re
import subprocess
import sys
from html import unescape

import numpy as np
import yaml

from benchmarks.pages import REPOSITORY

FOLDER = REPOSITORY / "src" / "jaxink" / "materials" / "tables"
GRID_NM = np.arange(300.0, 1101.0, 10.0)
_PMMA = "organic/(C5H8O2)n - poly(methyl methacrylate)/nk"
_PC = "organic/(C16H14O3)n - polycarbonate/nk"
_PS = "organic/(C8H8)n - polystyrene/nk"
_PET = "organic/(C10H8O4)n - polyethylene terephthalate/nk"
# Name: what it is; pages with their share (2/3 ordinary and 1/3 extraordinary for crystals in powder);
# page of k, where another one has it.
MATERIALS = {
    "rutile": (
        "TiO2, rutile: mean over the axes",
        {"main/TiO2/nk/Devore-o": 2 / 3, "main/TiO2/nk/Devore-e": 1 / 3},
        None,
    ),
    "anatase": (
        "TiO2, anatase: a film by atomic layer deposition",
        {"main/TiO2/nk/Jolivet-anatase": 1.0},
        None,
    ),
    "zinc_oxide": (
        "ZnO: mean over the axes",
        {"main/ZnO/nk/Bond-o": 2 / 3, "main/ZnO/nk/Bond-e": 1 / 3},
        None,
    ),
    "hematite": (
        "Fe2O3, iron oxide red: mean over the axes",
        {"main/Fe2O3/nk/Querry-o": 2 / 3, "main/Fe2O3/nk/Querry-e": 1 / 3},
        None,
    ),
    "carbon": ("carbon, evaporated", {"main/C/nk/Hagemann": 1.0}, None),
    "soot": ("soot of acetylene, near to carbon black", {"other/soots/acetylene soot/nk/Dalzell": 1.0}, None),
    "calcite": (
        "CaCO3, calcite: mean over the axes",
        {"main/CaCO3/nk/Ghosh-o": 2 / 3, "main/CaCO3/nk/Ghosh-e": 1 / 3},
        None,
    ),
    "pmma": ("poly(methyl methacrylate)", {f"{_PMMA}/Beadie": 1.0}, f"{_PMMA}/Zhang-Mitsubishi"),
    "polycarbonate": ("polycarbonate", {f"{_PC}/Sultanova": 1.0}, f"{_PC}/Zhang"),
    "polystyrene": ("polystyrene", {f"{_PS}/Sultanova": 1.0}, f"{_PS}/Zhang"),
    "pet": ("poly(ethylene terephthalate)", {f"{_PET}/Zhang": 1.0}, None),
    "water": ("water, 25 deg C", {"main/H2O/nk/Hale": 1.0}, None),
}


def page(clone: str, name: str) -> dict:
    """A page of the database."""
    words = ["git", f"--git-dir={clone}", "show", f"HEAD:database/data/{name}.yml"]
    return yaml.safe_load(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def formula(kind: int, c: list[float], wave_um: np.ndarray) -> np.ndarray:
    """Index by a formula of the database (its document "Dispersion formulas")."""
    c = [*c, *[0.0] * (17 - len(c))]
    if kind in (1, 2):
        terms = zip(c[1::2], c[2::2], strict=False)
        power = 2 if kind == 1 else 1
        return np.sqrt(1 + c[0] + sum(b * wave_um**2 / (wave_um**2 - d**power) for b, d in terms))
    if kind == 3:
        return np.sqrt(c[0] + sum(b * wave_um**e for b, e in zip(c[1::2], c[2::2], strict=False)))
    if kind == 4:
        two = sum(c[k] * wave_um ** c[k + 1] / (wave_um**2 - c[k + 2] ** c[k + 3]) for k in (1, 5))
        return np.sqrt(c[0] + two + sum(b * wave_um**e for b, e in zip(c[9::2], c[10::2], strict=False)))
    if kind == 5:
        return c[0] + sum(b * wave_um**e for b, e in zip(c[1::2], c[2::2], strict=False))
    raise ValueError(f"formula {kind} is not known here")


def columns(found: dict) -> tuple[np.ndarray, np.ndarray]:
    """N and k of a page on the grid; nan where it has none."""
    n, k = (np.full(len(GRID_NM), np.nan) for _ in range(2))
    for part in found["DATA"]:
        kind, _, form = part["type"].partition(" ")
        if kind == "formula":
            low, high = (1000 * float(x) for x in str(part["wavelength_range"]).split())
            inside = (low - 1e-6 <= GRID_NM) & (high + 1e-6 >= GRID_NM)
            c = [float(x) for x in str(part["coefficients"]).split()]
            n[inside] = formula(int(form), c, GRID_NM[inside] / 1000)
            continue
        table = np.array([[float(x) for x in line.split()] for line in part["data"].strip().splitlines()])
        inside = (1000 * table[0, 0] <= GRID_NM) & (1000 * table[-1, 0] >= GRID_NM)
        for column, name in zip(range(1, table.shape[1]), form, strict=True):
            target = n if name == "n" else k
            target[inside] = np.interp(GRID_NM[inside] / 1000, table[:, 0], table[:, column])
    return n, k


def plain(text: str) -> str:
    """A reference without its markup, on one line."""
    return " ".join(unescape(re.sub(r"<[^>]+>", "", text)).split())


def main() -> None:
    """Write all tables."""
    clone = sys.argv[1]
    words = ["git", f"--git-dir={clone}", "rev-parse", "HEAD"]
    commit = subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()
    for name, (what, shares, page_of_k) in MATERIALS.items():
        pages = {one: page(clone, one) for one in shares}
        n, k = (sum(share * columns(pages[one])[c] for one, share in shares.items()) for c in (0, 1))
        if page_of_k is not None:
            pages[page_of_k] = page(clone, page_of_k)
            k = columns(pages[page_of_k])[1]
        known = np.isfinite(n)
        lines = [f"# {what}"]
        lines += [f"# {one}: {plain(found['REFERENCES'])}" for one, found in pages.items()]
        lines.append(f"# refractiveindex.info database, commit {commit[:12]}, CC0 1.0 (public domain)")
        lines.append("wavelength_nm,n,k")
        for wave, one, other in zip(GRID_NM[known], n[known], k[known], strict=True):
            lines.append(f"{wave:g},{one:.6g},{'' if np.isnan(other) else f'{other:.6g}'}")
        (FOLDER / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
