"""The documents against the code: nothing in them may drift."""

import json
import re
import runpy
import shlex
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

import jaxink
from jaxink.effects import model_at
from jaxink.fitting.result import SCHEMA_VERSION as RESULT_VERSION
from jaxink.sample import measurement_schema, schema
from jaxink.sample.schema import Entry, Quantity

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = (ROOT / "docs" / "manual" / "commands.md").read_text(encoding="utf-8")
SAMPLE_FILE = (ROOT / "docs" / "manual" / "sample-file.md").read_text(encoding="utf-8")
PARTICLES = (ROOT / "docs" / "manual" / "particles.md").read_text(encoding="utf-8")
DIAGNOSIS = (ROOT / "docs" / "manual" / "diagnosis.md").read_text(encoding="utf-8")
RESULT = (ROOT / "docs" / "manual" / "result.md").read_text(encoding="utf-8")


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def rows(table):
    """Cells of the rows of a markdown table, without the head."""
    lines = [line for line in table.splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.fixture
def coarsely(monkeypatch, coarse):
    """Fits with a coarse discretisation: the documents shall run, accuracy is tested elsewhere."""
    monkeypatch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)


def test_notebook_example_runs(coarsely):
    (code,) = blocks(README, "python")
    assert len([line for line in code.splitlines() if line.strip()]) == 5
    names = {}
    *statements, last = code.strip().splitlines()
    exec("\n".join(statements), names)
    assert names["result"].converged
    assert eval(last, names)._repr_png_().startswith(b"\x89PNG")


def test_commands_are_single_lines_for_a_fresh_machine():
    demo, tests = blocks(README, "sh")
    for command, extra, then in ((demo, ".", "jaxink demo --out"), (tests, ".[test]", "python -m pytest")):
        assert command.count("\n") == 1
        venv, install, run = command.strip().split(" && ")
        assert shlex.split(venv) == ["python3", "-m", "venv", ".venv"]
        assert shlex.split(install) == [".venv/bin/pip", "install", extra]
        assert run.startswith(f".venv/bin/{then}")


