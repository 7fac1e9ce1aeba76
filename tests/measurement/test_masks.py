import jaxtyping
import numpy as np

from jaxink.measurement import (
    MASK_FLAGS,
    GonioData,
    MaskLimits,
    mask_counts,
    mask_sentences,
    read,
)
from jaxink.measurement.masks import angular_distance_deg

NONE = MaskLimits(None, None, None, None)


def points(rows) -> GonioData:
    """From rows of theta_i, theta_o, phi, side."""
    theta_i, theta_o, phi, side = zip(*rows, strict=True)
    size = len(rows)
    return GonioData(theta_i, theta_o, phi, np.full(size, 550), np.array(side) == "T", np.full(size, 0.1))


def names(data) -> list[set[str]]:
    return [{flag.name for flag in MASK_FLAGS if mask & flag.bit} for mask in data.mask]


def test_flags_are_distinct_bits():
    bits = [flag.bit for flag in MASK_FLAGS]
    assert sorted(bits) == [1 << n for n in range(len(bits))]


def test_angular_distance_against_vectors():
    rng = np.random.default_rng(3)
    theta, phi = rng.uniform(0, 90, (2, 200)), rng.uniform(-180, 180, (2, 200))
    a, b = (
        np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
        for t, p in zip(np.deg2rad(theta), np.deg2rad(phi), strict=True)
    )
    expected = np.rad2deg(np.arctan2(np.linalg.norm(np.cross(a.T, b.T), axis=1), (a * b).sum(0)))
    got = angular_distance_deg(theta[0], phi[0], theta[1], phi[1])
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    small = angular_distance_deg(np.array([45.0]), np.array([0.0]), np.array([45.0 + 1e-9]), 0.0)
    np.testing.assert_allclose(small, 1e-9, rtol=1e-5)


def test_each_side_has_its_own_directions():
    rows = [(30, 31, 180, "R"), (30, 31, 180, "T"), (30, 31, 0, "R"), (30, 31, 0, "T")]
    assert names(points([*rows, (30, 60, 90, "R")]).with_masks()) == [
        {"specular"},
        {"undeviated"},
        {"retro"},
        set(),
        set(),
    ]


def test_distance_is_true_on_the_sphere():
    # 10 degrees of azimuth are 10 sin(theta) on the sphere: 0.35 near the normal, 7.1 at 45.
    data = points([(2, 2, 170, "R"), (45, 45, 170, "R"), (0, 2, 77, "R")])
    limits = MaskLimits(2.5, 2.5, None, None)
    assert names(data.with_masks(limits)) == [{"specular"}, set(), {"specular"}]


def test_point_at_the_limit_stays():
    rows = [(30, 32.5, 180, "R"), (30, 27.5, 180, "T"), (30, 32.499, 180, "R"), (0, 85, 0, "R")]
    masked = points(rows).with_masks(MaskLimits(2.5, 2.5, 2.5, 85))
    assert masked.used.tolist() == [True, True, False, True]


def test_grazing_and_user_add_up(told):
    data = points([(0, 85.5, 0, "R"), (0, 40, 0, "R"), (0, 50, 0, "R")])
    user = np.array([True, True, False])
    masked = data.with_masks(MaskLimits(grazing_theta_o_deg=85), user)
    assert names(masked) == [{"grazing", "user"}, {"user"}, set()]
    assert mask_counts(masked.mask) == {
        "negative": 0,
        "specular": 0,
        "undeviated": 0,
        "retro": 0,
        "grazing": 1,
        "user": 2,
        "zero": 0,
    }
    # Three reasons for two points.
    all_masked, grazing, user, used = mask_sentences(masked.mask)
    told(all_masked, "2 of 3", "several reasons")
    told(grazing, "1 of 3", "grazing")
    told(user, "2 of 3", "user")
    told(used, "1 of 3")


def test_geometry_is_replaced_but_user_stays():
    data = points([(30, 30, 180, "R"), (30, 60, 0, "R"), (30, 70, 0, "R")])
    once = data.with_masks(user=np.array([False, True, False]))
    assert names(once) == [{"specular"}, {"user"}, set()]
    assert names(once.with_masks(NONE)) == [set(), {"user"}, set()]


def test_negative_is_always_masked():
    data = points([(30, 30, 180, "R"), (30, 60, 0, "R")]).replace(bsdf_per_sr=[0.1, -0.1])
    assert names(data.with_masks(NONE)) == [set(), {"negative"}]


def test_refuses(monkeypatch, refused):
    # As for users, for whom no one else checks types before.
    monkeypatch.setattr(jaxtyping.config, "jaxtyping_disable", True)
    data = points([(30, 30, 180, "R"), (30, 60, 0, "R")])
    cases = [
        (lambda: MaskLimits(retro_half_angle_deg=-1), "retro_half_angle_deg"),
        (lambda: MaskLimits(grazing_theta_o_deg=float("nan")), "grazing_theta_o_deg"),
        (lambda: data.with_masks(user=[True]), "user"),
        (lambda: data.with_masks(user=[1, 0]), "user"),
        (
            lambda: data.with_masks(user=np.array([False, True])),
            "user 1",
        ),
    ]
    for call, named in cases:
        with refused(named):
            call()


def test_simulated_data_keep_every_point(shared_data):
    # Their nearest rows are 5 degrees from the regular peaks and from the source.
    data = read(shared_data / "simulated" / "plain_hg.csv")
    assert data.with_masks(MaskLimits(5.0, 5.0, 5.0)).used.all()
    for limits in (MaskLimits(5.1, 0, 0), MaskLimits(0, 5.1, 0), MaskLimits(0, 0, 5.1)):
        assert not data.with_masks(limits).used.all()
