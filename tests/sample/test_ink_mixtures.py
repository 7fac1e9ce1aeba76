"""Layers that are mixed from inks: coefficients add up, files hold them, and mistakes are named."""

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.measurement import Readings
from jaxink.model.forward import evaluate
from jaxink.model.readings import ReadingsModel
from jaxink.numerics.precision import computing
from jaxink.projects import Measurement, Project, parse_project
from jaxink.sample import sample_from_dict, sample_text, sample_to_dict
from tests.samples import edited

WAVELENGTHS_NM = (450.0, 550.0, 650.0)
TEXT = """
schema_version = 1
wavelength_nm = [450, 550, 650]
[inks.cyan]
scattering_per_mm = { per_wavelength = true, value = [30, 20, 10] }
absorption_per_mm = { per_wavelength = true, value = [1, 4, 40] }
[inks.white]
scattering_per_mm = 200
absorption_per_mm = 0.1
[[layers]]
name = "print"
kind = "scattering"
phase_function = "henyey_greenstein"
asymmetry_parameter = 0.4
refractive_index = 1.5
thickness_um = 40
mixture = { cyan = 0.25, white = 0.5 }
"""
# The same by hand; a quarter of the volume is clear binder.
BY_HAND = edited(
    TEXT[: TEXT.index("[inks.cyan]")] + TEXT[TEXT.index("[[layers]]") :],
    (
        "mixture = { cyan = 0.25, white = 0.5 }",
        "scattering_per_mm = { per_wavelength = true, value = [107.5, 105, 102.5] }\n"
        "absorption_per_mm = { per_wavelength = true, value = [0.3, 1.05, 10.05] }",
    ),
)
OPAQUE = edited(TEXT, ("thickness_um = 40", 'thickness_um = "opaque"', "white = 0.5 }", "white = 0.75 }"))
OPAQUE_BY_HAND = edited(
    BY_HAND,
    (
        *("thickness_um = 40", 'thickness_um = "opaque"'),
        BY_HAND[BY_HAND.index("scattering_per_mm") :],
        "single_scattering_albedo = { per_wavelength = true, "
        f"value = [{157.5 / 157.825!r}, {155 / 156.075!r}, {152.5 / 162.575!r}] }}\n",
    ),
)
MIXTURE = "cyan = 0.25, white = 0.75"
FREE_ASYMMETRY = "{ free = true, value = 0.4, min = 0, max = 0.9 }"
FREE = "{ free = true, min = 1, max = 9 }"
LAW = '{ law = "power", at_reference = 200, reference_nm = 550, exponent = 1 }'


def reflectances(sample) -> np.ndarray:
    """45:0 at the three wavelengths."""
    return read(sample, np.full(3, 0.5))


def read(sample, values) -> np.ndarray:
    with computing():
        return np.asarray(evaluate(ReadingsModel(sample, readings(values))))


def readings(values, sigma=None) -> Readings:
    n = len(WAVELENGTHS_NM)
    angles = np.full(n, 45.0), np.zeros(n), np.full(n, 180.0)
    return Readings(np.array(["R_45_0"] * n), *angles, np.array(WAVELENGTHS_NM), values, sigma)


@pytest.mark.parametrize(("mixed", "by_hand"), [(TEXT, BY_HAND), (OPAQUE, OPAQUE_BY_HAND)])
def test_coefficients_add_up_in_proportion_to_the_shares(mixed, by_hand):
    one, other = reflectances(jaxink.parse_sample(mixed)), reflectances(jaxink.parse_sample(by_hand))
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_another_mixture_is_a_prediction():
    pure = jaxink.parse_sample(TEXT).replace({"print.mixture.cyan": 0.0, "print.mixture.white": 1.0})
    white = edited(
        TEXT[: TEXT.index("[inks.cyan]")] + TEXT[TEXT.index("[[layers]]") :],
        ("mixture = { cyan = 0.25, white = 0.5 }", "scattering_per_mm = 200\nabsorption_per_mm = 0.1"),
    )
    np.testing.assert_allclose(reflectances(pure), reflectances(jaxink.parse_sample(white)), rtol=1e-12)


