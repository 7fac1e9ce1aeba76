"""Saved results that are not what was saved: refused with file and key, never a traceback or a mixture."""

import dataclasses
import json
import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import read_dataset, write_dataset
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.fitting.outcome import Outcome

CHECKSUM_BYTES = len(b"jaxink sha256 ") + 64


@pytest.fixture(scope="module")
def saved(tmp_path_factory, example_result):
    folder = tmp_path_factory.mktemp("saved") / "result"
    example_result.save(folder)
    return folder


@pytest.fixture
def folder(saved, tmp_path):
    """A copy that a test may spoil."""
    return shutil.copytree(saved, tmp_path / "result")


@pytest.fixture
def refused_result(refused):
    """Refuses the result in a folder by one sentence that names all of these."""

    def refuse(folder, *named, numbers=True):
        with refused(*named, numbers=numbers) as caught:
            jaxink.load_result(folder)
        text = str(caught.value)
        assert "\n" not in text
        assert len(text) < 1000

    return refuse


def test_the_code_of_an_outcome_is_that_of_its_file_and_documented(saved, example_result):
    code = example_result.outcome.code
    assert code == "converged" == json.loads((saved / "result.json").read_text())["outcome"]["code"]
    words = (Path(__file__).parents[2] / "docs" / "manual" / "result.md").read_text(encoding="utf-8")
    assert all(f"`{outcome.code}`" in words for outcome in Outcome)


def test_a_loaded_result_is_the_one_saved(saved, example_result, tmp_path):
    loaded = jaxink.load_result(saved)
    assert loaded.to_dict() == example_result.to_dict()
    for field in dataclasses.fields(loaded):
        first, second = (getattr(result, field.name) for result in (loaded, example_result))
        if field.name == "data":
            assert first.to_dataset().identical(second.to_dataset())
        elif isinstance(second, np.ndarray):
            np.testing.assert_array_equal(first, second)
        else:
            assert first == second, field.name
    loaded.save(tmp_path / "again")
    assert (tmp_path / "again" / "result.json").read_bytes() == (saved / "result.json").read_bytes()


def test_numbers_that_are_not_finite_come_back(example_result, tmp_path):
    first, *others = example_result.parameters.values()
    first = dataclasses.replace(first, value=np.nan, minimum=-np.inf, maximum=np.inf, standard_error=None)
    search = dataclasses.replace(example_result.searches[0], loss_start=np.inf)
    parameters = FittedParameters.of((first, *others))
    result = dataclasses.replace(example_result, parameters=parameters, searches=(search,), whitened=None)
    result.save(tmp_path)
    loaded = jaxink.load_result(tmp_path)
    again = loaded[first.name]
    assert (again.minimum, again.maximum) == (-np.inf, np.inf)
    assert np.isnan(again.value)
    assert np.isnan(loaded.searches[0].loss_start)
    assert loaded.whitened is None


@pytest.mark.parametrize("path", ["absent", "a\0b", "x" * 300], ids=["absent", "zero byte", "long"])
def test_where_there_is_no_result(path, tmp_path, refused_result):
    refused_result(tmp_path / path, path[0])


def test_files_of_two_results_are_refused(folder, example_result, tmp_path, refused_result):
    merit = dataclasses.replace(example_result.merit, chi_square=593.6)
    dataclasses.replace(example_result, merit=merit).save(tmp_path / "other")
    shutil.copy(tmp_path / "other" / "result.nc", folder)
    refused_result(folder, "result.nc", "result.json", "result_id")


def test_a_result_of_before_there_was_an_identifier_is_read(folder, example_result, refused_result):
    plain = json.loads((folder / "result.json").read_text())
    del plain["result_id"]
    (folder / "result.json").write_text(json.dumps(plain))
    # One file alone without it is of another jaxink.
    refused_result(folder, "result_id")
    dataset = read_dataset(folder / "result.nc")
    del dataset.attrs["result_id"]
    write_dataset(dataset, folder / "result.nc")
    assert jaxink.load_result(folder).merit == example_result.merit


def deep(levels):
    return "[" * levels + "]" * levels


