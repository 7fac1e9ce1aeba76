"""A first sample file is accepted as it is, says what it assumes, and a fit can start from it."""

import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.sample.draft import DRAFTED_PHASE_FUNCTIONS, ORDERS, Draft, draft_text, reduced_thickness

DATA = str(simulated_example()[0])


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments, answers=None: CliRunner().invoke(app, [*map(str, arguments)], input=answers)


def measurement(wavelengths=(550,), sides="RT", sigma=None, **changes):
    """Four directions at each wavelength and side."""
    theta = np.array([0.0, 20, 40, 60])
    grid = [(t, w, s == "T") for w in wavelengths for s in sides for t in theta]
    theta_o, wavelength, is_transmission = map(np.array, zip(*grid, strict=True))
    fixed = {"theta_i_deg": np.zeros(len(grid)), "theta_o_deg": theta_o, "phi_deg": np.zeros(len(grid))}
    values = {"bsdf_per_sr": 0.1 + 0.001 * theta_o, "sigma_per_sr": sigma, "source": "ink.csv"}
    fields = fixed | values | {"wavelength_nm": wavelength, "is_transmission": is_transmission} | changes
    return jaxink.GonioData(**fields)


def test_the_file_and_the_next_command(run, tmp_path, told):
    done = run("init", DATA, "--out", "first.toml", "--plate-mm", 1, "--ink-um", 80)
    assert (done.exit_code, done.stderr) == (0, "")
    told(done.stdout, "--plate-index", "first.toml")
    text = (tmp_path / "first.toml").read_text()
    told(text)
    sample = jaxink.load_sample(tmp_path / "first.toml")
    assert [p.name for p in sample.parameters.free] == list(SIMULATED_TRUTH)
    assert (sample.parameters["plate.thickness_mm"].value, sample.wavelengths_nm) == (1, (550,))
    assert [line for line in text.splitlines() if "ASSUMED" in line and "thickness" in line] == []
    last = done.stdout.splitlines()[-1]
    assert shlex.split(last) == ["Next:", "jaxink", "fit", DATA, "--sample", "first.toml", "--out", "result"]


def test_a_fit_starts_from_it(coarse):
    data = jaxink.read(DATA)
    draft = Draft(plate_index=1.5, plate_mm=1.0, ink_um=80.0)
    sample = jaxink.parse_sample(draft_text(data, draft))
    result = jaxink.fit(data, sample, jaxink.FitOptions(config=coarse, profile="none"))
    assert result.converged
    found = {p.name: p.value for p in result.parameters.free}
    # The discretisation is coarse, and scattering and asymmetry act as a product.
    reduced, truth = (
        v["ink.scattering_per_mm"] * (1 - v["ink.asymmetry_parameter"]) for v in (found, SIMULATED_TRUTH)
    )
    assert reduced == pytest.approx(truth, rel=0.1)
    assert found["ink.absorption_per_mm"] == pytest.approx(SIMULATED_TRUTH["ink.absorption_per_mm"], rel=0.1)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("phase_function", DRAFTED_PHASE_FUNCTIONS)
@pytest.mark.parametrize("wavelengths", [(550,), (450, 550), tuple(range(400, 701, 10))])
def test_every_kind_of_sample_is_accepted(order, phase_function, wavelengths):
    draft = Draft(order=order, phase_function=phase_function)
    data = measurement(wavelengths)
    sample = jaxink.parse_sample(draft_text(data, draft, draft.needed))
    assert [layer.name for layer in sample.layers] == order.split(",")
    assert sample.wavelengths_nm == wavelengths
    sample.parameters.require_ranges()
    assert sample.parameters.free


@pytest.mark.parametrize("ink_um", [0.5, 5, 20, 300, 5000])
def test_starts_are_within_their_ranges(ink_um):
    sample = jaxink.parse_sample(draft_text(measurement(), Draft(ink_um=ink_um)))
    scattering = sample.parameters["ink.scattering_per_mm"]
    assert scattering.minimum < scattering.value < scattering.maximum


def test_an_opaque_ink(refused):
    sample = jaxink.parse_sample(draft_text(measurement(sides="R"), Draft(ink_um="opaque")))
    assert sample.layers[-1].opaque
    with refused("ink.csv", "ink_um"):
        draft_text(measurement(), Draft(ink_um="opaque"))
    with refused("ink_um", "ink,plate"):
        Draft(ink_um="opaque", order="ink,plate")