@pytest.mark.parametrize(
    "text", [TEXT, OPAQUE, edited(TEXT, ("cyan = 0.25", "cyan = { free = true, min = 0, max = 1 }"))]
)
def test_files_hold_a_mixture(text):
    sample = jaxink.parse_sample(text)
    assert jaxink.parse_sample(sample_text(sample)) == sample
    assert sample_from_dict(sample_to_dict(sample)) == sample


def test_the_share_of_a_known_ink_is_found():
    true = jaxink.parse_sample(TEXT)
    free = jaxink.parse_sample(edited(TEXT, ("cyan = 0.25", "cyan = { free = true, min = 0, max = 0.5 }")))
    exact = reflectances(true)
    noisy = exact * (1 + 0.002 * np.random.default_rng(3).standard_normal(3))
    project = Project(
        (Measurement("print", readings(noisy, 0.002 * exact), free, {n: n for n in free.parameters}),)
    )
    result = jaxink.fit(project, options=jaxink.FitOptions(profile="none"))
    share = result["print.mixture.cyan"]
    assert abs(share.value - 0.25) < 3 * share.standard_error
    assert share.standard_error < 0.01


def test_inks_fitted_to_prints_predict_another_mixture():
    truth = jaxink.parse_sample(OPAQUE)
    fitted = edited(
        OPAQUE,
        (
            "per_wavelength = true, value = [30, 20, 10]",
            "per_wavelength = true, free = true, min = 1, max = 300",
            "per_wavelength = true, value = [1, 4, 40]",
            "per_wavelength = true, free = true, min = 0.1, max = 300",
            "absorption_per_mm = 0.1",
            "absorption_per_mm = { per_wavelength = true, free = true, min = 0.01, max = 1 }",
        ),
    )
    shares = [(1.0, 0.0), (0.0, 1.0), (0.3, 0.7), (0.1, 0.9)]
    measurements, rng = [], np.random.default_rng(4)
    for number, (cyan, white) in enumerate(shares):
        mixture = {"print.mixture.cyan": cyan, "print.mixture.white": white}
        exact = reflectances(truth.replace(mixture))
        data = readings(exact * (1 + 0.002 * rng.standard_normal(3)), 0.002 * exact)
        sample = jaxink.parse_sample(fitted).replace(mixture)
        name = f"p{number}"
        names = {n: f"{name}/{n}" if n.startswith("print.mixture.") else n for n in sample.parameters}
        measurements.append(Measurement(name, data, sample, names))
    result = jaxink.fit(Project(tuple(measurements)), options=jaxink.FitOptions(profile="none"))
    other = {"print.mixture.cyan": 0.6, "print.mixture.white": 0.4}
    predicted = reflectances(result.of("p0").sample.replace(other))
    np.testing.assert_allclose(predicted, reflectances(truth.replace(other)), rtol=0.01)


