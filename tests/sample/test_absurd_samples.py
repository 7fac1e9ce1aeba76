"""Files that nobody means, refused at once by one sentence, as those are that somebody meant otherwise."""

import os

import pytest

from jaxink.sample import load_sample, parse_sample
from tests.samples import GOOD_SAMPLE, edited

# What stands for a number, and what is named.
ABSURD = {
    "400 digits": ("1" * 400, "layers.absorption_per_mm"),
    "5000 digits": ("1" * 5000, "64 bits"),
    "5000 hexadecimal digits": ("0x" + "f" * 5000, "layers.absorption_per_mm"),
    "first above 64 bits": (str(2**63), "layers.absorption_per_mm"),
    "large integer deep within": (
        "[[{ value = [" + "1" * 400 + "] }]]",
        "layers.absorption_per_mm.value",
    ),
    "arrays": ("[" * 900 + "]" * 900, "row 15"),
    "arrays without an end": ("[" * 900, "row 15"),
    "arrays not too deep": (
        "[" * 30 + "]" * 30,
        "ink.absorption_per_mm",
    ),
    "tables": ("{ a = " * 900 + "1" + " }" * 900, "row 15"),
    "dotted key": ("1\n" + "a." * 20_000 + "a = 1", "row 16"),
    "dotted key of texts": ("1\n" + '"a" . ' * 20_000 + "a = 1", "row 16"),
    "dotted header": ("1\n[" + "a." * 20_000 + "a]", "row 16"),
    "brackets in a comment": (
        "9e9 # " + "[" * 900,
        "ink.absorption_per_mm",
    ),
    "brackets in a text": ("'" + "[" * 900 + "\\'", "ink.absorption_per_mm"),
    "brackets in an escaped text": ('"\\"' + "[" * 900 + '"', "ink.absorption_per_mm"),
    "dots in lines of text": ("'''\n" + "a." * 900 + "''\\'''", "ink.absorption_per_mm"),
    "brackets in lines of text": ('"""\n""' + "[" * 900 + '\\""""', "ink.absorption_per_mm"),
    "text without an end": ('"""' + '\\"""' * 100_000, "TOML"),
    "100 kB of text": ("'" + "x" * 100_000 + "'", "ink.absorption_per_mm"),
    "beyond the largest float": (
        "1e400",
        "ink.absorption_per_mm",
    ),
    "date": ("1979-05-27", "ink.absorption_per_mm"),
}


@pytest.mark.parametrize(("entry", "named"), ABSURD.values(), ids=ABSURD)
def test_absurd_entries(entry, named, refused_sample):
    text = edited(GOOD_SAMPLE, ("absorption_per_mm = 1.0", f"absorption_per_mm = {entry}"))
    sentence = refused_sample(text, named)
    assert len(sentence) < 2000
    assert sentence.isprintable()


def test_numbers_with_points_do_not_count_as_nested():
    wavelengths = ", ".join(f"{450 + 0.5 * k}" for k in range(100))
    text = edited(GOOD_SAMPLE, ("[450, 550]", f"[\n# a.b.c\n{wavelengths}]"))
    assert len(parse_sample(text).wavelengths_nm) == 100


def test_files_that_cannot_be_read(tmp_path, refused):
    with refused("absent.toml"):
        load_sample(tmp_path / "absent.toml")
    with refused(tmp_path):
        load_sample(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"schema_version = 1\n# \xb5m\n")
    with refused("latin.toml"):
        load_sample(tmp_path / "latin.toml")
    os.mkfifo(tmp_path / "pipe.toml")
    with refused("pipe.toml"):
        load_sample(tmp_path / "pipe.toml")
    (tmp_path / "large.toml").write_bytes(b"#" * 4_000_001)
    with refused("large.toml"):
        load_sample(tmp_path / "large.toml")


def test_a_byte_order_mark_is_left_out_and_utf_16_refused(tmp_path, refused):
    path = tmp_path / "sample.toml"
    path.write_text(GOOD_SAMPLE, encoding="utf-8-sig")
    assert load_sample(path) == parse_sample(GOOD_SAMPLE)
    path.write_text(GOOD_SAMPLE, encoding="utf-16")
    with refused("sample.toml"):
        load_sample(path)
