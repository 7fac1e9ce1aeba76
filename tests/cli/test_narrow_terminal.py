"""Tables on a terminal of 80 columns: nothing is cut, and the wavelength can be read."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from jaxink.cli.diagnosis_tables import candidate_table, merit_table, step_table
from jaxink.cli.fit_tables import card_table, parameter_table, worst_scans
from jaxink.diagnosis import CandidateRow, Figures, HeldOutGain, Step, Summary, Testability
from jaxink.effects.waves import CoherentBackscatter
from jaxink.fitting import derived_table, search_table

WAVELENGTHS = {2: (450, 650), 7: (400, 450, 500, 550, 600, 650, 700)}


def shown(table):
    console = Console(width=80, markup=False, highlight=False)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


@pytest.mark.parametrize("count", WAVELENGTHS)
@pytest.mark.parametrize("errors_hold", [True, False])
def test_parameters_by_wavelength_are_whole(count, errors_hold, example_result):
    free = example_result.parameters.free
    rows = [
        dataclasses.replace(p, name=f"{p.name}@{nm}", flag="at upper bound")
        for p in free
        for nm in WAVELENGTHS[count]
    ]
    text = shown(parameter_table(rows, errors_hold))
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= 80
    for nm in WAVELENGTHS[count]:
        assert sum(f" {nm} " in line for line in text.splitlines()) == len(free)


def test_derived_quantities_are_whole(example_result):
    derived = [dataclasses.replace(d, wavelength_nm=632.8) for d in example_result.derived]
    text = shown(card_table(derived_table(dataclasses.replace(example_result, derived=tuple(derived)))))
    assert "…" not in text
    assert sum(" 632.8 " in line for line in text.splitlines()) == len(derived)


def whole(text):
    """The lines of a table, of which none is cut or wider than the terminal."""
    assert "\N{HORIZONTAL ELLIPSIS}" not in text
    lines = text.splitlines()
    assert max(map(len, lines)) <= 80
    return lines


@pytest.fixture(scope="module")
def spectrum(example_result):
    """Seven wavelengths, of which the last is fitted worst."""
    data = example_result.data
    nm = np.array([400.0, 450, 500, 550, 600, 650, 700])[np.arange(len(data)) % 7]
    return dataclasses.replace(
        example_result,
        data=data.replace(wavelength_nm=nm),
        whitened=np.where(nm == 700, 2.0, 1.0) * example_result.whitened,
        derived=tuple(
            dataclasses.replace(d, wavelength_nm=wave)
            for wave in np.unique(nm).tolist()
            for d in example_result.derived
        ),
        scans=tuple(
            dataclasses.replace(s, wavelength_nm=wave)
            for wave in np.unique(nm).tolist()
            for s in example_result.scans
        ),
    )


def test_many_wavelengths_have_one_row_each(spectrum):
    lines = whole(shown(card_table(derived_table(spectrum))))
    for nm in WAVELENGTHS[7]:
        (row,) = (line for line in lines if f" {nm} " in line)
        scattering = next(d for d in spectrum.derived if d.quantity == "scattering_per_mm")
        assert float(row.split()[2].partition("(")[0]) == pytest.approx(scattering.value, rel=0.05)


def test_of_many_wavelengths_the_worst_scans_are_listed(spectrum):
    lines = whole(shown(worst_scans(spectrum)))
    rows = [line.split() for line in lines if line[:1] in ("R", "T") or line[1:2] in ("R", "T")]
    assert len({row[1] for row in rows}) == 3
    assert "700" in {row[1] for row in rows}
    assert "3 worst of 7" in lines[0]


def test_searches_from_many_starts_are_whole(example_result):
    one = example_result.searches[0]
    many = [dataclasses.replace(one, loss_start=1.23456e12, outcome="max_steps")] * 12
    lines = whole(shown(card_table(search_table(many))))
    assert sum("start 12" in line for line in lines) == 1
    assert str(12 * one.jacobians) in next(line for line in lines if "in all" in line)


def test_a_diagnosis_is_whole():
    figures = Figures(0.0123456, 0.123456, 0.123456, 1234567.8, 650, 1899.335, 0.0)
    summary = Summary(figures, figures, *(np.ones(1),) * 3)
    form = CoherentBackscatter()
    gain = HeldOutGain(np.array([5432.1, 6543.2]))
    step = Step(form.name, form, (form.name, "gain"), 123456.7, 1234567.8, gain, 0.1, 0.01, "", {}, {}, None)
    row = CandidateRow(
        form.name, -123.4, 1e-300, 0.0005, 0.9912, -0.0001234, "share", 1.0, "1/sr", (form.name,), 123456.7,
        1234567.8, Testability.HARDLY, "",
    )  # fmt: skip
    made = SimpleNamespace(
        before=summary, after=summary, steps=(step,), candidates=(row,), measured_per_sr=np.ones(1)
    )
    text = shown(merit_table(made))
    assert sum("held out" in line for line in whole(text)) == 2
    assert "1234568" in text
    assert "<1e-300" in text
    assert "1234568" in " ".join(whole(shown(step_table(made))))
    text = shown(candidate_table(made))
    whole(text)
    for words in (form.name, "-123", "123457", "1234568", "added"):
        assert words in text
