"""Whatever stands in a file, reading it gives a valid object or one sentence that names it."""

import json
import resource
import shutil
import signal
import sys
import warnings
import zipfile
from contextlib import contextmanager
from pathlib import Path
from random import Random

import numpy as np
import pytest

import jaxink
from jaxink.data import simulated_example
from jaxink.ink.boundary_file import load_boundary
from jaxink.sample import sample_from_dict, sample_to_dict
from tests.fuzz import mutations
from tests.samples import GOOD_SAMPLE

LONGEST_SECONDS = 20
MOST_NEW_BYTES = 1_500_000_000
SURFACE = """\
wavelength_nm = [450, 550]
index_inside = [1.5, 1.49]
index_outside = 1.0
[height_map]
heights_um = "map.npy"
pitch_um = [0.5, 0.5]
method = "waves"
height_scale = 1.1
height_scale_standard_error = 0.01
"""
FURTHER = """\
[[layers]]
name = "paint"
kind = "scattering"
phase_function = "mie"
refractive_index = { dispersion = "cauchy", a = 1.49, b_um2 = 0.004 }
thickness_um = { tie = "2 * ink.thickness_um" }
radius_nm = { free = true, min = 100, max = 300, prior = { mean = 200, standard_deviation = 20 } }
volume_fraction = { per_wavelength = true, value = [0.1, 0.11] }
particle_index = 2.7
back_roughness = { density = "height_map", heights_um = "map.npy", pitch_um = 0.5 }
[[layers.populations]]
name = "filler"
radii_nm = [100, 200]
number_weights = [1, 2]
volume_fraction = 0.01
particle_index = { dispersion = "table", wavelength_nm = [400, 700], value = [1.6, 1.58] }
[[layers]]
name = "base"
kind = "scattering"
phase_function = "tabulated"
moments = [1, 0.5, 0.2]
refractive_index = 1.5
thickness_um = 100
scattering_per_mm = 10
absorption_per_mm = 1
front_roughness = { spectrum = "gaussian", height_rms_um = 0.1, correlation_length_um = 2 }
[backing]
reflectance = 0.5
side = "both"
[instrument]
source_half_angle_deg = 1
beam_diameter_mm = 2
detector_diameter_mm = 4
detector_mode = "broadband"
illumination = { wavelength_nm = [400, 700], power = [1, 2] }
[masks]
specular_half_angle_deg = 3
[[weights]]
theta_i_deg = 30
side = "R"
weight = 0.5
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With a map of heights that samples and surfaces may name."""
    folder = tmp_path_factory.mktemp("fuzz")
    x, y = np.meshgrid(*(np.linspace(0, 7, 64),) * 2)
    np.save(folder / "map.npy", 0.1 * np.sin(3 * x) * np.cos(2 * y))
    return folder


