"""Saved results that are not what was saved: refused with file and key, never a traceback or a mixture."""

import dataclasses
import json
import os
import re
import shutil

import h5py
import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import read_dataset, write_dataset

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


def sentence(folder):
    with pytest.raises(InputRefusedError) as caught:
        jaxink.load_result(folder)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 1000
    return text.replace(f"{folder}{os.sep}", "")


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
    first = dataclasses.replace(
        example_result.parameters[0], value=np.nan, minimum=-np.inf, maximum=np.inf, standard_error=None
    )
    search = dataclasses.replace(example_result.searches[0], loss_start=np.inf)
    result = dataclasses.replace(
        example_result, parameters=(first, *example_result.parameters[1:]), searches=(search,), whitened=None
    )
    result.save(tmp_path)
    loaded = jaxink.load_result(tmp_path)
    assert (loaded.parameters[0].minimum, loaded.parameters[0].maximum) == (-np.inf, np.inf)
    assert np.isnan(loaded.parameters[0].value)
    assert np.isnan(loaded.searches[0].loss_start)
    assert loaded.whitened is None


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("absent", "absent: there is no result there; `jaxink fit` writes one."),
        ("a\0b", "holds a zero byte, which no file's name can"),
        ("x" * 300, "there is no result there; `jaxink fit` writes one."),
    ],
)
def test_where_there_is_no_result(path, words, tmp_path):
    assert words in sentence(tmp_path / path)


def test_files_of_two_results_are_refused(folder, example_result, tmp_path):
    merit = dataclasses.replace(example_result.merit, chi_square=593.6)
    dataclasses.replace(example_result, merit=merit).save(tmp_path / "other")
    shutil.copy(tmp_path / "other" / "result.nc", folder)
    assert sentence(folder) == (
        "result.nc: belongs to another result than result.json beside it (their result_id differ); put the "
        "files of one result together, or fit again."
    )


def test_a_result_of_before_there_was_an_identifier_is_read(folder, example_result):
    plain = json.loads((folder / "result.json").read_text())
    del plain["result_id"]
    (folder / "result.json").write_text(json.dumps(plain))
    # One file alone without it is of another jaxink.
    assert "belongs to another result" in sentence(folder)
    dataset = read_dataset(folder / "result.nc")
    del dataset.attrs["result_id"]
    write_dataset(dataset, folder / "result.nc")
    assert jaxink.load_result(folder).merit == example_result.merit


def deep(levels):
    return "[" * levels + "]" * levels


