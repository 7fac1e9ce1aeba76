from jaxink.display.brief import LINE_WIDTH
from jaxink.display.card import CardTable


def test_a_table_wider_than_a_page_goes_on_below():
    heads = ["measurement", *(f"parameter_{k}.scattering_per_mm" for k in range(6))]
    rows = [["none", *map(str, range(6))], ["reflection at 60 deg", *map(str, range(10, 16))]]
    lines = CardTable(heads, rows).lines()
    assert all(len(line) <= LINE_WIDTH for line in lines)
    # Each part begins with the first column, and every cell is there once.
    assert sum(line.startswith("measurement") for line in lines) == 3 == lines.count("") + 1
    words = " ".join(lines).split()
    assert all(words.count(cell) == 1 for cell in (*heads[1:], *map(str, range(6)), *map(str, range(10, 16))))


def test_a_column_wider_than_a_page_is_not_lost():
    wide = "x" * 2 * LINE_WIDTH
    lines = CardTable(["a", wide, "b"], [["1", "2", "3"]]).lines()
    assert wide in lines[0]
    assert lines[-2:] == ["a  b", "1  3"]