# A text, as pytest names tests by what they are given and xdist compares the names.
GONE = "no such key"
SPOILED = [
    ("sample", GONE, "sample"),
    ("solver", GONE, "solver"),
    ("data_file", GONE, "data_file"),
    ("colour", "red", "colour"),
    ("sample.layers", [], "layers"),
    ("sample.layers.0.kind", "glass", "kind"),
    ("sample.layers.1.phase_function", None, "phase_function"),
    ("sample.layers.1.phase_function", "rayleigh", None),
    ("sample.layers.1.phase_function", "mie", "ink.radius_nm"),
    ("sample.layers.1.opaque", 1, "sample.layers[1].opaque"),
    ("sample.layers.1.name", GONE, "sample.layers[1].name"),
    ("sample.layers.0.opaque", True, "opaque"),
    ("sample.parameters", [], "surroundings.index_front"),
    ("sample.parameters.0.value", None, "sample.parameters[0]"),
    ("sample.parameters.0.value", "1", "sample.parameters[0].value"),
    ("sample.parameters.0.scale", "square", "sample.parameters[0]"),
    ("sample.parameters.0.prior", {"mean": 1}, "sample.parameters[0].prior.standard_deviation"),
    ("sample.wavelengths_nm", 550, "sample.wavelengths_nm"),
    ("sample.masks", [["specular_half_angle_deg"]], "sample.masks[0]"),
    ("sample.weights", [[None, "B", 1.0]], "side"),
    ("sample.noise.relative", True, "sample.noise.relative"),
    ("solver.nodes_escaping", 10**6, "nodes_escaping"),
    ("solver.nodes_escaping", 0, "nodes_escaping"),
    ("solver.n_moments", 12.5, "solver.n_moments"),
    ("schema_version", True, "schema_version"),
    ("schema_version", GONE, "schema_version"),
    ("outcome", "converged", "outcome"),
    ("outcome.code", "done", "outcome.code"),
    ("objective", "chi", "objective"),
    ("parameters", [], "parameters"),
    ("parameters.0.interval", [1, 2, 3], "parameters[0].interval"),
    ("correlation_names", ["a", "b", "c"], "correlation_names"),
    ("correlations", [[1.0, 2.0]], "correlations"),
    ("correlations", [[1], [1, 1], []], "correlations"),
    ("merit.points", 1.5, "merit.points"),
    ("noise.origin", GONE, "noise.origin"),
    ("noise.more", 1, "noise.more"),
    ("profiles.0.rise", {"a": 1}, "profiles[0].rise"),
    ("searches.0.start", [1], "searches[0].start"),
    ("versions.jax", 9, "versions.jax"),
    ("notes", [1], "notes[0]"),
    ("data_file", "../result.nc", "data_file"),
    ("data_file", "", "data_file"),
    ("data_file", "other.nc", "other.nc"),
    ("data_file", "a\0b", "data_file"),
]


@pytest.mark.parametrize(("key", "value", "named"), SPOILED, ids=[f"{s[0]} {s[1]!r}"[:60] for s in SPOILED])
def test_a_spoiled_key_is_named(key, value, named, folder, refused_result):
    plain = json.loads((folder / "result.json").read_text())
    *stems, last = (int(word) if word.isdigit() else word for word in key.split("."))
    table = plain
    for stem in stems:
        table = table[stem]
    if value is GONE:
        del table[last]
    else:
        table[last] = value
    (folder / "result.json").write_text(json.dumps(plain))
    if named is None:
        # Fewer words ask for fewer numbers.
        assert jaxink.load_result(folder).sample.layers[1].phase_function == value
        return
    refused_result(folder, named)


@pytest.mark.parametrize(
    "text",
    [
        '{"schema_version": 1, "seed": ' + "9" * 400 + "}",
        '{"schema_version": 1, "seed": -' + "9" * 5000 + "}",
        '{"schema_version": 1, "seed": NaN}',
        '{"schema_version": 1, "seed": -Infinity}',
        deep(900),
        deep(200_000),
        '{"schema_version": 1, "sample": ' + deep(900) + "}",
        '{"schema_version": 1, "' + "k" * 5000 + '": 1}',
        "",
        "[]",
        b"\xff\xfe{",
    ],
    ids=lambda text: repr(text)[:40],
)
def test_what_no_result_says_is_refused(text, folder, refused_result):
    content = text if isinstance(text, bytes) else text.encode()
    (folder / "result.json").write_bytes(content)
    refused_result(folder, "result.json: ")


@pytest.mark.parametrize("name", ["result.json", "result.nc"])
@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "nothing"])
def test_what_is_no_file_is_refused(kind, name, folder, refused_result):
    (folder / name).unlink()
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "device":
        (folder / name).symlink_to("/dev/zero")
    elif kind == "folder":
        (folder / name).mkdir()
    refused_result(folder, f"{name}: ")