def test_noise_is_that_of_the_file_of_pairs_or_a_guess():
    from jaxink.measurement import noise_of

    def noise(data):
        return jaxink.parse_sample(draft_text(data, Draft())).noise

    assert (
        noise(measurement(sigma=np.full(8, 0.001)))
        == jaxink.parse_sample(draft_text(measurement(sigma=np.full(8, 0.002)), Draft())).noise
    )
    guessed = noise(measurement())
    assert guessed.relative > 0
    assert guessed.floor_per_sr > 0
    assert noise_of(measurement(), guessed).known
    twice = [np.tile(column, 2) for column in measurement().directions]
    bsdf = np.tile(measurement().bsdf_per_sr, 2) * (1 + 0.01 * np.random.default_rng(1).normal(size=16))
    pairs = jaxink.GonioData(*twice, bsdf)
    # Eight pairs are too few.
    assert noise(pairs).relative == guessed.relative
    many = jaxink.GonioData(
        *(np.tile(column, 2) for column in pairs.directions), np.append(bsdf, bsdf * 1.001)
    )
    assert noise(many).relative is None
    assert noise_of(many, noise(many)).known


@pytest.mark.parametrize("total", [0.2, 0.5, 0.8])
def test_the_estimate_inverts_two_stream_theory(total):
    """R = 3/4 t / (1 + 3/4 t), T = 1 - R, of an ink that spreads all light evenly."""
    bsdf = np.full(4, total / np.pi)
    thickness = reduced_thickness(measurement(sides="R", bsdf_per_sr=bsdf), 550)
    assert 0.75 * thickness / (1 + 0.75 * thickness) == pytest.approx(total)
    thickness = reduced_thickness(measurement(sides="T", bsdf_per_sr=bsdf), 550)
    assert 1 / (1 + 0.75 * thickness) == pytest.approx(total)


@pytest.mark.parametrize("bsdf", [1e-90, 1e8, -1.0])
def test_absurd_values_still_give_a_file(bsdf):
    data = measurement(bsdf_per_sr=np.append(np.full(7, bsdf), 1.0))
    assert jaxink.parse_sample(draft_text(data, Draft())).parameters.free


def test_the_name_of_the_file_does_no_harm():
    data = measurement(source='a"b\\\n[x]\x07\x7f # ü.csv')
    assert "ü.csv" in jaxink.parse_sample(draft_text(data, Draft())).title


def test_lit_side_gives_the_order(run, tmp_path):
    lines = (simulated_example()[0]).read_text().splitlines()[:40]
    rows = [f"{lines[0]},lit_side", *(f"{line},ink" for line in lines[1:])]
    (tmp_path / "lit.csv").write_text("\n".join(rows))
    assert run("init", "lit.csv").exit_code == 0
    assert [layer.name for layer in jaxink.load_sample(tmp_path / "sample.toml").layers] == ["ink", "plate"]


def test_questions(run, tmp_path, monkeypatch, told):
    monkeypatch.setattr("jaxink.cli.init._is_terminal", lambda: True)
    answers = "paint\nPlate, Ink\n-1\n\nthick\n1.5\n\n80\nspheres\nmie\n\n200\n"
    done = run("init", DATA, "--out", "asked.toml", answers=answers)
    assert done.exit_code == 0
    told(done.stdout, numbers=False)
    text = (tmp_path / "asked.toml").read_text()
    assert "(--" not in text
    parameters = jaxink.load_sample(tmp_path / "asked.toml").parameters
    assert parameters["plate.refractive_index"].value == Draft().plate_index
    assert parameters["plate.thickness_mm"].value == 1.5
    assert parameters["ink.radius_nm"].value == 200


def test_what_is_stated_is_not_asked(run, tmp_path, monkeypatch):
    monkeypatch.setattr("jaxink.cli.init._is_terminal", lambda: True)
    done = run("init", DATA, "--order", "ink", "--phase-function", "rayleigh", answers="1.4\n30\n")
    assert done.exit_code == 0
    assert jaxink.load_sample(tmp_path / "sample.toml").parameters["ink.thickness_um"].value == 30


def test_reading_options_belong_to_the_next_command(run, tmp_path):
    lines = simulated_example()[0].read_text().splitlines()
    rows = [line.split(",") for line in lines if ",T," not in line]
    for name in ("R", "T"):
        (tmp_path / f"{name} 1.csv").write_text("\n".join(",".join(row[:4] + row[5:]) for row in rows))
    done = run("init", "R 1.csv", "T 1.csv", "--side", "R,T")
    assert done.exit_code == 0
    words = shlex.split(done.stdout.splitlines()[-1])
    assert words[2:5] == ["fit", "R 1.csv", "T 1.csv"]
    assert words[words.index("--side") + 1] == "R,T"


