"""Files of a fit for people: the parameters for a spreadsheet, and the sample file with the fitted values."""

import csv
import math

import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters, parameter_text


def rows_of(text):
    return list(csv.DictReader(text.splitlines()))


def test_the_parameters_are_a_table_with_all_digits(example_result, tmp_path):
    example_result.save(tmp_path)
    rows = {row["parameter"]: row for row in rows_of((tmp_path / "parameters.csv").read_text())}
    assert list(rows) == list(example_result.parameters)
    for name, p in example_result.parameters.items():
        assert float(rows[name]["value"]) == p.value
        assert rows[name]["unit"] == p.unit
        assert rows[name]["state"] == ("free" if name in SIMULATED_TRUTH else "fixed")
    assert float(rows["ink.scattering_per_mm"]["maximum"]) == 1000
    assert float(rows["ink.scattering_per_mm"]["standard_error"]) > 0


def test_wavelengths_are_rows_unknown_numbers_blank_and_formulas_text():
    def row(name, error, tie=None, flag=""):
        return FittedParameter(name, "1/mm", 0.1, error, 0.2, -math.inf, 3.0, tie is None, tie, flag)

    table = FittedParameters.of(
        (row("=ink.a@450", 0.01), row("ink.a@650", None, flag="not determined"), row("b", None, "-ink.a@450"))
    )
    first, second, third = rows_of(parameter_text(table))
    assert (first["parameter"], first["wavelength_nm"]) == ("'=ink.a", "450")
    assert (second["wavelength_nm"], second["standard_error"], second["minimum"]) == ("650", "", "")
    assert second["note"] == "not determined"
    assert (third["wavelength_nm"], third["state"], third["note"]) == ("", "tied", "tied: -ink.a@450")


def test_standard_errors_of_a_misfit_are_marked():
    def row(name, error):
        return FittedParameter(name, "1/mm", 0.1, error, 0.2, 0.0, 3.0, True, None, "")

    table = FittedParameters.of((row("a", 0.01), row("b", None)))
    first, second = rows_of(parameter_text(table, errors_hold=False))
    assert "meaningless" in first["note"]
    assert float(first["standard_error"]) == 0.01
    assert second["note"] == ""


def test_the_sample_file_is_the_fitted_sample(example_result, tmp_path):
    example_result.save(tmp_path)
    assert jaxink.load_sample(tmp_path / "sample.toml") == example_result.sample
    assert jaxink.load_sample(tmp_path) == example_result.sample


@pytest.mark.parametrize("name", ["sample.toml", "parameters.csv"])
@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_a_file_of_the_users_is_never_replaced(command, name, tmp_path, told):
    data, sample = map(str, simulated_example())
    (tmp_path / name).write_text("# mine\n")
    done = CliRunner().invoke(app, [command, data, "--sample", sample, "--out", str(tmp_path)])
    assert done.exit_code == 5
    told(done.stderr, "jaxink: ", name)
    assert (tmp_path / name).read_text() == "# mine\n"


def test_an_input_is_not_replaced_by_its_own_result(example_result, tmp_path, told):
    example_result.save(tmp_path)
    file = tmp_path / "sample.toml"
    before = file.read_text()
    words = ["fit", str(simulated_example()[0]), "--sample", str(file), "--out", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 5
    told(done.stderr, "jaxink: ", "sample.toml")
    assert file.read_text() == before