# A text, as pytest names tests by what they are given and xdist compares the names.
GONE = "no such key"
SPOILED = [
    ("sample", GONE, "sample is missing."),
    ("solver", GONE, "solver is missing."),
    ("data_file", GONE, "data_file is missing."),
    ("colour", "red", "colour is a key that this jaxink does not know; known are: schema_version, outcome, "),
    ("sample.layers", [], "sample: layers has none that scatters; there must be one."),
    ("sample.layers.0.kind", "glass", "sample: kind of layer 'plate' is 'glass'; it must be one of: clear, "),
    (
        "sample.layers.1.phase_function",
        None,
        "sample: phase_function of layer 'ink' is None; it must be one ",
    ),
    ("sample.layers.1.phase_function", "rayleigh", None),
    ("sample.layers.1.phase_function", "mie", "sample: parameters has no ink.radius_nm, which the sample "),
    ("sample.layers.1.opaque", 1, "sample.layers[1].opaque is 1; it must be true or false."),
    ("sample.layers.1.name", GONE, "sample.layers[1].name is missing."),
    ("sample.layers.0.opaque", True, "sample: a layer before the last one is opaque; only the last one may "),
    ("sample.parameters", [], "sample: parameters has no surroundings.index_front, which the sample needs."),
    ("sample.parameters.0.value", None, "sample.parameters[0]: value of surroundings.index_front is nan; "),
    ("sample.parameters.0.value", "1", "sample.parameters[0].value is '1'; it must be a finite number."),
    ("sample.parameters.0.scale", "square", "sample.parameters[0]: scale of surroundings.index_front is "),
    ("sample.parameters.0.prior", {"mean": 1}, "sample.parameters[0].prior.standard_deviation is missing."),
    ("sample.wavelengths_nm", 550, "sample.wavelengths_nm is 550; it must be a list."),
    ("sample.masks", [["specular_half_angle_deg"]], "sample.masks[0] has 1 entries; it must have 2."),
    ("sample.weights", [[None, "B", 1.0]], "sample: side of weights is 'B'; it must be one of: R, T."),
    ("sample.noise.relative", True, "sample.noise.relative is true; it must be a finite number."),
    ("solver.nodes_escaping", 10**6, "solver: nodes_escaping is 1000000; it must be at most 4096."),
    ("solver.nodes_escaping", 0, "solver: nodes_escaping is 0; it must be a whole number of at least 1."),
    ("solver.n_moments", 12.5, "solver.n_moments is 12.5; it must be a whole number."),
    ("schema_version", True, "schema_version is true; this jaxink reads results of version 1."),
    ("schema_version", GONE, "schema_version is null; this jaxink reads results of version 1."),
    ("outcome", "converged", "outcome is 'converged'; it must be a table."),
    ("outcome.code", "done", "outcome.code is 'done'; it must be one of: converged, max_steps, "),
    ("objective", "chi", "objective is 'chi'; it must be one of: chi_square, "),
    ("parameters", [], "parameters and sample.parameters must name the same parameters."),
    ("parameters.0.interval", [1, 2, 3], "parameters[0].interval has 3 entries; it must have 2."),
    ("correlation_names", ["a", "b", "c"], "an entry of correlation_names is 'a'; it must be one of: "),
    ("correlations", [[1.0, 2.0]], "correlations must have 3 rows of 3, as correlation_names has."),
    ("correlations", [[1], [1, 1], []], "correlations must have 3 rows of 3, as correlation_names has."),
    ("merit.points", 1.5, "merit.points is 1.5; it must be a whole number."),
    ("noise.origin", GONE, "noise.origin is missing."),
    ("noise.more", 1, "noise.more is a key that this jaxink does not know; known are: origin, "),
    ("profiles.0.rise", {"a": 1}, "profiles[0].rise is a table of 1; it must be a list."),
    ("searches.0.start", [1], "searches[0].start is a list of 1; it must be a table."),
    ("versions.jax", 9, "versions.jax is 9; it must be a text."),
    ("notes", [1], "notes[0] is 1; it must be a text."),
    ("data_file", "../result.nc", "data_file is '../result.nc'; it must be the name of a file in the same "),
    ("data_file", "", "data_file is ''; it must be the name of a file in the same folder."),
    ("data_file", "other.nc", "other.nc: there is no such netCDF file"),
    ("data_file", "a\0b", "data_file is 'a\\x00b'; it must be the name of a file in the same folder."),
]


@pytest.mark.parametrize(("key", "value", "words"), SPOILED, ids=[f"{s[0]} {s[1]!r}"[:60] for s in SPOILED])
def test_a_spoiled_key_is_named(key, value, words, folder):
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
    if words is None:
        # Fewer words ask for fewer numbers.
        assert jaxink.load_result(folder).sample.layers[1].phase_function == value
        return
    said = sentence(folder)
    assert said.removeprefix("result.json: ").startswith(words), said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"schema_version": 1, "seed": ' + "9" * 400 + "}", "(a whole number has 400 digits)."),
        ('{"schema_version": 1, "seed": -' + "9" * 5000 + "}", "(a whole number has 5000 digits)."),
        ('{"schema_version": 1, "seed": NaN}', "(NaN is no number that JSON knows)."),
        ('{"schema_version": 1, "seed": -Infinity}', "(-Infinity is no number that JSON knows)."),
        (deep(900), "schema_version is null; this jaxink reads results of version 1."),
        (deep(200_000), "(tables or lists stand in each other too deep)."),
        ('{"schema_version": 1, "sample": ' + deep(900) + "}", "outcome is missing."),
        ('{"schema_version": 1, "' + "k" * 5000 + '": 1}', "... is a key that this jaxink does not know; "),
        ("", "is not a result of jaxink (Expecting value: line 1 column 1 (char 0))."),
        ("[]", "schema_version is null; this jaxink reads results of version 1."),
        (b"\xff\xfe{", "is not a result of jaxink; it is not UTF-8 text."),
    ],
    ids=lambda value: repr(value)[:40],
)
def test_what_no_result_says_is_refused(text, words, folder):
    content = text if isinstance(text, bytes) else text.encode()
    (folder / "result.json").write_bytes(content)
    said = sentence(folder)
    assert said.startswith("result.json: ")
    assert words in said


