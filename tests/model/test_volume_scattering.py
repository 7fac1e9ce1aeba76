"""From a sample file to the optics of its layers, to the prediction, and back by a fit."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink import ForwardModel, SolverConfig, parse_sample
from jaxink.fitting import FitOptions
from jaxink.model.size_classes import MieSizes, mie_sizes
from jaxink.model.volume import volume_scattering
from jaxink.particles import PHASE_FUNCTIONS
from jaxink.particles.mie import MieSphere, mie_coefficients
from jaxink.particles.structure_factor import InterferingPhaseFunction
from jaxink.sample import schema

PLATE = """\
schema_version = 1
[[layers]]
name = "plate"
kind = "clear"
refractive_index = {index}
thickness_mm = 3
"""
INK = """\
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 20
radius_nm = 125
volume_fraction = 0.1
particle_index = 2.7
"""
FILLER = """\
[[layers.populations]]
name = "filler"
radius_nm = 500
volume_fraction = 0.2
particle_index = 1.64
"""
COARSE = SolverConfig(nodes_escaping=6, nodes_trapped=4, n_moments=12, n_orders=3)
WAVELENGTH = 550.0


def ink(extra="", replace=("", "")):
    return parse_sample("schema_version = 1\n" + INK.replace(*replace) + extra)


def scattering_of(sample, **changes):
    values = {**sample.parameters.values_with(changes)}
    return volume_scattering(sample.layers[0], values, WAVELENGTH, mie_sizes(sample, (WAVELENGTH,)))


def test_a_file_without_the_new_keys_keeps_the_model_of_one_sphere():
    sample = ink()
    assert mie_sizes(sample, (WAVELENGTH,)) == MieSizes(40.0, ())
    found = scattering_of(sample)
    expected = mie_coefficients(125.0, 2.7 + 0j, 0.1, 1.5, WAVELENGTH)
    assert isinstance(found.phase_function, MieSphere)
    assert found.phase_function.electric_coefficients.shape == (58,)
    assert float(found.scattering_per_mm) == float(expected.scattering_coefficient_per_mm)


def test_keys_that_change_nothing_give_the_same_numbers():
    reference = scattering_of(ink())
    nothing = ink("radius_variance_ln = 0\nstructure_factor_weight = 0\n" + FILLER.replace("0.2", "0"))
    found = scattering_of(nothing)
    assert isinstance(found.phase_function, InterferingPhaseFunction)
    assert float(found.scattering_per_mm) == pytest.approx(float(reference.scattering_per_mm), rel=1e-12)
    np.testing.assert_allclose(
        found.phase_function.moments(32), reference.phase_function.moments(32), atol=1e-12
    )


def test_populations_tables_and_crowding_reach_the_optics():
    sample = ink("structure_factor_weight = 1\n" + FILLER)
    crowded = scattering_of(sample)
    alone = scattering_of(sample, **{"ink.structure_factor_weight": 0.0})
    parts = [
        mie_coefficients(r, n + 0j, f, 1.5, WAVELENGTH) for r, n, f in ((125, 2.7, 0.1), (500, 1.64, 0.2))
    ]
    total = sum(float(p.scattering_coefficient_per_mm) for p in parts)
    assert float(alone.scattering_per_mm) == pytest.approx(total, rel=1e-12)
    # Both kinds at a volume fraction of 0.3 together: the pigment alone keeps 0.42.
    assert 0.40 < float(crowded.scattering_per_mm) / total < 0.45
    table = ink(replace=("radius_nm = 125", "radii_nm = [125]\nnumber_weights = [7]"))
    assert float(scattering_of(table).scattering_per_mm) == pytest.approx(
        float(parts[0].scattering_coefficient_per_mm), rel=1e-12
    )


def test_binder_absorbs_in_what_the_particles_leave_of_it():
    absorbing = ink("binder_absorption_per_mm = 3\n" + FILLER)
    assert float(scattering_of(absorbing).absorption_per_mm) == pytest.approx(0.7 * 3, rel=1e-12)
    alone = ink("binder_absorption_per_mm = 3\nparticle_absorption_index = 0.01")
    particles = mie_coefficients(125.0, 2.7 + 0.01j, 0.1, 1.5, WAVELENGTH).absorption_coefficient_per_mm
    assert float(scattering_of(alone).absorption_per_mm) == pytest.approx(float(particles) + 0.9 * 3)


def test_the_series_serves_what_a_fit_may_ask_for(refused):
    free = ink(replace=("radius_nm = 125", "radius_nm = { value = 125, free = true, min = 50, max = 4000 }"))
    assert mie_sizes(free, (450.0, 650.0)).max_size_parameter == 160
    wide = ink("radius_variance_ln = { value = 0, free = true, min = 0, max = 0.16 }")
    assert mie_sizes(wide, (WAVELENGTH,)) == MieSizes(40.0, (("ink", 139),))
    huge = ink(replace=("radius_nm = 125", "radius_nm = 90000"))
    with refused("ink", 1542, 320, "18674 nm"):
        mie_sizes(huge, (WAVELENGTH,))


def points(wavelengths):
    angles = np.concatenate([np.arange(5.0, 80.0, 12.5)] * 2)
    side = np.arange(len(angles)) >= len(angles) / 2
    n = len(angles)
    grid = [np.tile(column, len(wavelengths)) for column in (np.full(n, 20.0), angles, np.full(n, 90.0))]
    return (*grid, np.repeat(wavelengths, n), np.tile(side, len(wavelengths)))


DISPERSED = (
    '{ dispersion = "cauchy", a = 1.47766, b_um2 = { value = 0.004479, free = true, min = 0, max = 0.01 } }'
)


def test_plate_that_dispersion_lifts_above_the_ink_at_one_wavelength():
    # Fixed coefficients, 1.4998 and 1.4883 about an ink of 1.49: whichever is denser, both end a block.
    index = DISPERSED.replace("{ value = 0.004479, free = true, min = 0, max = 0.01 }", "0.004479")
    sample = parse_sample(PLATE.format(index=index) + INK.replace("1.5", "1.49"))
    model = ForwardModel(sample, *points([450.0, 650.0]), config=COARSE)
    assert set(model.plan.block_media) == {0, 1, 2}
    # At one wavelength it is a number like any other: above the ink's, where nothing is ever scattered to.
    assert set(ForwardModel(sample, *points([450.0]), config=COARSE).plan.block_media) == {0, 2}


def test_wavelengths_outside_a_table_are_refused_by_the_model(refused):
    table = '{ dispersion = "table", wavelength_nm = [500, 700], value = [1.495, 1.488] }'
    sample = parse_sample(PLATE.format(index=table) + INK)
    with refused("500", "700", "450"):
        ForwardModel(sample, *points([450.0]), config=COARSE)


def test_rows_at_a_wavelength_without_an_index_are_refused_with_a_sentence(refused):
    index = "{ per_wavelength = true, value = [1.5] }"
    sample = parse_sample("wavelength_nm = [550]\n" + PLATE.format(index=index) + INK)
    with refused("450"):
        ForwardModel(sample, *points([450.0]), config=COARSE)


def test_fit_finds_variance_filler_and_dispersion_of_a_simulated_ink(tmp_path):
    text = (
        INK.replace("thickness_um = 20", "thickness_um = 3").replace("_index = 1.5", "_index = {index}", 1)
        + "radius_variance_ln = {variance}\n"
        + FILLER.replace("0.2", "{fraction}").replace("1.64", "1.9").replace("500", "300")
        + "[noise]\nrelative = 0.002\n"
    )
    truth = {
        "ink.refractive_index.b_um2": 0.006,
        "ink.radius_variance_ln": 0.04,
        "ink.filler.volume_fraction": 0.15,
    }
    start = (
        '{ dispersion = "cauchy", a = 1.48, b_um2 = { value = 0.01, free = true, min = 0, max = 0.02 } }',
        # No variance at all, which is another minimum: the range is scanned.
        "{ value = 0, free = true, min = 0, max = 0.1 }",
        "{ value = 0.3, free = true, min = 0, max = 0.4 }",
    )
    # Simulated with one number for each wavelength, fitted with a formula.
    numbers = [1.48 + 0.006 / w**2 for w in (0.45, 0.55)]
    true = (f"{{ per_wavelength = true, value = {numbers} }}", 0.04, 0.15)
    keys = ("index", "variance", "fraction")
    simulated, unknown = (
        parse_sample(
            "schema_version = 1\nwavelength_nm = [450, 550]\n"
            + text.format(**dict(zip(keys, values, strict=True)))
        )
        for values in (true, start)
    )
    columns = points([450.0, 550.0])
    bsdf = jaxink.model.forward.evaluate(ForwardModel(simulated, *columns, config=COARSE))
    result = jaxink.fit(jaxink.GonioData(*columns, bsdf), unknown, FitOptions(config=COARSE, profile="none"))
    assert result.converged
    # There is no noise: the formula meets the numbers far within the declared 2e-3.
    assert result.predicted_per_sr == pytest.approx(bsdf, rel=1e-4)
    for name, value in truth.items():
        error = result[name].standard_error
        # The search ends well within what noise would allow.
        assert abs(result[name].value - value) < 0.1 * error, name
        assert error < 0.5 * value, name
    assert jaxink.load_result(result.save(tmp_path)).sample == result.sample


@pytest.mark.parametrize(
    ("phase", "named"),
    [
        ("moments = [1, -0.1, -0.4]", "ink"),
        ("moments = [2, 0.5]", "ink"),
        (
            "angle_deg = [0, 60, 120, 180]\nphase_value = [4, 3, 3, 3]",
            "ink",
        ),
        (
            "angle_deg = [0, 60, 120, 180]\nphase_value = [1, 1, -1, 1]",
            "ink",
        ),
    ],
    ids=["negative", "first moment", "mean", "negative value"],
)
def test_a_tabulated_phase_function_that_is_none_is_refused_before_anything_is_compiled(
    phase, named, refused
):
    text = INK.replace('"mie"', f'"tabulated"\n{phase}').split("radius_nm")[0]
    sample = parse_sample(f"schema_version = 1\n{text}scattering_per_mm = 50\nabsorption_per_mm = 0.1\n")
    with refused(named):
        ForwardModel(sample, [0.0], [10.0], [180.0], [WAVELENGTH], [False], COARSE)


def test_numbers_of_a_sample_file_are_the_fields_of_its_phase_function():
    of_numbers = {
        name: numbers for name, numbers in schema.PHASE_FUNCTIONS.items() if name in PHASE_FUNCTIONS
    }
    assert set(schema.PHASE_FUNCTIONS) - set(of_numbers) == {"mie", "tabulated"}
    assert set(PHASE_FUNCTIONS) == set(of_numbers)
    for name, numbers in of_numbers.items():
        assert [field.name for field in dataclasses.fields(PHASE_FUNCTIONS[name])] == list(numbers)
    assert set(schema.PHASE_WORDS) == set(schema.PHASE_FUNCTIONS)
