"""The command as its user starts it: refusals, exit codes, and what is loaded before it answers."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from jaxink.data import simulated_example

DATA, SAMPLE = map(str, simulated_example())
HEAVY = ("jax", "jaxlib", "equinox", "optimistix", "scipy", "numpy", "xarray", "matplotlib", "pandas")


def jaxink(*arguments, cwd, **environment):
    return subprocess.run(
        [sys.executable, "-m", "jaxink", *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def folder(tmp_path):
    """Inputs that are bad in one way each."""
    good_data, good_sample = (Path(path).read_text(encoding="utf-8") for path in (DATA, SAMPLE))
    lines = good_data.splitlines()
    (tmp_path / "bad.csv").write_text("\n".join([*lines[:3], lines[3].replace("R", "front"), *lines[4:]]))
    (tmp_path / "percent.csv").write_text(good_data.replace("bsdf_per_sr", "bsdf_percent"))
    (tmp_path / "bad.toml").write_text(good_sample.replace("thickness_um = 80", "thickness_um = -80"))
    (tmp_path / "red.toml").write_text(good_sample.replace("550", "650"))
    (tmp_path / "fixed.toml").write_text(good_sample.replace("free = true", "value = 0.5, free = false"))
    (tmp_path / "result").mkdir()
    (tmp_path / "result" / "result.json").write_text('{"schema_version": 99}')
    (tmp_path / "file").write_text("")
    return tmp_path


FIT = ("fit", DATA, "--sample", SAMPLE, "--out", "new")
REFUSED = [
    ("no such measurement", ("fit", "none.csv", *FIT[2:]), "none.csv: "),
    ("bad row", ("fit", "bad.csv", *FIT[2:]), "bad.csv, row 4"),
    ("per cent", ("fit", "percent.csv", *FIT[2:]), "percent.csv, column bsdf_percent"),
    ("measurement is a folder", ("fit", ".", *FIT[2:]), ".: "),
    ("no such sample", (*FIT[:3], "rid.toml", *FIT[4:]), "rid.toml: "),
    ("bad sample", (*FIT[:3], "bad.toml", *FIT[4:]), "ink.thickness_um"),
    ("another wavelength", (*FIT[:3], "red.toml", *FIT[4:]), "650 nm"),
    ("nothing free", (*FIT[:3], "fixed.toml", *FIT[4:]), "free"),
    ("result is a file", (*FIT[:5], "file"), "file: "),
    ("unknown method", (*FIT, "--method", "newton"), "method"),
    ("figures of no wavelength", (*FIT, "--figures-at", "560"), "550 nm"),
    ("no such parameter", ("predict", SAMPLE, DATA, "--out", "new.csv", "--set", "ink.thick=6"), "ink.thick"),
    ("no such side", (*FIT, "--side", "back"), "side"),
    ("prediction without directions", ("predict", SAMPLE, "--out", "new.csv"), "directions"),
    ("prediction of unknown format", ("predict", SAMPLE, DATA, "--out", "new.xlsx"), "new.xlsx: "),
    ("prediction into no folder", ("predict", SAMPLE, DATA, "--out", "none/new.csv"), "none/new.csv: "),
    ("prediction from no result", ("predict", "none", "--out", "new.csv"), "none: "),
    ("prediction from a later result", ("predict", "result", "--out", "new.csv"), "schema_version"),
    ("demo into a file", ("demo", "--out", "file"), "file: "),
]


@pytest.mark.parametrize(("arguments", "named"), [r[1:] for r in REFUSED], ids=[r[0] for r in REFUSED])
def test_refusal_is_one_sentence_and_writes_nothing(arguments, named, folder, told):
    before = sorted(folder.rglob("*"))
    done = jaxink(*arguments, cwd=folder)
    assert (done.returncode, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", named)
    assert done.stderr.count("\n") == 1
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("arguments", [("fit",), ("fly",), ("fit", DATA, "--warp", "9")])
def test_usage_errors_keep_their_own_code(arguments, tmp_path):
    done = jaxink(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("kind", ["density", "spectrum"])
def test_a_map_of_heights_in_a_sample_file_is_read_by_the_command(kind, tmp_path):
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(64, 0.5)] * 2))
    noise = np.fft.fft2(np.random.default_rng(4).normal(size=(64, 64)))
    np.save(tmp_path / "map.npy", np.fft.ifft2(noise * np.exp(-((12 * frequency) ** 2))).real)
    face = f'{{ {kind} = "height_map", heights_um = "map.npy", pitch_um = 0.5 }}'
    text = Path(SAMPLE).read_text(encoding="utf-8").replace("[noise]", f"back_roughness = {face}\n[noise]")
    (tmp_path / "rough.toml").write_text(text)
    command = ("predict", "rough.toml", DATA, "--out", "rough.csv", "--accuracy", "0.05")
    done = jaxink(*command, cwd=tmp_path, XDG_CACHE_HOME=str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert len((tmp_path / "rough.csv").read_text().splitlines()) > 50


IMPORTED_FIRST = """
import sys, jax
from jaxink.cli import main
sys.argv[0] = "jaxink"
main()
"""


def test_xla_is_silent_although_jax_was_imported_first(tmp_path):
    command = ("predict", SAMPLE, DATA, "--out", "new.csv", "--accuracy", "0.05", "--quiet")
    environment = {k: v for k, v in os.environ.items() if k != "TF_CPP_MIN_LOG_LEVEL"}
    # The second one loads what the first has compiled, of which XLA tells at length.
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", IMPORTED_FIRST, *command],
            cwd=tmp_path,
            env={**environment, "XDG_CACHE_HOME": str(tmp_path)},
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


HOST = """
import os, sys
from typer.testing import CliRunner
from jaxink.cli.app import app
done = CliRunner().invoke(app, sys.argv[1:])
assert done.exit_code == 0, done.output
print(os.environ["TF_CPP_MIN_LOG_LEVEL"])
"""


def test_the_log_of_a_host_program_is_its_own(tmp_path):
    environment = {k: v for k, v in os.environ.items() if k != "TF_CPP_MIN_LOG_LEVEL"}
    done = subprocess.run(
        [sys.executable, "-c", HOST, "predict", SAMPLE, DATA, "--out", "new.csv", "--accuracy", "0.05"],
        cwd=tmp_path,
        env={**environment, "XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    # What JAX itself sets.
    assert done.stdout == "1\n"


LOADED = """
import json, sys
from jaxink.cli import main
sys.argv = ["jaxink", *json.loads(sys.argv[1])]
try:
    main()
