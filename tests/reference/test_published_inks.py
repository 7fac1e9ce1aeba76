"""The page on a published table of inks holds the numbers that are printed there."""

import csv
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "validation" / "published-tables.md"
COPY = ROOT / "benchmarks" / "validation" / "inks_2021.csv"
COLUMNS = ("scattering", "pvc_percent", "anisotropy_g", "radius_nm", "particle_index", "pvc_percent")


def test_printed_numbers_stand_on_the_page(shared_data):
    with open(shared_data / "published" / "inks_2021.csv", newline="", encoding="utf-8") as lines:
        rows = {(row["sample"], row["model"]): row for row in csv.DictReader(lines)}
    text = PAGE.read_text(encoding="utf-8")
    for ink in "123":
        lobe, spheres = rows[ink, "henyey_greenstein"], rows[ink, "mie"]
        printed = [float(row[name]) for row, name in zip([lobe] * 3 + [spheres] * 3, COLUMNS, strict=True)]
        line = next(line for line in text.splitlines() if line.startswith(f"| {ink} |"))
        cells = [float(re.match(r"-?[\d.]+", cell.strip()).group()) for cell in line.split("|")[2:8]]
        assert cells == printed
        absorption = float(spheres["particle_absorption_index"])
        assert f"+ {absorption:g}i" in line


def test_the_copy_beside_the_script_is_what_is_printed(shared_data):
    source, *rows = COPY.read_text(encoding="utf-8").splitlines()
    assert source.startswith("#")
    assert "CEUR-WS 3027" in source
    assert rows == (shared_data / "published" / "inks_2021.csv").read_text(encoding="utf-8").splitlines()