@pytest.fixture
def spectral(tmp_path):
    """A measurement at 31 wavelengths."""
    rows = ["theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr"]
    rows += [f"0,{o},0,{nm},R,{0.2 + o / 1000}" for nm in range(400, 701, 10) for o in (0, 20, 40, 60)]
    (tmp_path / "spectral.csv").write_text("\n".join(rows))
    return "spectral.csv"


def test_every_wavelength_is_kept_and_said(run, spectral, tmp_path, told):
    done = run("init", spectral)
    assert done.exit_code == 0
    assert jaxink.load_sample(tmp_path / "sample.toml").wavelengths_nm == tuple(range(400, 701, 10))
    told(done.stdout, "31 wavelengths", "--wavelengths 400,550,700")


@pytest.mark.parametrize("given", ["450,550,650", "650; 450 nm ;0.55 um"])
def test_wavelengths_are_chosen(given, run, spectral, tmp_path, told):
    done = run("init", spectral, "--wavelengths", given, "--asymmetry", "each")
    assert done.exit_code == 0
    sample = jaxink.load_sample(tmp_path / "sample.toml")
    assert sample.wavelengths_nm == (450, 550, 650)
    names = [p.name for p in sample.parameters.free if "asymmetry" in p.name]
    assert len(names) == 3
    told(done.stdout, "450, 550, 650")


def test_one_asymmetry_or_one_for_each(run, spectral, tmp_path, monkeypatch, told):
    monkeypatch.setattr("jaxink.cli.init._is_terminal", lambda: True)
    stated = (
        "--order",
        "ink",
        "--ink-index",
        "1,5",
        "--ink-um",
        "0.05 mm",
        "--phase-function",
        "henyey_greenstein",
    )
    for answer, n in (("each", 2), ("", 1)):
        done = run(
            "init", spectral, "--wavelengths", "450,650", *stated, "--force", answers=f"maybe\n{answer}\n"
        )
        assert done.exit_code == 0
        assert "all 2 wavelengths" in done.stdout
        parameters = jaxink.load_sample(tmp_path / "sample.toml").parameters
        assert len([p for p in parameters.free if "asymmetry" in p.name]) == n
        assert parameters["ink.thickness_um"].value == 50
    # At one wavelength there is nothing to ask.
    done = run("init", spectral, "--wavelengths", "450", *stated, "--force", answers="")
    assert (done.exit_code, done.stderr) == (0, "")


@pytest.mark.parametrize("ends", ["end of input", "interrupt"])
def test_ended_questions_keep_the_answers(ends, run, tmp_path, monkeypatch, told):
    monkeypatch.setattr("jaxink.cli.init._is_terminal", lambda: True)
    if ends == "interrupt":
        import typer

        prompt, asked = typer.prompt, []

        def interrupted(text, **options):
            asked.append(text)
            if len(asked) == 4:
                raise typer.Abort
            return prompt(text, **options)

        monkeypatch.setattr("typer.prompt", interrupted)
    given = ("init", DATA, "--wavelength-nm", "550", "--out", "my sample.toml")
    done = run(*given, answers="ink,plate\n1,51\n0.2 cm\n")
    assert done.exit_code == 130
    assert not (tmp_path / "my sample.toml").exists()
    told(done.stderr, "--plate-mm 2", numbers=False)
    words = shlex.split(done.stderr.splitlines()[-1])
    # The command asks only what is left.
    done = run(*words[1:], answers="\n\n\n")
    assert done.exit_code == 0
    sample = jaxink.load_sample(tmp_path / "my sample.toml")
    assert [layer.name for layer in sample.layers] == ["ink", "plate"]
    assert sample.parameters["plate.refractive_index"].value == 1.51
    assert sample.parameters["plate.thickness_mm"].value == 2


def test_two_thicknesses_are_not_one_sample(run, tmp_path, told):
    lines = simulated_example()[0].read_text().splitlines()
    names = lines[0].split(",")
    at = names.index("bsdf_per_sr")
    for name, factor in (("thin.csv", 1.0), ("thick.csv", 1.2), ("again.csv", 1.01)):
        rows = [line.split(",") for line in lines[1:]]
        rows = [[*row[:at], repr(float(row[at]) * factor), *row[at + 1 :]] for row in rows]
        (tmp_path / name).write_text("\n".join([lines[0], *(",".join(row) for row in rows)]))
    assert run("init", "thin.csv", "again.csv").exit_code == 0
    done = run("init", "thin.csv", "thick.csv", "--out", "both.toml")
    assert (done.exit_code, (tmp_path / "both.toml").exists()) == (5, False)
    told(done.stderr, "thin.csv", "thick.csv", "1.2 times")