def edit(path, change):
    """Change a netCDF file below the library that wrote it."""
    with h5py.File(path, "r+") as file:
        change(file)


def claim(file):
    del file["predicted_per_sr"]
    file.create_dataset("predicted_per_sr", (10**11,), "f8", chunks=(2**20,))


def shorten(file):
    values = file["predicted_per_sr"][:-1]
    del file["predicted_per_sr"]
    file["predicted_per_sr"] = values


def put(name, values):
    def change(file):
        scale = file["point"]
        del file[name]
        file[name] = values(len(scale))
        file[name].dims[0].attach_scale(scale)

    return change


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (claim, "800,000 MB"),
        (lambda file: file.pop("predicted_per_sr"), "predicted_per_sr"),
        (lambda file: file.pop("mask"), "mask"),
        (put("predicted_per_sr", lambda n: np.full(n, b"x")), "predicted_per_sr"),
        (put("mask", lambda n: np.full(n, 0.5)), "float64"),
        (put("theta_i_deg", lambda n: np.full(n, np.nan)), "theta_i_deg[0]"),
        (lambda file: file.attrs.pop("notes"), "notes"),
        (lambda file: file.attrs.modify("notes", "[1]"), "notes[0]"),
        (lambda file: file.attrs.modify("notes", "[" * 60_000), "notes"),
        (lambda file: file.attrs.modify("attrs", "{"), "attrs"),
        (lambda file: file.attrs.__setitem__("schema_version", "one"), "schema_version"),
        (lambda file: file.attrs.__setitem__("schema", [1, 2]), "schema"),
        (lambda file: file.attrs.__setitem__("result_id", [1, 2]), "result_id"),
    ],
    ids=[
        *("claims too much", "no prediction", "no mask", "texts", "mask of floats", "nan"),
        *("no notes", "number as a note", "deep", "no JSON", "version", "schema", "identifier"),
    ],
)
def test_points_that_are_not_those_of_a_result_are_refused(change, named, folder, refused_result):
    edit(folder / "result.nc", change)
    # The size of the file itself depends on the library that wrote it.
    refused_result(folder, "result.nc: ", named, numbers=change is not claim)


def test_values_of_another_length_are_refused(folder):
    edit(folder / "result.nc", shorten)
    # By jaxink, or by what reads netCDF before it.
    with pytest.raises(InputRefusedError, match=r"result\.nc: "):
        jaxink.load_result(folder)


def flipped(content, random, first, last):
    content = bytearray(content)
    for place in random.integers(first, last, 4):
        content[place] ^= int(random.integers(1, 256))
    return content


def test_changed_bytes_never_come_to_hdf5(folder, monkeypatch, refused_result):
    whole, random = (folder / "result.nc").read_bytes(), np.random.default_rng(7)
    end = len(whole) - CHECKSUM_BYTES
    found_by_trial = bytearray(whole)
    # With this byte of the heap of references to dimensions at 0, HDF5 never comes to an end.
    found_by_trial[whole.index(b"GCOL") + 2248] ^= 0x40
    monkeypatch.setattr(h5py, "File", lambda *_: pytest.fail("HDF5 was asked"))
    for content in (found_by_trial, *(flipped(whole, random, 0, end) for _ in range(20))):
        (folder / "result.nc").write_bytes(content)
        refused_result(folder, "result.nc: ")


def test_changed_bytes_of_a_file_without_a_checksum_end_in_a_sentence_or_in_a_result(folder):
    """Of one that was written before there were checksums, or by another program."""
    whole, random, refused = (folder / "result.nc").read_bytes(), np.random.default_rng(7), 0
    end = len(whole) - CHECKSUM_BYTES
    after_the_heap = whole.index(b"OHDR", whole.index(b"GCOL"))
    for _ in range(40):
        most = random.choice([after_the_heap + 5000, end])
        (folder / "result.nc").write_bytes(flipped(whole[:end], random, after_the_heap, most))
        said = None
        try:
            jaxink.load_result(folder)
        except InputRefusedError as problem:
            said = str(problem)
        refused += said is not None
        assert said is None or said.startswith(f"{folder / 'result.nc'}: ")
    assert refused > 10


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_a_truncated_file_is_refused(share, folder, refused_result):
    content = (folder / "result.nc").read_bytes()
    (folder / "result.nc").write_bytes(content[: int(share * len(content))])
    refused_result(folder, "result.nc: ")
