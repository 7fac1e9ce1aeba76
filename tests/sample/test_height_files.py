"""Files of heights: what they claim is checked against what they hold before it is read."""

import os
import struct

import numpy as np
import pytest

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


BAD = {
    "a trillion values": (npy(head("(1000000, 1000000)")), 8 * 10**12),
    "more than can be counted": (npy(head(f"({10**30},)")), 8 * 10**30),
    "negative": (npy(head("(-3, -4)")), ""),
    "too short": (npy(head("(13,)")), 104),
    "something behind": (npy(head("(11,)")), 88),
    "objects": (npy(head(descr="'|O'")), ""),
    "complex": (npy(head(descr="'<c16'")), ""),
    "table": (npy(head(descr="[('x', '<f8')]")), ""),
    "text": (npy(head(descr="'S8'")), ""),
    "no type": (npy(head(descr="'<q99'")), ""),
    "too many axes": (npy(head("(" + "1," * 70 + "12)")), ""),
    "nested": (npy("(" * 5000), ""),
    "signs": (npy("-" * 9000 + "1"), ""),
    "long head": (npy(head() + " " * 60_000), ""),
    "later version": (npy(head(), version=(9, 0)), ""),
    "archive": (b"PK\x03\x04", ""),
    "empty": (b"", ""),
}


@pytest.mark.parametrize(("content", "named"), BAD.values(), ids=BAD)
def test_bad_arrays_are_refused(content, named, tmp_path, refused):
    path = tmp_path / "map.npy"
    path.write_bytes(content)
    with refused("heights_um", path, named):
        read_heights("map.npy", "heights_um", tmp_path)


BAD_TEXTS = {
    "latin": (b"1,2\n3,\xb5\n", "row 2"),
    "UTF-16": ("1,2".encode("utf-16"), "16"),
    "long cell": (b"1" * 200_000, "row 1"),
    "empty": (b"\n\n", ""),
}


@pytest.mark.parametrize(("content", "named"), BAD_TEXTS.values(), ids=BAD_TEXTS)
def test_bad_texts_are_refused(content, named, tmp_path, refused):
    path = tmp_path / "map.csv"
    path.write_bytes(content)
    with refused("heights_um", path, named):
        read_heights("map.csv", "heights_um", tmp_path)


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("pipe.npy", "pipe.npy"),
        ("zero.csv", "zero.csv"),
        ("a\0b.npy", ".npy"),
        ("x" * 300 + ".npy", ".npy"),
    ],
    ids=["pipe", "device", "zero byte", "long"],
)
def test_other_files_are_refused(name, named, tmp_path, refused):
    os.mkfifo(tmp_path / "pipe.npy")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    with refused("heights_um", named):
        read_heights(name, "heights_um", tmp_path)


def test_heights_beyond_any_surface_are_refused(tmp_path, refused):
    from jaxink.surfaces.height_map import HeightMap

    heights = np.zeros((20, 20))
    heights[3, 4] = -1e300
    with refused("1e+300 um"):
        HeightMap(heights, 1.0)
