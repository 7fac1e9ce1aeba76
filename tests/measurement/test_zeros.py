"""A BSDF of exactly 0 among values that are clearly not 0 is no reading; one that the values lead to is."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.data import simulated_example
from jaxink.measurement import mask_counts, mask_sentences, noise_of
from jaxink.measurement.masks import MASK_FLAGS, RETRO

(ZERO,) = (flag for flag in MASK_FLAGS if flag.name == "zero")
HEADER = "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr"
ANGLES = np.arange(80.0, -85.0, -5.0)


def scan(values, theta_i_deg=20.0, side="R", signed_deg=ANGLES):
    """Rows of an in-plane scan; positive angles are on the side of the source."""
    return [
        f"{theta_i_deg:g},{abs(angle):g},{0 if angle > 0 else 180},550,{side},{value:.6g}"
        for angle, value in zip(signed_deg, values, strict=True)
    ]


@pytest.fixture
def read(tmp_path):
    def read(rows, name="gonio.csv", **overrides):
        path = tmp_path / name
        path.write_text("\n".join([HEADER, *rows]))
        return jaxink.read(path, **overrides)

    return read


def matt(level=0.2):
    return level * (1 - 0.1 * np.sin(np.deg2rad(ANGLES)) ** 2)


def test_the_shadow_of_the_detector_is_masked_and_said(read, told):
    shadow = np.abs(ANGLES - 20) < 8
    data = read(scan(np.where(shadow, 0, matt())))
    np.testing.assert_array_equal(data.mask == ZERO.bit, shadow)
    (note,) = data.notes
    told(note, "3 of 33", "R", "source")
    # The masks of a fit keep it, and say why.
    assert mask_counts(data.with_masks().mask)["zero"] == 3
    told(mask_sentences(data.mask)[0], "zero")


@pytest.mark.parametrize(
    "missing",
    {
        "penumbra": np.where(np.abs(ANGLES - 20) == 5, 0.06, 1.0) * (ANGLES != 20),
        "single": 1.0 * (ANGLES != -40),
        "towards grazing": 1.0 * (np.abs(ANGLES) < 70),
        "below the peak": np.where(np.abs(ANGLES + 20) < 12, 40.0, 1.0) * (np.abs(ANGLES - 30) > 6),
    }.items(),
    ids=lambda item: item[0],
)
@pytest.mark.parametrize("side", ["R", "T"])
def test_gaps_of_any_kind_are_masked(missing, side, read):
    factor = missing[1]
    for values in (factor * matt(), factor * np.full(ANGLES.size, 0.1)):
        data = read(scan(values, side=side))
        np.testing.assert_array_equal(data.mask & ZERO.bit > 0, factor == 0)


def test_a_scan_of_zeros_among_others_is_masked(read):
    data = read([*scan(matt()), *scan(matt(), 30), *scan(0 * ANGLES, 40)])
    np.testing.assert_array_equal(data.mask & ZERO.bit > 0, data.theta_i_deg == 40)


def test_a_gap_out_of_plane_is_found_in_any_order(read):
    rng = np.random.default_rng(1)
    theta, phi = (a.ravel() for a in np.meshgrid(np.arange(5.0, 80, 5), np.arange(-180.0, 180, 10)))
    gap = (np.abs(theta - 40) < 11) & (np.abs(phi - 60) < 25)
    rows = [
        f"0,{t:g},{p:g},550,R,{0 if g else 0.2 * (1 + 0.02 * rng.normal()):.5g}"
        for t, p, g in zip(theta, phi, gap, strict=True)
    ]
    order = rng.permutation(len(rows))
    data = read([rows[i] for i in order])
    np.testing.assert_array_equal(data.mask & ZERO.bit > 0, gap[order])


READINGS = {
    "rounded": np.round(0.004 * np.cos(np.deg2rad(ANGLES)) ** 3, 3),
    "falls to 0": np.maximum(0, 0.3 - 0.005 * np.abs(ANGLES)),
    "lobe in the dark": np.where(np.abs(ANGLES) < 22, 1.0, 0.0),
    "noise around 0": np.random.default_rng(3).normal(0, 0.002, ANGLES.size).round(3),
    "clipped noise": np.maximum(0, np.random.default_rng(4).normal(0.001, 0.002, ANGLES.size)),
    "few counts": np.random.default_rng(5).poisson(3, ANGLES.size) * 0.0123,
    "opaque": 0 * ANGLES,
}


@pytest.mark.parametrize("name", READINGS)
def test_a_zero_that_the_values_lead_to_is_a_reading(name, read):
    values = READINGS[name]
    assert (values == 0).any()
    data = read([*scan(matt()), *scan(values, side="T")])
    assert not (data.mask & ZERO.bit).any()


def test_the_horizon_is_dark(read):
    angles = np.arange(0.0, 91, 5)
    values = 0.2 * np.cos(np.deg2rad(angles)).round(9) ** 0.3
    assert values[-1] == 0
    assert read(scan(values, signed_deg=-angles)).used.all()


@pytest.mark.parametrize("inside", ["0", "-0.002", "0.001"])
@pytest.mark.parametrize("factor", [np.pi, 100.0, 100 * np.pi])
def test_a_shadow_does_not_hide_a_wrong_unit(factor, inside, read, refused):
    rows = []
    for theta_i in (20, 50):
        shadow = np.abs(ANGLES - theta_i) < 8
        values = scan(factor * 0.9 / np.pi * np.ones(ANGLES.size), theta_i)
        rows += [
            row.rpartition(",")[0] + "," + inside if dark else row
            for row, dark in zip(values, shadow, strict=True)
        ]
    with refused("gonio.csv", "row 2", "bsdf_per_sr", numbers=False):
        read(rows)


def test_exact_zeros_get_no_estimated_certainty(read, refused):
    # Repeats give a relative noise, of which nothing is left at 0.
    falls = np.maximum(0, 0.3 - 0.005 * np.abs(ANGLES))
    rng = np.random.default_rng(6)
    data = read([*scan(falls), *scan(falls * (1 + 0.01 * rng.normal(size=ANGLES.size)))])
    assert (data.bsdf_per_sr[data.used] == 0).any()
    _, sample = simulated_example()
    undeclared = dataclasses.replace(jaxink.load_sample(sample).noise, relative=None, floor_per_sr=0.0)
    with refused("gonio.csv", "row 2", "floor_per_sr"):
        noise_of(data, undeclared)


def test_a_sigma_of_zero_is_refused_with_what_to_do(tmp_path, refused):
    path = tmp_path / "gonio.csv"
    rows = [f"{row},{0 if i == 3 else 0.001}" for i, row in enumerate(scan(matt()))]
    path.write_text("\n".join([HEADER + ",sigma_per_sr", *rows]))
    with refused("gonio.csv", "row 5", "sigma_per_sr"):
        jaxink.read(path)


def test_arrays_are_masked_as_files_are(read):
    shadow = np.abs(ANGLES - 20) < 8
    data = read(scan(np.where(shadow, 0, matt())))
    again = jaxink.GonioData(*data.directions, data.bsdf_per_sr).with_masks()
    np.testing.assert_array_equal(again.mask, data.with_masks().mask)
    assert (again.mask[ANGLES == 20] == (ZERO.bit | RETRO.bit)).all()


def test_zeros_of_one_direction_are_no_repeats(read):
    rows = scan(matt())
    zero = "20,20,0,550,R,0"
    data = read([*(row for row in rows if not row.startswith("20,20,0,")), zero, zero])
    assert mask_counts(data.mask)["zero"] == 2
    assert not any("more than once" in note for note in data.notes)
    again = read([*rows, rows[3]])
    assert any("1 direction was measured more than once" in note for note in again.notes)