@contextmanager
def bounded(seconds: float):
    """End what hangs."""

    def late(*_):
        raise TimeoutError(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def fault(read, check, path: Path) -> str | None:
    """What is wrong with how a file is read, or None."""
    try:
        with bounded(LONGEST_SECONDS), warnings.catch_warnings():
            warnings.simplefilter("error")
            found = read(path)
            check(found)
    except jaxink.InputRefusedError as problem:
        sentence = str(problem)
        if not sentence.startswith(str(path.parent)):
            return f"names no file: {sentence}"
        if not sentence.isprintable() or len(sentence) > 2000 or sentence[-1] not in ".?":
            return f"is not one sentence: {sentence!r}"
    except BaseException as problem:
        if isinstance(problem, KeyboardInterrupt):
            raise
        return f"{type(problem).__name__}: {problem}"[:300]
    return None


def most_bytes() -> int:
    """The most memory that this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def faults(write, read, check, path: Path, seed: int, n_cases: int) -> dict[int, str]:
    """What is wrong, by the seed of the case."""
    found, before = {}, most_bytes()
    for case in range(seed * n_cases, (seed + 1) * n_cases):
        write(path, Random(case))
        if problem := fault(read, check, path):
            found[case] = problem
        if most_bytes() > before + MOST_NEW_BYTES:
            found[case] = f"takes {most_bytes() - before} bytes"
            before = most_bytes()
    return found


def write_csv(path, random):
    lines = simulated_example()[0].read_text(encoding="utf-8").split("\n")
    path.write_bytes(mutations.csv("\n".join(lines[:: random.choice((1, 10))]), random))


def write_workbook(path, random):
    """Faults of the packed file, or of one of the texts in it."""
    openpyxl = pytest.importorskip("openpyxl")
    lines = simulated_example()[0].read_text(encoding="utf-8").split("\n")[:40]
    book = openpyxl.Workbook()
    for line in lines:
        book.active.append([float(c) if c.replace(".", "").isdigit() else c for c in line.split(",")])
    book.save(path)
    if random.random() < 0.3:
        path.write_bytes(mutations.bytes_of(path.read_bytes(), random))
        return
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = random.choice(sorted(members))
    members[name] = mutations.bytes_of(members[name], random)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def write_sample(path, random):
    text = GOOD_SAMPLE + FURTHER if random.random() < 0.7 else GOOD_SAMPLE
    path.write_bytes(mutations.toml(text, random))


def write_surface(path, random):
    path.write_bytes(mutations.toml(SURFACE, random))


def write_heights(path, random):
    np.save(path, np.linspace(0, 1, 20 * 20).reshape(20, 20))
    path.write_bytes(mutations.bytes_of(path.read_bytes()[: random.choice((128, 10_000))], random))


def write_height_text(path, random):
    rows = [",".join(f"{0.1 * (i * k % 7):g}" for k in range(20)) for i in range(20)]
    path.write_bytes(mutations.csv("\n".join(rows), random))


def write_result(path, random, saved):
    shutil.copytree(saved, path.parent, dirs_exist_ok=True)
    path.write_bytes(mutations.json_text(json.loads(path.read_bytes()), random))


def write_points(path, random, saved):
    shutil.copytree(saved, path.parent, dirs_exist_ok=True)
    mutations.netcdf(path, random)


def check_data(data):
    for name in ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "bsdf_per_sr"):
        assert np.isfinite(getattr(data, name)).all(), name
    assert data.sigma_per_sr is None or (data.sigma_per_sr > 0).all()
    assert all(len(values) == len(data) for values in data.extra.values())


def check_sample(sample):
    assert np.isfinite(list(sample.parameters.values_with({}).values())).all()
    plain = sample_to_dict(sample)
    again = json.loads(json.dumps(plain, allow_nan=False))
    assert sample_to_dict(sample_from_dict(again)) == plain


def check_result(result):
    check_sample(result.sample)
    check_data(result.data)
    json.dumps(result.to_dict(), allow_nan=False)


def heights_of(path):
    """As a sample reads them, whose refusal names the key before the file."""
    from jaxink.sample.heights import read_heights
    from jaxink.surfaces.height_map import HeightMap

    try:
        return HeightMap(read_heights(path.name, "heights_um", path.parent), 1.0)
    except jaxink.InputRefusedError as problem:
        raise jaxink.InputRefusedError(f"{path.parent}: {problem}") from None


def anything(_):
    pass


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(
    ("name", "write", "read", "check"),
    [
        ("data.csv", write_csv, jaxink.read, check_data),
        ("data.xlsx", write_workbook, jaxink.read, check_data),
        ("sample.toml", write_sample, jaxink.load_sample, check_sample),
        ("surface.toml", write_surface, load_boundary, anything),
        ("heights.npy", write_heights, heights_of, anything),
        ("heights.csv", write_height_text, heights_of, anything),
    ],
    ids=["measurement", "workbook", "sample", "surface", "heights", "text of heights"],
)
def test_inputs(name, write, read, check, seed, folder):
    assert faults(write, read, check, folder / name, seed, 60) == {}


@pytest.fixture(scope="module")
def saved(example_result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    example_result.save(folder)
    return folder


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("name", "write"), [("result.json", write_result), ("result.nc", write_points)])
def test_results(name, write, seed, saved, tmp_path):
    def load(path):
        return jaxink.load_result(path.parent)

    found = faults(lambda p, r: write(p, r, saved), load, check_result, tmp_path / name, seed, 60)
    assert found == {}


@pytest.mark.parametrize("seed", range(2))
def test_measurements_in_netcdf(seed, tmp_path):
    jaxink.read(simulated_example()[0]).to_netcdf(tmp_path / "whole.nc")

    def write(path, random):
        shutil.copyfile(tmp_path / "whole.nc", path)
        mutations.netcdf(path, random)

    assert faults(write, jaxink.read, check_data, tmp_path / "data.nc", seed, 60) == {}
