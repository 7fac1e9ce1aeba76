"""Tables on a terminal of 80 columns: nothing is cut, and the wavelength can be read."""

import dataclasses

import pytest
from rich.console import Console

from jaxink.cli.fit_tables import derived_table, parameter_table

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
    text = shown(derived_table(dataclasses.replace(example_result, derived=tuple(derived))))
    assert "…" not in text
    assert sum(" 632.8 " in line for line in text.splitlines()) == len(derived)