REFUSED = [
    (("--ink-um", "1,500"), "ink_um"),
    (("--plate-index", "1.5 mm"), "plate_index"),
    (("--wavelengths", "450,550"), "550"),
    (("--asymmetry", "two"), "asymmetry"),
    (("--order", "ink,coat"), "order"),
    (("--phase-function", "tabulated"), "phase_function"),
    (("--plate-index", "0.5"), "plate.refractive_index"),
    (("--plate-mm", "nan"), "plate.thickness_mm"),
    (("--ink-um", "thin"), "ink_um"),
    (("--ink-um", "opaque"), "side T"),
    (("--out", "none/sample.toml"), "none/sample.toml"),
    (("--out", "."), "."),
    (("--out", "there.toml"), "--force"),
    (("--wavelength-nm", "650"), "row 2"),
]


@pytest.mark.parametrize(("options", "named"), REFUSED, ids=[" ".join(r[0]) for r in REFUSED])
def test_a_refusal_writes_nothing(options, named, run, tmp_path, told):
    (tmp_path / "there.toml").write_text("mine")
    done = run("init", DATA, *options)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", named)
    assert [p.name for p in tmp_path.iterdir()] == ["there.toml"]
    assert (tmp_path / "there.toml").read_text() == "mine"


def test_force_replaces(run, tmp_path):
    (tmp_path / "sample.toml").write_text("mine")
    assert run("init", DATA, "--force", "--quiet").exit_code == 0
    jaxink.load_sample(tmp_path / "sample.toml")


def test_wavelengths_are_separated_by_commas_or_spaces(run, tmp_path, monkeypatch, told):
    data = measurement((450, 550, 650))
    monkeypatch.setattr("jaxink.read", lambda *_, **__: data)
    for text in ("450,650", "450 650", "450 nm, 650 nm", "450 nm 650 nm", "450;650"):
        done = run("init", "ink.csv", "--wavelengths", text, "--out", "sample.toml", "--force")
        assert (done.exit_code, done.stderr) == (0, "")
        assert jaxink.load_sample(tmp_path / "sample.toml").wavelengths_nm == (450, 650)
    for text in ("400-700", "450 to 650", "blue"):
        done = run("init", "ink.csv", "--wavelengths", text, "--out", "other.toml")
        assert done.exit_code == 5
        told(done.stderr, "--wavelengths", "450,550,650")


@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_wavelengths_of_other_commands_are_those_of_the_sample_file(run, command, told):
    words = [DATA, "--sample", simulated_example()[1], "--out", "out", "--wavelengths", 550]
    done = run(command, *words)
    assert done.exit_code == 5
    told(done.stderr, "wavelength_nm of the sample file", "jaxink init --wavelengths")
    assert "--wavelengths" not in run(command, "--help").stdout


def test_the_shape_of_the_colour_is_that_of_the_diffuse_reflectance():
    waves = (500, 600)
    data = measurement(waves)
    data = data.replace(bsdf_per_sr=data.bsdf_per_sr * np.where(data.wavelength_nm == 600, 2.0, 1.0))
    as_hg = jaxink.parse_sample(draft_text(data, Draft(colour_from_reflectance=True)))
    np.testing.assert_allclose(as_hg.parameters["ink.scattering_per_mm"].shape, (2 / 3, 4 / 3), rtol=1e-4)
    assert [p.name for p in as_hg.parameters.free] == [
        "ink.scattering_per_mm",
        "ink.absorption_per_mm",
        "ink.asymmetry_parameter",
    ]
    mie = Draft(colour_from_reflectance=True, phase_function="mie")
    shape = jaxink.parse_sample(draft_text(data, mie)).parameters["ink.particle_absorption_index"].shape
    # The wavelength that is reflected less is absorbed more.
    assert shape[0] > shape[1]


def test_colours_that_have_no_shape(run, told):
    done = run("init", DATA, "--colour-from-reflectance")
    assert done.exit_code == 5
    told(done.stderr, "one wavelength")
    done = run("init", DATA, "--colour-from-reflectance", "--project")
    assert done.exit_code == 5
    told(done.stderr, "--project")
    with pytest.raises(jaxink.errors.InputRefusedError, match="opaque"):
        draft_text(measurement((500, 600), "R"), Draft(ink_um="opaque", colour_from_reflectance=True))
    with pytest.raises(jaxink.errors.InputRefusedError, match="reflection"):
        draft_text(measurement((500, 600), "T"), Draft(colour_from_reflectance=True))