def test_the_prints_of_a_project_have_mixtures_of_their_own(tmp_path):
    (tmp_path / "ink.toml").write_text(
        edited(TEXT, ("scattering_per_mm = 200", "scattering_per_mm = { free = true, min = 1, max = 500 }"))
    )
    for name in ("a", "b"):
        rows = "".join(f"R_45_0,0.5,0.01,{nm:g},180\n" for nm in WAVELENGTHS_NM)
        (tmp_path / f"{name}.csv").write_text(f"quantity,value,sigma,wavelength_nm,phi_deg\n{rows}")
    project = parse_project(
        """
schema_version = 1
sample = "ink.toml"
[specimens.tint]
print.mixture = { cyan = 0.05, white = 0.95 }
[[measurements]]
name = "a"
readings = "a.csv"
[[measurements]]
name = "b"
readings = "b.csv"
specimen = "tint"
""",
        folder=tmp_path,
    )
    assert project.parameters["tint/print.mixture.cyan"].value == 0.05
    assert project.parameters["print.mixture.cyan"].value == 0.25
    assert project.measured_in("white.scattering_per_mm") == ("a", "b")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (("cyan = 0.25", "cian = 0.25"), ("cian", "cyan")),
        (("cyan = 0.25", "cyan = 25"), ("print.mixture.cyan", "25")),
        (("cyan = 0.25, white = 0.5", "cyan = 0.75, white = 0.5"), ("mixture", "1.25")),
        (("mixture = { cyan = 0.25, white = 0.5 }", "mixture = 0.5"), ("mixture", "shares")),
        (("thickness_um = 40", "thickness_um = 40\nscattering_per_mm = 5"), ("mixture", "scattering_per_mm")),
        (('"henyey_greenstein"\nasymmetry_parameter = 0.4', '"mie"'), ("Mie", "mixture")),
        (("[inks.white]", "[inks.print]", "white = 0.5", "print = 0.5"), ("inks.print", "layer")),
        (("scattering_per_mm = 200", "scattering = 200"), ("inks.white", "scattering_per_mm")),
        (("[inks.white]", "[inks.backing]"), ("inks.backing", "name")),
        (("scattering_per_mm = 200", f"scattering_per_mm = {LAW}"), ("white.scattering_per_mm",)),
    ],
)
def test_a_wrong_mixture_is_refused(changes, words, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.parse_sample(edited(TEXT, changes))
    told(str(refused.value), *words)


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ("cyan = 0.25", ("0.25", "missing")),
        ("cyan = { free = true, min = 0, max = 1 }, white = 0.4", ("0.9", "tie")),
    ],
)
def test_shares_of_an_opaque_layer_that_are_not_all_are_refused(shares, words, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.parse_sample(edited(OPAQUE, (MIXTURE, shares)))
    told(str(refused.value), "opaque", *words)


@pytest.mark.parametrize(
    ("text", "values"), [(TEXT, {"cyan": 0.75}), (OPAQUE, {"cyan": 0.5}), (OPAQUE, {"cyan": 0.2})]
)
def test_other_shares_that_are_no_mixture_are_refused(text, values, told):
    sample = jaxink.parse_sample(text)
    with pytest.raises(InputRefusedError) as refused:
        sample.replace({f"print.mixture.{ink}": share for ink, share in values.items()})
    told(str(refused.value), "layer 'print'", "mixture")


def test_the_share_of_an_opaque_layer_may_follow_from_another():
    shares = (
        'cyan = { free = true, value = 0.25, min = 0, max = 1 }, white = { tie = "1 - print.mixture.cyan" }'
    )
    tied = jaxink.parse_sample(edited(OPAQUE, (MIXTURE, shares)))
    np.testing.assert_allclose(reflectances(tied), reflectances(jaxink.parse_sample(OPAQUE)), rtol=1e-4)


def test_an_ink_that_no_layer_has_is_refused(told, tmp_path):
    unused = edited(
        TEXT, ("[[layers]]", "[inks.magenta]\nscattering_per_mm = 1\nabsorption_per_mm = 1\n[[layers]]")
    )
    with pytest.raises(InputRefusedError) as refused:
        jaxink.parse_sample(unused)
    told(str(refused.value), "[inks.magenta]", "mixture")
    unused = edited(unused, ("asymmetry_parameter = 0.4", f"asymmetry_parameter = {FREE_ASYMMETRY}"))
    (tmp_path / "ink.toml").write_text(unused)
    (tmp_path / "a.csv").write_text("quantity,value,sigma,wavelength_nm,phi_deg\nR_45_0,0.5,0.01,550,180\n")
    project = 'schema_version = 1\nsample = "ink.toml"\n[[measurements]]\nname = "a"\nreadings = "a.csv"\n'
    with pytest.raises(InputRefusedError, match="inks.magenta"):
        parse_project(project, folder=tmp_path)
    # One measurement has it: the others are not told of it.
    other = '[[measurements]]\nname = "b"\nreadings = "a.csv"\nchanges.print.mixture = { magenta = 1 }\n'
    free = edited(
        unused, ("[inks.magenta]\nscattering_per_mm = 1\n", f"[inks.magenta]\nscattering_per_mm = {FREE}\n")
    )
    (tmp_path / "ink.toml").write_text(free)
    assert parse_project(project + other, folder=tmp_path).measured_in("magenta.scattering_per_mm") == ("b",)


def test_a_mixture_without_inks_is_refused(told):
    start = TEXT.index("[inks.cyan]"), TEXT.index("[[layers]]")
    with pytest.raises(InputRefusedError) as refused:
        jaxink.parse_sample(TEXT[: start[0]] + TEXT[start[1] :])
    told(str(refused.value), "cyan", "no inks")
