"""What is known of a table from its sample: the media, and what it will contain."""

import dataclasses

import pytest

import jaxink
from jaxink.export.formats import FORMATS, refuse_expected
from jaxink.export.limitations import LOSSES, ExportOptions, LossRefusedError, expected_losses, losses_of
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.ink.foresight import expected_table
from jaxink.ink.ink_layers import InkChoice, UnclearInkError, adjacent_air, find_ink
from jaxink.ink.saved_fit import read_saved_fit


def sample_of(*layers):
    """Sample of named layers: (name, kind, index, further lines)."""
    text = "schema_version = 1\nwavelength_nm = [450, 650]\n"
    for name, kind, index, *more in layers:
        lines = [f'name = "{name}"', f'kind = "{kind}"', f"refractive_index = {index}", *more]
        text += "\n".join(["[[layers]]", *lines, ""])
    return jaxink.parse_sample(text)


def ink(name="ink", index=1.5, thickness_um=30.0, *more):
    return (
        name, "scattering", index, 'phase_function = "rayleigh"', f"thickness_um = {thickness_um}",
        "scattering_per_mm = 60", "absorption_per_mm = 1", *more,
    )  # fmt: skip


def clear(name, index=1.5, *more):
    return (name, "clear", index, "thickness_mm = 1.0", *more)


FACETS = '{ density = "ggx", sigma_deg = 8.0 }'
AIR, PLATE = clear("air", 1.0), clear("plate")


def choices(sample, *arguments):
    with pytest.raises(UnclearInkError) as caught:
        find_ink(sample, *arguments)
    return caught.value.choices


def test_air_is_never_taken_for_the_plate_by_itself():
    seen_through_air = sample_of(PLATE, AIR, ink())
    expected = (InkChoice(("ink",), "air"), InkChoice(("air", "ink"), "plate"))
    assert choices(seen_through_air) == expected
    for choice, media in zip(
        expected, (("air", "the surroundings"), ("plate", "the surroundings")), strict=True
    ):
        found = find_ink(seen_through_air, choice.layers, choice.inside)
        assert (found.names, found.media) == (choice.layers, media)
    # Further from the light than the ink, and beside a coat.
    assert choices(sample_of(clear("coat"), ink(), AIR, PLATE)) == (
        InkChoice(("ink",), "coat"), InkChoice(("ink",), "air"), InkChoice(("ink", "air"), "plate"),
    )  # fmt: skip
    assert choices(sample_of(AIR, ink())) == (InkChoice(("ink",), "air"),)


@pytest.mark.parametrize("index", ["1.0000005", "{ value = [1.0, 1.0000005], per_wavelength = true }"])
def test_air_is_air_within_a_millionth_at_all_wavelengths(index):
    assert choices(sample_of(PLATE, clear("air", index), ink()))


@pytest.mark.parametrize("index", ["1.00001", "{ value = [1.0, 1.3], per_wavelength = true }"])
def test_other_clear_layers_are_not_air(index):
    assert find_ink(sample_of(PLATE, clear("gel", index), ink())).media[0] == "gel"


def test_a_side_is_named_by_its_layer_or_as_seen_from_the_light():
    between = sample_of(clear("coat"), ink(), PLATE)
    assert choices(between) == (InkChoice(("ink",), "coat"), InkChoice(("ink",), "plate"))
    for name, side in (("coat", "front"), ("plate", "back"), ("front", "front"), ("back", "back")):
        assert find_ink(between, None, name).inside == side
    assert find_ink(between, None, "plate", index_outside=1.2).media == (
        "plate",
        "a medium of the given index",
    )
    alone = sample_of(ink())
    assert choices(alone) == (InkChoice(("ink",), "front"), InkChoice(("ink",), "back"))
    assert find_ink(alone, None, "back").media == ("the surroundings", "the surroundings")


def test_a_layer_further_away_makes_those_between_parts_of_the_ink():
    sample = sample_of(PLATE, AIR, clear("primer", 1.4), ink())
    (choice,) = choices(sample, "ink", "plate")
    assert choice == InkChoice(("air", "primer", "ink"), "plate")
    assert find_ink(sample, choice.layers, choice.inside).media[0] == "plate"


def test_of_several_inks_each_is_a_choice_and_so_are_all():
    sample = sample_of(PLATE, ink("white"), ink("red"), clear("coat"))
    assert choices(sample) == (
        InkChoice(("white",), "plate"), InkChoice(("red",), "coat"),
        InkChoice(("white", "red"), "plate"), InkChoice(("white", "red"), "coat"),
    )  # fmt: skip