@pytest.mark.parametrize(
    "path", sorted(p.relative_to(ROOT).as_posix() for p in [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
)
def test_links_lead_somewhere(path):
    text = (ROOT / path).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)", text):
        assert target.startswith("https://") or ((ROOT / path).parent / target).exists(), target


def test_every_page_is_listed():
    listed = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    for page in ROOT.glob("docs/*/*.md"):
        assert f"]({page.relative_to(ROOT / 'docs').as_posix()})" in listed, page


def test_exit_codes_are_those_of_the_command(told):
    from jaxink.cli import app, session

    for text in (COMMANDS, app.app.info.epilog):
        (stated,) = re.findall(r"Exit codes: (.*?)\.", text.replace("\n", " "))
        # 2 is the parser's own, of options that do not exist.
        codes = [*session.ExitCode, 2]
        assert sorted(map(int, re.findall(r"\d+", told(stated)))) == sorted(codes)


def test_complete_sample_file_is_accepted_and_complete():
    (text,) = blocks(SAMPLE_FILE, "toml")
    sample = jaxink.parse_sample(text)
    assert set(tomllib.loads(text)) == set(measurement_schema.TOP)
    assert {key for p in sample.parameters.values() for key in ("prior", "tie") if getattr(p, key)} == {
        "prior",
        "tie",
    }
    assert sample.parameters.values_with({})["coat.thickness_mm"] == 0.025


def test_complete_sample_file_can_be_predicted():
    (text,) = blocks(SAMPLE_FILE, "toml")
    columns = [30.0, 30.0], [0.0, 50.0], [0.0, 180.0], [450.0, 550.0], [False, True]
    model = model_at(jaxink.parse_sample(text), tuple(map(np.array, columns)), np.arange(2))
    assert model.wavelengths_nm == (450.0, 550.0)


def test_example_of_particles_has_all_of_them_and_optics():
    from jaxink.model.size_classes import mie_sizes
    from jaxink.model.volume import volume_scattering

    (text,) = blocks(PARTICLES, "toml")
    sample = jaxink.parse_sample(text)
    ink = sample.layers[1]
    assert {d.formula for d in sample.dispersions} == {"cauchy", "table"}
    for key in (*schema.SIZE_DISTRIBUTION, *schema.MIE_LAYER):
        assert any(name.startswith(f"ink.{key}") for name in sample.parameters), key
    values = sample.at_wavelength(sample.parameters.values_with({}), 550.0)
    optics = volume_scattering(ink, values, 550.0, mie_sizes(sample, (550.0,)))
    assert 1e3 < float(optics.scattering_per_mm) < 4e3
    assert float(optics.absorption_per_mm) == pytest.approx(0.1 * (1 - 0.18))


def test_tables_are_those_of_the_schema_and_the_catalogue():
    tables = runpy.run_path(str(ROOT / "docs" / "manual" / "tables.py"))
    for page in tables["PAGES"]:
        text = (ROOT / "docs" / "manual" / page).read_text(encoding="utf-8")
        assert tables["with_tables"](page, text) == text, (
            f"{page} is out of date; run python docs/manual/tables.py"
        )


def test_every_key_is_declared_with_its_meaning():
    declared = [
        entry
        for module in (schema, measurement_schema)
        for table in vars(module).values()
        if isinstance(table, dict)
        for inner in ([table] if not isinstance(next(iter(table.values()), None), dict) else table.values())
        for entry in inner.values()
        if isinstance(entry, Quantity | Entry)
    ]
    assert len(declared) > 80
    assert all(entry.meaning for entry in declared)


def test_versions_are_those_of_the_code():
    from jaxink.effects import CATALOGUE_VERSION

    assert f"`schema_version` is {measurement_schema.SCHEMA_VERSION}" in SAMPLE_FILE
    diagnosis = (ROOT / "docs" / "manual" / "diagnosis.md").read_text(encoding="utf-8")
    assert f"## Catalogue, version {CATALOGUE_VERSION}" in diagnosis


def test_every_effect_of_the_catalogue_is_published():
    from jaxink.effects import CATALOGUE, CATALOGUE_VERSION

    section = DIAGNOSIS[DIAGNOSIS.index(f"## Catalogue, version {CATALOGUE_VERSION}") :]
    published = rows(re.search(r"(?:\|.*\n)+", section).group())
    assert [(row[0].strip("`"), row[-1]) for row in published] == [(e.name, e.statement) for e in CATALOGUE]


def test_kinds_of_effects_are_those_of_the_library():
    from jaxink import effects

    kinds = rows(DIAGNOSIS[DIAGNOSIS.index("| kind, from `jaxink.effects`") :].split("\n\n")[0])
    for kind, _, method in kinds:
        name, _ = method.strip("`").split("(")
        assert name in getattr(effects, kind.strip("`")).__abstractmethods__


def test_an_effect_of_ones_own_is_found(coarsely, coarse, monkeypatch, tmp_path):
    from jaxink.data import SIMULATED_TRUTH, simulated_example
    from jaxink.effects.instrument import Nonlinearity, StrayLight
    from jaxink.numerics.precision import computing

    [code] = [block for block in blocks(DIAGNOSIS, "python") if "class " in block]
    # With a few effects of the catalogue: all of them are compiled elsewhere.
    monkeypatch.setattr("jaxink.effects.CATALOGUE", (StrayLight, Nonlinearity))
    monkeypatch.chdir(tmp_path)
    table, sample = simulated_example()
    shutil.copy(sample, "SAMPLE.toml")
    data = jaxink.read(table)
    with computing():
        model = jaxink.ForwardModel(jaxink.load_sample(sample), *data.directions, coarse)
        clean = np.asarray(model.bsdf(model.sample.parameters.values_with(SIMULATED_TRUTH)))
    true = clean * (1 - 0.3 * (data.theta_o_deg / 90) ** 4)
    noise = np.random.default_rng(8).standard_normal(true.size)
    columns = (*data.directions[:4], data.side, true * (1 + 0.005 * noise), 0.005 * true)
    head, *_ = table.read_text().splitlines()
    lines = (",".join(map(str, row)) for row in zip(*columns, strict=True))
    Path("DATA.csv").write_text("\n".join([head, *lines]))
    names = {}
    exec(code, names)
    verdict, steps = names["diagnosis"].verdict, names["diagnosis"].steps
    assert (verdict.code, verdict.effects) == ("instrument", ("vignetting",))
    assert abs(steps[0].strength - 0.3) < 3 * steps[0].standard_error


def test_every_choice_is_named():
    for choice in (
        *schema.PHASE_FUNCTIONS,
        *schema.ROUGHNESS_DENSITIES,
        *schema.DISPERSIONS,
        *schema.LAWS,
        *schema.FACES,
        *(f'"{side}"' for side in schema.BACKING_SIDES),
        *(f'"{mode}"' for mode in measurement_schema.DETECTOR_MODES),
        "clear",
        "scattering",
        "dispersion",
    ):
        assert f"`{choice}`" in SAMPLE_FILE, choice
    assert f'`"{schema.OPAQUE}"`' in SAMPLE_FILE


# Tables whose keys are names of parameters or packages, or that hold what the sample file says.
LEAVES = {
    "versions",
    "searches[].start",
    "searches[].values",
    "searches[].path.values",
    "minima.found[].values",
    "sample.parameters[].prior",
    "sample.parameters[].smoothness",
    "sample.layers[].roughness",
}


def paths(value, path=""):
    """Every key of a result, dotted."""
    if isinstance(value, dict) and path not in LEAVES:
        return {p for key, inner in value.items() for p in paths(inner, f"{path}.{key}".lstrip("."))}
    if isinstance(value, list) and value and isinstance(value[0], dict) and path not in LEAVES:
        return {p for inner in value for p in paths(inner, f"{path}[]")}
    return {path}


def test_every_key_of_a_result_is_documented(example_result):
    documented = [row[0].strip("`") for row in rows(RESULT[RESULT.index("## Every key") :])]
    assert len(documented) == len(set(documented))
    assert set(documented) == paths(example_result.to_dict())
    assert f"`schema_version` is {RESULT_VERSION}" in RESULT


def test_example_result_has_every_key(example_result):
    (text,) = blocks(RESULT, "json")
    assert paths(json.loads(text)) == paths(example_result.to_dict())


def test_variables_of_the_netcdf_file_are_documented(example_result):
    dataset = example_result.to_dataset()
    for name in (*dataset.coords, *dataset.data_vars):
        assert f"`{name}`" in RESULT, name


def test_embedded_measurement_says_that_it_is_simulated():
    from jaxink.data import SIMULATED_TRUTH, simulated_example

    data, sample = simulated_example()
    assert data.name.startswith("simulated")
    assert "simulated" in jaxink.load_sample(sample).title.lower()
    note = (data.parent / "README.md").read_text(encoding="utf-8")
    for value, unit in zip(SIMULATED_TRUTH.values(), ("/mm", "/mm", ""), strict=True):
        assert f"{value:g} {unit}".strip() in note