@pytest.mark.parametrize("name", ["result.json", "result.nc"])
@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "nothing"])
def test_what_is_no_file_is_refused(kind, name, folder):
    (folder / name).unlink()
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "device":
        (folder / name).symlink_to("/dev/zero")
    elif kind == "folder":
        (folder / name).mkdir()
    said = sentence(folder)
    words = {
        "pipe": "is a pipe",
        "device": "is a device",
        "folder": "is a directory",
        "nothing": "there is no ",
    }
    assert said.startswith(f"{name}: {words[kind]}")


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
    ("change", "words"),
    [
        (
            claim,
            r"its variables claim 800,000 MB, but the file has 0\.\d+ MB; it is damaged, or not of jaxink\.",
        ),
        (shorten, r"(variable predicted_per_sr has the dimensions|is not a readable netCDF 4 file)"),
        (lambda file: file.pop("predicted_per_sr"), "variable predicted_per_sr is missing"),
        (lambda file: file.pop("mask"), "variable mask is missing"),
        (put("predicted_per_sr", lambda n: np.full(n, b"x")), "variable predicted_per_sr is of type "),
        (
            put("mask", lambda n: np.full(n, 0.5)),
            "variable mask is of type float64; that is not what it holds",
        ),
        (put("theta_i_deg", lambda n: np.full(n, np.nan)), r".*theta_i_deg\[0\] is nan; every value must be"),
        (lambda file: file.attrs.pop("notes"), "attribute notes is missing"),
        (lambda file: file.attrs.modify("notes", "[1]"), r"attribute notes\[0\] is 1; it must be a text"),
        (lambda file: file.attrs.modify("notes", "[" * 5000), "attribute notes .*too deep"),
        (lambda file: file.attrs.modify("attrs", "{"), r"attribute attrs \("),
        (lambda file: file.attrs.__setitem__("schema_version", "one"), "has schema_version one; "),
        (lambda file: file.attrs.__setitem__("schema", [1, 2]), "is not a jaxink measurement"),
        (lambda file: file.attrs.__setitem__("result_id", [1, 2]), "belongs to another result"),
    ],
)
def test_points_that_are_not_those_of_a_result_are_refused(change, words, folder):
    edit(folder / "result.nc", change)
    said = sentence(folder)
    assert re.match(rf"result\.nc: {words}", said), said


def flipped(content, random, first, last):
    content = bytearray(content)
    for place in random.integers(first, last, 4):
        content[place] ^= int(random.integers(1, 256))
    return content


def test_changed_bytes_never_come_to_hdf5(folder, monkeypatch):
    whole, random = (folder / "result.nc").read_bytes(), np.random.default_rng(7)
    end = len(whole) - CHECKSUM_BYTES
    found_by_trial = bytearray(whole)
    # With this byte of the heap of references to dimensions at 0, HDF5 never comes to an end.
    found_by_trial[whole.index(b"GCOL") + 2248] ^= 0x40
    monkeypatch.setattr(h5py, "File", lambda *_: pytest.fail("HDF5 was asked"))
    for content in (found_by_trial, *(flipped(whole, random, 0, end) for _ in range(20))):
        (folder / "result.nc").write_bytes(content)
        assert sentence(folder) == (
            "result.nc: is damaged: its checksum is not that of its content; take another copy of it."
        )


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
def test_a_truncated_file_is_refused(share, folder):
    content = (folder / "result.nc").read_bytes()
    (folder / "result.nc").write_bytes(content[: int(share * len(content))])
    assert sentence(folder) == "result.nc: is not a readable netCDF 4 file."
