"""The page on measurement files: its example is read, and its options exist."""

import inspect
import re
from pathlib import Path

import typer

import jaxink
from jaxink.cli.app import app
from jaxink.measurement import read_csv, read_workbook
from jaxink.measurement.columns import KNOWN

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "manual" / "measurement-file.md").read_text(
    encoding="utf-8"
)


def test_the_example_is_a_measurement(tmp_path):
    table, matrix = re.findall(r"```csv\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "example.csv").write_text(table)
    data = jaxink.read(tmp_path / "example.csv")
    assert (len(data), data.notes) == (3, ())
    (tmp_path / "matrix.csv").write_text(matrix)
    data = jaxink.read(tmp_path / "matrix.csv", signed_angles=True)
    assert (len(data), set(data.wavelength_nm), set(data.side)) == (6, {550}, {"R"})


def test_every_column_and_option_is_on_the_page():
    assert all(f"`{name}`" in PAGE for name in KNOWN)
    options = set(re.findall(r"`(--[a-z-]+)", PAGE))
    keywords = set(re.findall(r"^\|[^|]*\| `(\w+)=", PAGE, re.MULTILINE))
    for name in ("fit", "diagnose", "predict", "init"):
        parameters = typer.main.get_command(app).commands[name].params
        assert options <= {option for parameter in parameters for option in parameter.opts}
    readers = (
        inspect.signature(read_csv).parameters.keys() | inspect.signature(read_workbook).parameters.keys()
    )
    assert keywords == readers - {"path", "overrides"}
