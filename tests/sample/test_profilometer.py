"""Height maps of profilometers come back in um, with the distances of their points."""

import hashlib
import io
import sys
import warnings
import zipfile

import numpy as np
import pytest

from jaxink.errors import InputRefusedError
from jaxink.ink.boundary_file import load_boundary
from jaxink.sample.heights import SUFFIXES, read_heights, read_map

Y, X = np.meshgrid(np.arange(24.0), np.arange(32.0), indexing="ij")
HEIGHTS_UM = 0.3 * np.sin(X / 3) * np.cos(Y / 4) + 2.0 + 0.05 * X - 0.02 * Y
PITCH_UM = (0.5, 0.25)


@pytest.fixture
def surface():
    surfalize = pytest.importorskip("surfalize", reason="surfalize is not installed: jaxink[profilometer]")
    with warnings.catch_warnings():
        # Of distances that differ along x and y.
        warnings.simplefilter("ignore")
        return surfalize.Surface(HEIGHTS_UM, step_x=PITCH_UM[1], step_y=PITCH_UM[0])


@pytest.mark.parametrize("name", ["map.x3p", "map.sur", "MAP.X3P"])
def test_heights_and_distances_are_in_um(name, surface, tmp_path):
    surface.save(tmp_path / name.lower())
    (tmp_path / name.lower()).rename(tmp_path / name)
    heights, pitch = read_map(name, None, "height_map", tmp_path)
    np.testing.assert_allclose(pitch, PITCH_UM, rtol=1e-6)
    # Only differences have a meaning: sur files keep the mean as a 32-bit number.
    np.testing.assert_allclose(heights - heights.mean(), HEIGHTS_UM - HEIGHTS_UM.mean(), atol=1e-6)
    np.testing.assert_array_equal(read_heights(name, "heights_um", tmp_path), heights)


def x3p_by_hand(heights_m, pitch_m):
    """A file in the words of ISO 25178-72, written without the package: x is the fastest index."""
    rows, columns = heights_m.shape
    axes = "".join(
        f"<C{name}><AxisType>{kind}</AxisType><DataType>D</DataType><Increment>{step!r}</Increment>"
        f"<Offset>0</Offset></C{name}>"
        for name, kind, step in (("X", "I", pitch_m[1]), ("Y", "I", pitch_m[0]), ("Z", "A", 1.0))
    )
    xml = (
        '<?xml version="1.0" encoding="UTF-8"?><p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">'
        f"<Record1><Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>{axes}</Axes>"
        f"</Record1><Record3><MatrixDimension><SizeX>{columns}</SizeX><SizeY>{rows}</SizeY><SizeZ>1</SizeZ>"
        "</MatrixDimension><DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink></Record3>"
        "</p:ISO5436_2>"
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("md5checksum.hex", f"{hashlib.md5(xml.encode()).hexdigest()} *main.xml")
        archive.writestr("bindata/data.bin", heights_m.astype("<f8").tobytes())
    return file.getvalue()


def test_a_file_by_hand_has_metres(surface, tmp_path):
    (tmp_path / "map.x3p").write_bytes(x3p_by_hand(HEIGHTS_UM * 1e-6, (0.5e-6, 0.25e-6)))
    heights, pitch = read_map("map.x3p", [0.5, 0.25], "height_map", tmp_path)
    np.testing.assert_allclose(heights, HEIGHTS_UM, rtol=1e-9)
    np.testing.assert_allclose(pitch, PITCH_UM, rtol=1e-9)


def test_a_boundary_has_the_map_less_its_plane(surface, tmp_path):
    surface.save(tmp_path / "map.x3p")
    (tmp_path / "surface.toml").write_text(
        "index_inside = 1.5\nindex_outside = 1.0\nwavelength_nm = 550\n"
        '[height_map]\nheights_um = "map.x3p"\nmethod = "waves"\n'
    )
    heights = load_boundary(tmp_path / "surface.toml").heights
    np.testing.assert_allclose(heights.pitch_um, PITCH_UM, rtol=1e-9)
    plane = np.stack([np.ones(X.size), X.ravel(), Y.ravel()], axis=1)
    found = np.linalg.lstsq(plane, HEIGHTS_UM.ravel(), rcond=None)[0]
    np.testing.assert_allclose(heights.heights_um, HEIGHTS_UM - (plane @ found).reshape(X.shape), atol=1e-12)


def test_another_pitch_than_that_of_the_file_is_refused(surface, tmp_path, refused):
    surface.save(tmp_path / "map.x3p")
    with refused("height_map.pitch_um", "0.5, 0.25"):
        read_map("map.x3p", 0.5, "height_map", tmp_path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_damaged_files_are_refused(suffix, surface, tmp_path):
    surface.save(tmp_path / f"whole{suffix}")
    content = (tmp_path / f"whole{suffix}").read_bytes()
    for damaged in (b"", b"no map", content[: len(content) // 2], content[:100]):
        (tmp_path / f"map{suffix}").write_bytes(damaged)
        with pytest.raises(InputRefusedError, match=f"map{suffix}"):
            read_heights(f"map{suffix}", "heights_um", tmp_path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_without_the_package_a_sentence_says_how_to_install_it(suffix, tmp_path, monkeypatch, refused):
    (tmp_path / f"map{suffix}").write_bytes(b"anything")
    monkeypatch.setitem(sys.modules, "surfalize", None)
    with refused(f"map{suffix}", "pip install 'jaxink[profilometer]'"):
        read_heights(f"map{suffix}", "heights_um", tmp_path)
