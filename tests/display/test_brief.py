import dataclasses

import numpy as np
import pytest

from jaxink.display.brief import MOST_LINES, brief, brief_repr, limited
from jaxink.display.card import Card, CardTable
from jaxink.display.named_rows import NamedRows


@dataclasses.dataclass(frozen=True)
class Row:
    name: str
    value: float
    flag: str = ""


@dataclasses.dataclass(frozen=True)
class Holder:
    values: np.ndarray
    rows: tuple[Row, ...]
    text: str

    __repr__ = brief_repr


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (np.zeros((3, 4)), "float64[3, 4]"),
        (0.1 + 0.2, "0.3"),
        ((), "()"),
        ((1.0,), "(1,)"),
        (tuple(range(50)), "(50 int)"),
        ({i: i for i in range(9)}, "{9 entries}"),
        (NamedRows({"a": Row("a", 1.0)}), "NamedRows[1]"),
    ],
)
def test_a_value_is_one_phrase(value, shown):
    assert brief(value) == shown


def test_length_does_not_grow_with_the_content():
    long = Holder(np.zeros(10**5), tuple(Row(str(i), i) for i in range(1000)), "word " * 1000)
    text = repr(long)
    assert "float64[100000]" in text
    assert "(1000 Row)" in text
    assert len(text.splitlines()) < 10
    assert len(limited("word " * 10**4).splitlines()) == MOST_LINES


def test_columns_of_a_table_are_aligned_and_empty_ones_left_out():
    table = CardTable(["name", "number", "nothing"], [["a", "1.5", ""], ["long name", "10.25", ""]])
    assert table.lines() == ["name       number", "a             1.5", "long name   10.25"]


def test_html_escapes_what_a_file_says():
    card = Card("<script>", ("a < b",), (CardTable(["<b>"], [["&"]]),), ("<i>",))
    assert "<script>" not in card.html()
    assert "&lt;script&gt;" in card.html()
    assert "<td>" not in card.html()
    assert '<td class="text">&amp;</td>' in card.html()


def test_rows_are_a_mapping_and_a_frame():
    rows = NamedRows({name: Row(name, value) for name, value in (("a", 1.0), ("b", 2.0))})
    assert list(rows) == ["a", "b"]
    assert rows["b"].value == 2.0
    frame = rows.to_frame()
    assert list(frame.index) == ["a", "b"]
    assert frame.value.tolist() == [1.0, 2.0]
    assert "name" not in frame.columns
    # The column of flags is empty.
    assert "flag" not in repr(rows)
    assert rows._repr_html_().count("<tr>") == 3
    assert repr(NamedRows({})) == "NamedRows with 0 rows"


def test_a_wrong_name_is_a_key_error_that_names_the_nearest():
    rows = NamedRows({name: Row(name, 1.0) for name in ("ink.scattering_per_mm", "ink.absorption_per_mm")})
    with pytest.raises(KeyError) as problem:
        rows["ink.scattering"]
    assert str(problem.value) == (
        "'ink.scattering' is asked for, which does not exist; did you mean ink.scattering_per_mm?"
    )
    assert rows.get("g") is None
    assert "g" not in rows
