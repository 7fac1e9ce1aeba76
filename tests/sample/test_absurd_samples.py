"""Files that nobody means, refused at once by one sentence, as those are that somebody meant otherwise."""

import os

import pytest

from jaxink.errors import InputRefusedError
from jaxink.sample import load_sample, parse_sample
from tests.refused import edited, sentence_of
from tests.samples import GOOD_SAMPLE

LARGE = "has an integer of more than 64 bits; write a decimal number, such as 1e20."
DEEP_15, DEEP_16 = (
    f"row {row} is nested more than 30 deep; nothing in this file is meant to be." for row in (15, 16)
)

# What stands for a number, and how the sentence begins.
ABSURD = {
    "400 digits": ("1" * 400, f"layers.absorption_per_mm {LARGE}"),
    "5000 digits": ("1" * 5000, LARGE),
    "5000 hexadecimal digits": ("0x" + "f" * 5000, f"layers.absorption_per_mm {LARGE}"),
    "first above 64 bits": (str(2**63), f"layers.absorption_per_mm {LARGE}"),
    "large integer deep within": (
        "[[{ value = [" + "1" * 400 + "] }]]",
        f"layers.absorption_per_mm.value {LARGE}",
    ),
    "arrays": ("[" * 900 + "]" * 900, DEEP_15),
    "arrays without an end": ("[" * 900, DEEP_15),
    "arrays not too deep": (
        "[" * 30 + "]" * 30,
        f"ink.absorption_per_mm is {'[' * 30}{']' * 30}; it must be",
    ),
    "tables": ("{ a = " * 900 + "1" + " }" * 900, DEEP_15),
    "dotted key": ("1\n" + "a." * 20_000 + "a = 1", DEEP_16),
    "dotted key of texts": ("1\n" + '"a" . ' * 20_000 + "a = 1", DEEP_16),
    "dotted header": ("1\n[" + "a." * 20_000 + "a]", DEEP_16),
    "brackets in a comment": (
        "9e9 # " + "[" * 900,
        "ink.absorption_per_mm is 9e+09 1/mm; it must lie between 0 and 1e+06 1/mm.",
    ),
    "brackets in a text": ("'" + "[" * 900 + "\\'", "ink.absorption_per_mm is '[[["),
    "brackets in an escaped text": ('"\\"' + "[" * 900 + '"', "ink.absorption_per_mm is '\"[[["),
    "dots in lines of text": ("'''\n" + "a." * 900 + "''\\'''", 'ink.absorption_per_mm is "a.a.'),
    "brackets in lines of text": ('"""\n""' + "[" * 900 + '\\""""', 'ink.absorption_per_mm is \'""[[['),
    "text without an end": ('"""' + '\\"""' * 100_000, "is not valid TOML: "),
    "100 kB of text": ("'" + "x" * 100_000 + "'", "ink.absorption_per_mm is 'xxx"),
    "beyond the largest float": (
        "1e400",
        "ink.absorption_per_mm is inf; it must be a finite number in 1/mm.",
    ),
    "date": ("1979-05-27", "ink.absorption_per_mm is datetime.date(1979, 5, 27); it must be a finite number"),
}


@pytest.mark.parametrize(("entry", "beginning"), ABSURD.values(), ids=ABSURD)
def test_absurd_entries(entry, beginning, tmp_path):
    text = edited(GOOD_SAMPLE, ("absorption_per_mm = 1.0", f"absorption_per_mm = {entry}"))
    sentence = sentence_of(text, tmp_path)
    assert sentence.startswith(beginning)
    assert len(sentence) < 2000
    assert sentence.isprintable()


def test_numbers_with_points_do_not_count_as_nested():
    wavelengths = ", ".join(f"{450 + 0.5 * k}" for k in range(100))
    text = edited(GOOD_SAMPLE, ("[450, 550]", f"[\n# a.b.c\n{wavelengths}]"))
    assert len(parse_sample(text).wavelengths_nm) == 100


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputRefusedError, match="absent.toml: there is no such sample file"):
        load_sample(tmp_path / "absent.toml")
    with pytest.raises(InputRefusedError, match="is a directory; give one sample file"):
        load_sample(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"schema_version = 1\n# \xb5m\n")
    with pytest.raises(
        InputRefusedError, match="latin.toml, row 2: byte 0xb5 is not UTF-8 text; save as UTF-8"
    ):
        load_sample(tmp_path / "latin.toml")
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputRefusedError, match="pipe.toml: is a pipe, but only ordinary files are read"):
        load_sample(tmp_path / "pipe.toml")
    (tmp_path / "large.toml").write_bytes(b"#" * 4_000_001)
    with pytest.raises(InputRefusedError, match="large.toml: is larger than 4 MB"):
        load_sample(tmp_path / "large.toml")


def test_a_byte_order_mark_is_left_out_and_utf_16_refused(tmp_path):
    path = tmp_path / "sample.toml"
    path.write_text(GOOD_SAMPLE, encoding="utf-8-sig")
    assert load_sample(path) == parse_sample(GOOD_SAMPLE)
    path.write_text(GOOD_SAMPLE, encoding="utf-16")
    with pytest.raises(InputRefusedError, match=r"sample\.toml: is UTF-16 text; save it as UTF-8\.$"):
        load_sample(path)
