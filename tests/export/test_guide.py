"""What the files and the text beside them say: the surface, its media, the contents, the losses."""

import dataclasses
import re
from pathlib import Path

import pytest

from jaxink.export import ExportOptions, write
from jaxink.export.formats import FORMATS
from jaxink.export.guide import _GOOD_VERDICTS, power_lines
from jaxink.export.limitations import losses_of
from jaxink.fitting import FitVerdictCode
from jaxink.ink.hemispherical_totals import diffuse_totals
from jaxink.ink.table import COMPONENTS
from tests.ink.analytic_tables import smooth_table

ATTRS = {
    "layers": "air_gap ink",
    "medium_inside": "plate",
    "medium_outside": "the surroundings",
    "standard_error": "standard errors from the fit's covariance",
    "effects_of_the_instrument_removed": "stray_light",
    "fit": "The model fits within the stated noise: reduced chi-square 0.9.",
    "fit_verdict": "consistent",
}
EVERYTHING = ("regular", "beyond_critical", "standard_errors", "index_step")


@pytest.fixture
def table():
    table = smooth_table((450.0, 650.0))
    table.attrs.update(ATTRS)
    return dataclasses.replace(table, bsdf_standard_error_per_sr=0.01 * table.bsdf_per_sr)


@pytest.mark.parametrize(
    "format", ["zemax", "lighttools", "speos", "integra", "radiance", "mitsuba", "csv", "netcdf"]
)
def test_the_text_beside_the_files_is_complete(format, table, tmp_path):
    paths = write(table, format, tmp_path, ExportOptions(name="red", drop=EVERYTHING))
    readme = (tmp_path / "red_README.txt").read_text(encoding="utf-8")
    assert "450, 650 nm" in readme.splitlines()[0]
    assert "Side I, from which the ink is seen: plate, refractive index 1.5." in readme
    assert "Side A, the other side: the surroundings, refractive index 1." in readme
    assert "the layers air_gap, ink" in readme
    assert "stray_light" in readme
    assert "reduced chi-square 0.9" in readme
    # Every file with what it contains.
    listed = readme.split("Files:\n")[1].splitlines()
    assert [line.split()[0] for line in sorted(listed)] == sorted(path.name for path in paths)
    assert all(len(line.split()) > 1 for line in listed)
    losses = {line.split(" (")[0] for line in readme.splitlines() if line.startswith("Lost: ")}
    assert ("Lost: standard errors" in losses) == (format not in ("csv", "netcdf"))
    assert ("Lost: nothing." in losses) == (format in ("csv", "netcdf"))


@pytest.mark.parametrize("format", ["zemax", "lighttools", "speos", "integra", "radiance", "csv"])
def test_comments_name_the_media_and_what_is_lost(format, table, tmp_path):
    for path in write(table, format, tmp_path, ExportOptions(drop=EVERYTHING)):
        if path.suffix == ".txt":
            continue
        text = path.read_text(encoding="utf-8")
        assert "medium_inside: plate" in text
        assert "normal points from I to A" in text
        assert ("lost: " in text) == (format != "csv")
        # No standard errors are announced that the file lacks.
        assert ("standard_error: " in text) == (format == "csv")
        assert ("cosine not included" in text) == (format != "speos")
        assert ("|cos(theta)|" in text) == (format == "speos")


def sent_out(readme, side):
    (line,) = (line for line in readme.splitlines() if line.startswith(f"Light from side {side}: "))
    return [float(number) for number in re.findall(r"([\d.]+) to ([\d.]+) per cent", line)[0]]


@pytest.mark.parametrize("format", ["csv", "lighttools"])
def test_the_power_of_the_rows_is_stated_with_what_is_lost(format, table, tmp_path):
    write(table, format, tmp_path, ExportOptions(drop=EVERYTHING))
    readme = (tmp_path / "ink_README.txt").read_text(encoding="utf-8")
    seen = table.theta_deg <= 80
    # A format that loses regular light sends out the diffuse part only.
    kept = diffuse_totals(table) + (table.regular if format == "csv" else 0)
    by_name = dict(zip(COMPONENTS, kept, strict=True))
    for side, of in (("I", ("R_II", "T_IA")), ("A", ("T_AI", "R_AA"))):
        power = 100 * sum(by_name[name] for name in of)[:, seen]
        assert sent_out(readme, side) == pytest.approx([power.min(), power.max()], rel=5e-3)


def test_what_the_rows_do_not_send_out_is_absorbed_by_the_ink(table):
    (inside, outside) = power_lines(table, regular_is_lost=False)
    assert inside.endswith("; the ink absorbs the rest.")
    assert outside.endswith("; the ink absorbs the rest.")
    assert "absorbs the rest, apart from the regular light" in power_lines(table, regular_is_lost=True)[0]
    # A boundary alone absorbs nothing.
    alone = dataclasses.replace(table, attrs={k: v for k, v in ATTRS.items() if k != "layers"})
    assert "absorb" not in power_lines(alone, regular_is_lost=False)[0]


def test_a_share_of_rounding_errors_is_none(table):
    regular = table.regular.copy()
    regular[COMPONENTS.index("R_II")] = 1e-14
    regular[COMPONENTS.index("R_AA")] = 0.04
    (loss,) = losses_of(dataclasses.replace(table, regular=regular), ["regular"])
    assert loss.amount.startswith("none of the light that the plate guides")
    assert "e-" not in loss.amount.split(";")[0]


@pytest.mark.parametrize("format", FORMATS)
def test_what_becomes_of_missing_power_is_said_and_on_the_page(format, table, tmp_path):
    write(table, format, tmp_path, ExportOptions(drop=EVERYTHING))
    readme = (tmp_path / "ink_README.txt").read_text(encoding="utf-8")
    (line,) = (line for line in readme.splitlines() if "missing power" in line)
    page = (Path(__file__).parents[2] / "docs" / "manual" / "export.md").read_text(encoding="utf-8")
    part = page.split("## The power that is missing")[1].split("\n## ")[0]
    (row,) = (row for row in part.splitlines() if row.startswith("|") and f"`{format}`" in row)
    # Where nothing is known, both say so.
    assert ("not documented" in line) == ("not documented" in row)
    assert ("absorb" in line) == ("absorb" in row.split("|")[2] and "not documented" not in row)


def test_the_verdicts_without_a_warning_are_those_of_a_fit():
    assert set(_GOOD_VERDICTS) == {code for code in FitVerdictCode if not code.needs_warning}
