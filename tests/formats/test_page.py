"""The page on formats against the code."""

import dataclasses
import re
from pathlib import Path

import typer

from jaxink.cli.app import app
from jaxink.measurement.formats.catalogue import FORMATS
from jaxink.measurement.formats.exchange_options import STATED_BY, ExchangeOptions

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "manual" / "formats-in.md").read_text(encoding="utf-8")


def test_every_choice_has_an_option_and_is_on_the_page():
    names = {field.name for field in dataclasses.fields(ExchangeOptions)}
    assert names == set(STATED_BY)
    parameters = typer.main.get_command(app).commands["convert"].params
    options = {option for parameter in parameters for option in parameter.opts + parameter.secondary_opts}
    for name, text in STATED_BY.items():
        option = text.partition(" ")[0]
        assert option in options
        assert re.search(rf"^\| `{option}[ `]", PAGE, re.MULTILINE), option
        assert f"`{name}=" in PAGE
    assert set(re.findall(r"`(--[a-z-]+)", PAGE)) <= options


def test_every_format_is_on_the_page():
    table = PAGE[PAGE.index("## Formats") :].split("\n\n")[1]
    assert len(table.strip().splitlines()) == 2 + len(FORMATS)
    assert all(set(each.takes) <= set(STATED_BY) for each in FORMATS)
