"""Files of heights: what they claim is checked against what they hold before it is read."""

import os
import struct

import numpy as np
import pytest

from jaxink.errors import InputRefusedError
from jaxink.sample.heights import read_heights

HEIGHTS = np.arange(12.0).reshape(3, 4)


def npy(head: str, content: bytes = bytes(96), version=(1, 0)) -> bytes:
    text = head.encode("latin1") + b"\n"
    return b"\x93NUMPY" + bytes(version) + struct.pack("<H", len(text)) + text + content


def head(shape: str = "(3, 4)", descr: str = "'<f8'") -> str:
    return f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i2", "|u1"])
def test_arrays_come_back_as_numpy_wrote_them(dtype, order, tmp_path):
    np.save(tmp_path / "map.npy", np.array(HEIGHTS, dtype, order=order))
    np.testing.assert_array_equal(read_heights("map.npy", "heights_um", tmp_path), HEIGHTS)


def test_texts_may_begin_with_a_byte_order_mark(tmp_path):
    (tmp_path / "map.csv").write_text("1,2\n,4\n", encoding="utf-8-sig")
    np.testing.assert_array_equal(read_heights("map.csv", "heights_um", tmp_path), [[1, 2], [np.nan, 4]])


CLAIMS = "an array of the shape {} takes {} bytes, but 96 follow its head; write the file anew."
NO_MAP = "must hold one array of real numbers, of one or two axes."
BAD = {
    "a trillion values": (npy(head("(1000000, 1000000)")), CLAIMS.format((10**6, 10**6), 8 * 10**12)),
    "more than can be counted": (npy(head(f"({10**30},)")), CLAIMS.format((10**30,), 8 * 10**30)),
    "negative": (npy(head("(-3, -4)")), NO_MAP),
    "too short": (npy(head("(13,)")), CLAIMS.format((13,), 104)),
    "something behind": (npy(head("(11,)")), CLAIMS.format((11,), 88)),
    "objects": (npy(head(descr="'|O'")), NO_MAP),
    "complex": (npy(head(descr="'<c16'")), NO_MAP),
    "table": (npy(head(descr="[('x', '<f8')]")), NO_MAP),
    # NumPy warns of this type.
    "old type of text": (npy(head(descr="'a8'")), NO_MAP),
    "no type": (npy(head(descr="'<q99'")), "is not a readable .npy file (descr is not a valid dtype"),
    "too many axes": (npy(head("(" + "1," * 70 + "12)")), NO_MAP),
    "nested": (npy("(" * 5000), "is not a readable .npy file ("),
    "signs": (npy("-" * 9000 + "1"), "is not a readable .npy file ("),
    "long head": (npy(head() + " " * 60_000), "is not a readable .npy file ("),
    "later version": (npy(head(), version=(9, 0)), "is not a readable .npy file ("),
    "archive": (b"PK\x03\x04", "is not a readable .npy file ("),
    "empty": (b"", "is not a readable .npy file ("),
}


@pytest.mark.parametrize(("content", "beginning"), BAD.values(), ids=BAD)
def test_bad_arrays_are_refused(content, beginning, tmp_path):
    path = tmp_path / "map.npy"
    path.write_bytes(content)
    with pytest.raises(InputRefusedError) as caught:
        read_heights("map.npy", "heights_um", tmp_path)
    assert str(caught.value).startswith(f"heights_um names {path}: {beginning}")


BAD_TEXTS = {
    "latin": (b"1,2\n3,\xb5\n", ", row 2: byte 0xb5 is not UTF-8 text; save as UTF-8."),
    "UTF-16": ("1,2".encode("utf-16"), ": is UTF-16 text; save it as UTF-8."),
    "long cell": (b"1" * 200_000, ", row 1: is not CSV text (field larger than field limit (131072))."),
    "empty": (b"\n\n", ": is empty."),
}


@pytest.mark.parametrize(("content", "end"), BAD_TEXTS.values(), ids=BAD_TEXTS)
def test_bad_texts_are_refused(content, end, tmp_path):
    path = tmp_path / "map.csv"
    path.write_bytes(content)
    with pytest.raises(InputRefusedError) as caught:
        read_heights("map.csv", "heights_um", tmp_path)
    assert str(caught.value) == f"heights_um names {path}{end}"


@pytest.mark.parametrize(
    ("name", "end"),
    [
        ("pipe.npy", "is a pipe, but only ordinary files are read; write the file of heights to one."),
        (
            "zero.csv",
            "is a device, but only ordinary files are read; write the file of heights to one.",
        ),
        ("a\0b.npy", "holds a zero byte, which no file's name can; name one file of heights."),
        ("x" * 300 + ".npy", "the name is longer than any file's can be; name one file of heights."),
    ],
)
def test_other_files_are_refused(name, end, tmp_path):
    os.mkfifo(tmp_path / "pipe.npy")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    with pytest.raises(InputRefusedError, match=r"^heights_um names .*\.(npy|csv)'?: ") as caught:
        read_heights(name, "heights_um", tmp_path)
    assert str(caught.value).endswith(end)


def test_heights_beyond_any_surface_are_refused(tmp_path):
    from jaxink.surfaces.height_map import HeightMap

    heights = np.zeros((20, 20))
    heights[3, 4] = -1e300
    with pytest.raises(InputRefusedError, match=r"has a height of 1e\+300 um; none may be above 1e\+06 um"):
        HeightMap(heights, 1.0)