except SystemExit:
    pass
print("\\n" + json.dumps(sorted(sys.modules)))
"""


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        (["--help"], ()),
        (["fit", "--help"], ()),
        (["--version"], ()),
        (["fit", DATA, "--sample", "none.toml", "--out", "new"], ("numpy",)),
        (["init", DATA, "--out", "new.toml"], ("numpy",)),
    ],
    ids=["help", "fit help", "version", "refusal", "init"],
)
def test_nothing_heavy_is_loaded_before_it_is_needed(arguments, allowed, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", LOADED, json.dumps(arguments)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    loaded = json.loads(done.stdout.splitlines()[-1])
    assert [name for name in HEAVY if name in loaded and name not in allowed] == []


CACHED = """
import sys
from jaxink.cli.session import prepare_jax
prepare_jax()
import jax
print(jax.config.jax_compilation_cache_dir)
jax.jit(lambda x: x * 2 + 1)(1.0).block_until_ready()
"""


@pytest.mark.parametrize("case", ["user", "named", "unwritable", "open"])
def test_compiled_programs_are_kept(case, tmp_path):
    if case == "open" and os.name != "posix":
        pytest.skip("rights as POSIX has them")
    chosen = "JAX_COMPILATION_CACHE_DIR", "JAXINK_CACHE_DIR"
    environment = {k: v for k, v in os.environ.items() if k not in chosen}
    environment["XDG_CACHE_HOME"] = str(tmp_path / "cache")
    expected = tmp_path / "cache" / "jaxink" / "compiled"
    if case == "named":
        expected = tmp_path / "mine"
        environment["JAX_COMPILATION_CACHE_DIR"] = str(expected)
    elif case == "unwritable":
        (tmp_path / "cache").write_text("a file where the folder should be")
    elif case == "open":
        expected.mkdir(parents=True)
        expected.chmod(0o777)
    done = subprocess.run(
        [sys.executable, "-c", CACHED],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    if case == "open":
        assert done.stderr.startswith(f"programs are not stored: {expected} can be written by other users")
        assert not list(expected.iterdir())
        return
    assert done.stderr == ""
    # JAX is given no folder of jaxink's, which it would read without checking.
    assert done.stdout == (f"{expected}\n" if case == "named" else "None\n")
    # The named folder keeps JAX's own rule of what is worth keeping.
    assert case != "user" or any(expected.iterdir())