def test_air_between_ink_and_plate_is_adjacent():
    assert adjacent_air(sample_of(PLATE, AIR, ink()), ("ink",)) == ("air",)
    assert adjacent_air(sample_of(PLATE, ink(), AIR), ("ink",)) == ()


def expected(sample, inside="plate", layers=None):
    found = find_ink(sample, layers, inside)
    return expected_table(found, sample.wavelengths_nm, has_standard_errors=False)


@pytest.mark.parametrize(
    ("layers", "keeps"),
    [
        ((PLATE, ink()), True),
        # Regular light from the plate ends at the facets, and so does light from outside.
        ((PLATE, ink("ink", 1.5, 30, f"back_roughness = {FACETS}")), False),
        # An interface may be declared by the plate; that between ink and air still reflects.
        ((clear("plate", 1.5, f"back_roughness = {FACETS}"), ink()), True),
        # The step between plate and ink reflects before the light reaches the facets.
        ((clear("plate", 1.6), ink("ink", 1.5, 30, f"back_roughness = {FACETS}")), True),
        # Nothing comes back through an optical thickness of 61, but air sees the face of the ink.
        ((PLATE, ink("ink", 1.5, 1000)), True),
        ((PLATE, ink("ink", 1.5, 1000), clear("coat", 1.5)), False),
        ((PLATE, ink(), clear("coat", 1.5)), True),
    ],
)
def test_regular_light_is_expected_where_a_smooth_face_is_reached(layers, keeps):
    assert expected(sample_of(*layers)).has_regular == keeps


def test_indices_and_faces_are_those_of_the_sample():
    rough = ink("ink", 1.5, 30, f"back_roughness = {FACETS}")
    plate = clear("plate", "{ value = [1.53, 1.49], per_wavelength = true }")
    table = expected(sample_of(rough, plate))
    assert (table.wavelength_nm, table.index_inside, table.index_outside) == (
        (450, 650),
        (1.53, 1.49),
        (1, 1),
    )
    # The face of the ink at the plate.
    assert table.rough_faces == ("ink.back_roughness",)
    names = [loss.name for loss in expected_losses(table, LOSSES)]
    assert names == ["regular", "beyond_critical", "narrow_lobes", "index_step"]


def test_all_losses_of_the_table_are_expected(unmatched, unmatched_table):
    foreseen = expected(unmatched, None)
    assert foreseen.index_inside == pytest.approx(unmatched_table.index_inside)
    for limits in (LOSSES, ("standard_errors", "regular")):
        known = [loss.name for loss in expected_losses(foreseen, limits)]
        assert known == [loss.name for loss in losses_of(unmatched_table, limits)]


@pytest.mark.parametrize("format", FORMATS)
def test_an_export_is_refused_for_what_it_is_expected_to_lose(format, unmatched):
    table = dataclasses.replace(expected(unmatched, None), has_standard_errors=True)
    losses = {
        "zemax": ("regular", "beyond_critical", "standard_errors"),
        "lighttools": ("regular", "standard_errors"),
        "speos": ("regular", "standard_errors"),
        "radiance": ("regular", "index_step", "standard_errors"),
        "integra": ("standard_errors",),
        "mitsuba": ("standard_errors",),
    }.get(format, ())
    refuse_expected(table, format, ExportOptions(drop=losses))
    if losses:
        with pytest.raises(LossRefusedError) as caught:
            refuse_expected(table, format, ExportOptions(drop=("beyond_critical",)))
        assert caught.value.losses == tuple(name for name in losses if name != "beyond_critical")
    if "regular" in losses:
        refuse_expected(table, format, ExportOptions(drop=losses[1:], regular_bin_deg=5.0))


def test_a_saved_fit_is_read_without_its_measurement(example_result, tmp_path):
    path = example_result.save(tmp_path)
    (tmp_path / "result.nc").unlink()
    for source in (tmp_path, path):
        saved = read_saved_fit(source)
        assert saved.sample == example_result.sample
        assert saved.wavelengths_nm == (550.0,)
        assert saved.has_standard_errors
    rows = tuple(dataclasses.replace(p, standard_error=None) for p in example_result.parameters.values())
    dataclasses.replace(example_result, parameters=FittedParameters.of(rows)).save(tmp_path)
    assert not read_saved_fit(tmp_path).has_standard_errors


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"parameters": [1], "scans": [], "sample": {}}'])
def test_what_is_not_a_result_is_left_to_its_reader(content, tmp_path):
    (tmp_path / "result.json").write_text(content, encoding="utf-8")
    assert read_saved_fit(tmp_path) is None
    assert read_saved_fit(tmp_path / "missing") is None
