"""A file with several conditions is divided into measurements, or its words are refused."""

import csv

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.sample.turning import turned_over
from tests.projects.conftest import SAMPLE, TRUTH, measured, project_of
from tests.samples import edited

HEAD = 'schema_version = 1\nsample = "ink.toml"\n'
ONE = HEAD + '[[measurements]]\nname = "print"\ndata = "print.csv"\n'
HEADER = ["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr"]


def written(folder, columns, name="print.csv", sample=SAMPLE):
    """A file with four directions of each state; the cells of the columns by state."""
    (folder / "ink.toml").write_text(sample)
    rows = [
        [30, view, 180, 550, side, 0.2 + 0.01 * k + view / 1000, *state]
        for k, state in enumerate(zip(*columns.values(), strict=True))
        for side in "RT"
        for view in (0, 20, 40, 60)
    ]
    with open(folder / name, "w", newline="") as file:
        csv.writer(file).writerows([[*HEADER, *columns], *rows])


def divided(folder, columns, text=ONE, **of_file):
    written(folder, columns, **of_file)
    return project_of(text, folder)


def names(project):
    return [one.name for one in project.measurements]


def layers(one):
    return [layer.name for layer in one.sample.layers]


def value(one, name):
    return one.sample.parameters[name].value


@pytest.mark.parametrize("words", [("plate", "ink"), ("Plate", "INK"), ("front", "back")])
def test_lit_sides(words, tmp_path):
    project = divided(tmp_path, {"Lit side": words})
    assert names(project) == [f"print_{word}" for word in words]
    assert [layers(one) for one in project.measurements] == [["plate", "ink"], ["ink", "plate"]]
    assert [len(one.data) for one in project.measurements] == [8, 8]
    assert project["print_" + words[1]].data.row[0] == 10
    assert all(p.name in TRUTH for p in project.free)


@pytest.mark.parametrize(("word", "first"), [("ink", "ink"), ("plate", "plate"), ("top", "plate")])
def test_one_lit_side_is_taken_from_the_file(word, first, tmp_path):
    project = divided(tmp_path, {"lit_side": [word]})
    assert names(project) == ["print"]
    assert layers(project["print"])[0] == first


def test_rows_choose_and_their_value_applies(tmp_path):
    states = {"lit_side": ["plate", "ink", "ink"], "thickness_um": [30, 30, 75]}
    project = divided(tmp_path, states, ONE + 'rows = { lit_side = "ink", thickness_um = 75.0 }\n')
    one = project["print"]
    assert layers(one) == ["ink", "plate"]
    assert value(one, "ink.thickness_um") == 75
    assert len(one.data) == 8
    chosen = divided(tmp_path, states, ONE + 'rows = { lit_side = "ink" }\n')
    assert names(chosen) == ["print_30um", "print_75um"]


def test_what_rows_choose_may_be_stated_otherwise(tmp_path):
    columns = {"lit_side": ["top", "bottom"], "thickness_um": [30, 75], "backing": ["card", "no"]}
    text = edited(ONE, ("[[measurements]]", "[specimens.a]\nink.thickness_um = 31\n[[measurements]]"))
    text += 'rows = { lit_side = "bottom" }\nlit_side = "ink"\nspecimen = "a"\n'
    text += "changes.backing.reflectance = 0.1\n"
    one = divided(tmp_path, columns, text)["print"]
    assert layers(one) == ["ink", "plate"]
    assert (value(one, "ink.thickness_um"), value(one, "backing.reflectance")) == (31, 0.1)


def test_thicknesses_are_shared(tmp_path):
    free = edited(
        SAMPLE, ("thickness_um = 30", "thickness_um = { free = true, min = 10, max = 100, value = 40 }")
    )
    columns = {"lit_side": ["plate", "plate", "ink"], "Thickness (µm)": [30, "75.5", "75.50"]}
    project = divided(tmp_path, columns, sample=free)
    assert names(project) == ["print_plate_30um", "print_plate_75_5um", "print_ink_75_5um"]
    assert {p.name for p in project.free} - TRUTH.keys() == {
        "thickness_30um/ink.thickness_um",
        "thickness_75_5um/ink.thickness_um",
    }
    thick = "thickness_75_5um/ink.thickness_um"
    assert project.measured_in(thick) == ("print_plate_75_5um", "print_ink_75_5um")
    assert project.parameters[thick].value == 75.5


def test_files_of_one_value_each_differ(tmp_path):
    written(tmp_path, {"thickness_um": [40], "backing": ["0.5"], "sample": ["a"]}, "thin.csv")
    written(tmp_path, {"thickness_um": [75], "backing": ["0.5"], "sample": ["b"]}, "thick.csv")
    pair = [f'[[measurements]]\nname = "{name}"\ndata = "{name}.csv"\n' for name in ("thin", "thick")]
    project = project_of(HEAD + "[specimens.b]\nink.refractive_index = 1.51\n" + "".join(pair), tmp_path)
    assert names(project) == ["thin", "thick"]
    assert [value(one, "ink.thickness_um") for one in project.measurements] == [40, 75]
    assert [value(one, "ink.refractive_index") for one in project.measurements] == [1.5, 1.51]
    assert project["thin"].sample.backing is None
    # A column without a cell says nothing.
    written(tmp_path, {"thickness_um": [""]}, "thick.csv")
    assert value(project_of(HEAD + "".join(pair), tmp_path)["thin"], "ink.thickness_um") == 30
    written(tmp_path, {"thickness_um": [75]}, "thick.csv")
    # Alone, each is left to the sample file.
    assert value(project_of(HEAD + pair[1], tmp_path)["thick"], "ink.thickness_um") == 30


def test_samples_are_specimens(tmp_path):
    text = edited(
        ONE,
        (
            "[[measurements]]",
            '[specimens."No 1"]\nink.thickness_um = 31\n[specimens.b]\n[[measurements]]',
        ),
    )
    project = divided(tmp_path, {"Specimen": ["No_1", "b"], "thickness_um": [30, 30]}, text)
    assert names(project) == ["print_No_1", "print_b"]
    assert [value(one, "ink.thickness_um") for one in project.measurements] == [31, 30]
    assert "No 1/ink.thickness_um" in project.parameters


def test_thicknesses_belong_to_their_specimen(tmp_path):
    text = edited(ONE, ("[[measurements]]", "[specimens.b]\n[[measurements]]")) + 'specimen = "b"\n'
    project = divided(tmp_path, {"thickness_um": [30, 60]}, text)
    assert "b_thickness_60um/ink.thickness_um" in project.parameters


def test_a_specimen_knows_its_thickness_better_than_the_file(tmp_path, told):
    text = edited(
        ONE, ("[[measurements]]", "[specimens.a]\n[specimens.b]\nink.thickness_um = 74\n[[measurements]]")
    )
    columns = {"sample": ["a", "b"], "thickness_um": [30, 75]}
    project = divided(tmp_path, columns, text)
    assert [value(one, "ink.thickness_um") for one in project.measurements] == [30, 74]
    with pytest.raises(InputRefusedError) as problem:
        divided(tmp_path, {"sample": ["a", "b", "b"], "thickness_um": [30, 75, 80]}, text)
    told(str(problem.value), "row 10", "thickness_um")
    # Changes of the measurement hold for both.
    with pytest.raises(InputRefusedError) as problem:
        divided(tmp_path, columns, text + "changes.ink.thickness_um = 30\n")
    told(str(problem.value), "thickness_um")


def test_a_sample_that_is_chosen_may_be_no_specimen(tmp_path):
    project = divided(tmp_path, {"sample": ["a", "b"]}, ONE + 'reading = { sample = "a" }\n')
    assert (names(project), project["print"].data.attrs["sample"]) == (["print"], "a")


def test_backings(tmp_path):
    text = edited(
        ONE,
        (
            '"ink.toml"\n',
            '"ink.toml"\nbackings = { white = 0.83, "3" = { reflectance = 0.2, side = "R" } }\n',
        ),
    )
    project = divided(tmp_path, {"card": ["White", "0.04", "none", 3]}, text)
    assert names(project) == ["print_White", "print_0_04", "print_none", "print_3"]
    backings = [one.sample.backing for one in project.measurements]
    assert [backing is None for backing in backings] == [False, False, True, False]
    held = {name: p.value for name, p in project.parameters.items() if "backing" in name}
    assert held == {
        "backing_White/backing.reflectance": 0.83,
        "backing_0_04/backing.reflectance": 0.04,
        "backing_3/backing.reflectance": 0.2,
    }


def test_several_files_and_what_is_stated_of_each(tmp_path):
    columns = {"lit_side": ["plate", "ink"]}
    written(tmp_path, columns)
    written(tmp_path, {"illuminated side": ["ink"]}, "more.csv")
    for name in ("print.csv", "more.csv"):
        lines = (tmp_path / name).read_text().splitlines()
        kept = [line.split(",") for line in lines if ",T," not in line]
        (tmp_path / name).write_text("\n".join(",".join(row[:4] + row[5:]) for row in kept))
    text = edited(ONE, ('"print.csv"', '["print.csv", "more.csv"]\nreading = { side = ["R", "T"] }'))
    project = project_of(text, tmp_path)
    assert names(project) == ["print_plate", "print_ink"]
    assert ["".join(sorted(set(one.data.side))) for one in project.measurements] == ["R", "RT"]
    assert project["print_plate"].data.source == "print.csv"


def test_words_without_letters_are_numbered(tmp_path):
    text = edited(ONE, ('"ink.toml"\n', '"ink.toml"\nbackings = { "白" = 0.83, "黒" = 0.04 }\n'))
    project = divided(tmp_path, {"backing": ["白", "黒"]}, text)
    assert names(project) == ["print_1", "print_2"]
    assert len({name for name in project.parameters if "backing" in name}) == 2


def test_readings_are_no_conditions(tmp_path):
    written(tmp_path, {"repeat": [1]})
    lines = (tmp_path / "print.csv").read_text().splitlines()
    directions = [f"30,{view},90,550,R,0.2,{0.001 * view}" for view in range(5, 65)]
    (tmp_path / "print.csv").write_text("\n".join([lines[0].replace("repeat", "background"), *directions]))
    assert names(project_of(ONE, tmp_path)) == ["print"]


STATES = {"lit_side": ["plate", "ink"]}
TWO_INKS = edited(
    SAMPLE, ("[noise]", SAMPLE[SAMPLE.index('[[layers]]\nname = "ink"') :].replace('"ink"', '"coat"'))
).rsplit("[noise]", 1)[0]
BAD = {
    "a word for a side": (
        {"lit_side": ["top", "bottom"]},
        "",
        ("row 2", "lit_side", "'top'", "plate or ink"),
    ),
    "a chosen word for a side": (
        {"lit_side": ["top", "bottom"]},
        'rows = { lit_side = "bottom" }',
        ("row 10", "lit_side", "'bottom'"),
    ),
    "an empty cell": ({"lit_side": ["plate", ""]}, "", ("row 10", "lit_side", "empty")),
    "sides twice": (STATES, 'lit_side = "ink"', ("lit_side", "rows")),
    "another side": ({"lit_side": ["ink"]}, 'lit_side = "plate"', ("row 2", "'ink'", "'plate'")),
    "no specimen": ({"sample": ["a", "red 1"]}, "", ("row 2", "'a'", "[specimens.a]")),
    "specimens twice": (
        {"sample": ["a", "b"]},
        'specimen = "thick"\n[specimens.thick]\nink.thickness_um = 75',
        ("specimen", "rows"),
    ),
    "thickness twice": (
        {"thickness_um": [30, 75]},
        "changes.ink.thickness_um = 30",
        ("thickness_um", "rows"),
    ),
    "thickness in words": ({"thickness_um": [30, "thick"]}, "", ("row 10", "'thick'", "micrometres")),
    "thickness in mm": ({"thickness (mm)": [0.03, 0.075]}, "", ("thickness (mm)", "'mm'", "thickness_um")),
    "thickness without a unit": ({"thickness": [30, 75]}, "", ("column thickness", "thickness_um")),
    "thickness out of range": ({"thickness_um": [30, -75]}, "", ("print_-75um", "ink.thickness_um")),
    "backing twice": ({"backing": [0.1, 0.8]}, "changes.backing.reflectance = 0.1", ("backing", "rows")),
    "a card": ({"backing": ["none", "black"]}, "", ("row 10", "'black'", "backings = { black = 0.5 }")),
    "a card with a blank": ({"backing": ["none", "card 1"]}, "", ('backings = { "card 1" = 0.5 }',)),
    "per cent": ({"backing": [0.04, 83]}, "", ("row 10", "83", "backings")),
    "a row that is absent": (STATES, 'rows = { lit_side = "coat" }', ("print", "lit_side", "coat")),
    "rows that are never together": (
        {"lit_side": ["plate", "ink"], "thickness_um": [30, 75]},
        'rows = { lit_side = "ink", thickness_um = 30 }',
        ("lit_side", "thickness_um"),
    ),
    "changes of a layer that are none": ({"thickness_um": [30, 75]}, "changes.ink = 3", ("changes.ink",)),
    "a column that is absent": (STATES, 'rows = { lamp = "A" }', ("print", "lamp")),
    "rows without cells": (STATES, "rows = { lit_side = true }", ("rows.lit_side", "True")),
    "rows a word": (STATES, 'rows = "ink"', ("rows",)),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_condition_is_refused(case, tmp_path, told):
    columns, more, named = BAD[case]
    with pytest.raises(InputRefusedError) as problem:
        divided(tmp_path, columns, ONE + more)
    told(str(problem.value), "measurement 'print", *named)


@pytest.mark.parametrize("given", ["true", '"bright"', "[0.8]"])
def test_a_card_is_a_reflectance(given, tmp_path, told):
    text = edited(ONE, ('"ink.toml"\n', f'"ink.toml"\nbackings.white = {given}\n'))
    with pytest.raises(InputRefusedError) as problem:
        divided(tmp_path, STATES, text)
    told(str(problem.value), "backings.white")


def test_the_ink_must_be_known(tmp_path, told):
    with pytest.raises(InputRefusedError) as problem:
        divided(tmp_path, {"thickness_um": [30, 75]}, sample=TWO_INKS)
    told(str(problem.value), "2 scattering layers")
    known = edited(
        SAMPLE,
        ("thickness_um = 30", "thickness_um = { value = 30, prior = { mean = 30, standard_deviation = 1 } }"),
    )
    with pytest.raises(InputRefusedError) as problem:
        divided(tmp_path, {"thickness_um": [30, 75]}, sample=known)
    told(str(problem.value), "ink.thickness_um", "prior")


def test_readings_are_read_whole(tmp_path, told):
    written(tmp_path, STATES)
    with pytest.raises(InputRefusedError) as problem:
        project_of(edited(ONE, ("data =", "readings =")) + 'rows = { lit_side = "ink" }\n', tmp_path)
    told(str(problem.value), "measurement 'print'", "rows")


def test_every_file_states_its_condition(tmp_path, told):
    written(tmp_path, STATES)
    (tmp_path / "more.csv").write_text("\n".join([",".join(HEADER), "30,10,180,550,R,0.2"]))
    with pytest.raises(InputRefusedError) as problem:
        project_of(edited(ONE, ('"print.csv"', '["print.csv", "more.csv"]')), tmp_path)
    told(str(problem.value), "more.csv", "lit_side", "print.csv")
    jaxink.read(tmp_path / "more.csv").to_netcdf(tmp_path / "more.nc")
    with pytest.raises(InputRefusedError) as problem:
        project_of(edited(ONE, ('"print.csv"', '["print.csv", "more.nc"]')), tmp_path)
    told(str(problem.value), "more.nc", "lit_side", "print.csv")


def test_a_refusal_of_the_reader_points_to_a_project(tmp_path, refused):
    written(tmp_path, {"thickness_um": [30, 75]})
    with refused("thickness_um", "project"):
        jaxink.read(tmp_path / "print.csv")


def test_the_truth_is_found_from_files_with_conditions(tmp_path):
    """One file with both lit sides of the thin print, another with two thicknesses."""
    thin = jaxink.parse_sample(SAMPLE).replace(TRUTH)
    thick = thin.replace({"ink.thickness_um": 75})
    turned = turned_over(thin)
    assert turned is not None
    (tmp_path / "ink.toml").write_text(SAMPLE)
    files = {
        "sides": ("lit_side", {"plate": thin, "ink": turned}),
        "steps": ("thickness (um)", {"30": thin, "75": thick}),
    }
    seed = 0
    for name, (heading, states) in files.items():
        lines = []
        for cell, sample in states.items():
            jaxink.measurement.write_csv(measured(sample, seed), tmp_path / "one.csv")
            seed += 1
            head, *rows = [
                line for line in (tmp_path / "one.csv").read_text().splitlines() if not line.startswith("#")
            ]
            lines += [*([] if lines else [f"{head},{heading}"]), *(f"{row},{cell}" for row in rows)]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines))
    text = HEAD + "".join(f'[[measurements]]\nname = "{name}"\ndata = "{name}.csv"\n' for name in files)
    (tmp_path / "project.toml").write_text(text)
    project = jaxink.load_project(tmp_path / "project.toml")
    assert names(project) == ["sides_plate", "sides_ink", "steps_30um", "steps_75um"]
    result = jaxink.fit(project)
    assert result.converged
    assert 0.8 < result.reduced_chi_square < 1.2
    for name, true in TRUTH.items():
        found = result[name]
        assert abs(found.value - true) < 3 * found.standard_error, name
    assert not result.agreement.disagrees
    np.testing.assert_array_equal(result.of("steps_75um").sample.parameters["ink.thickness_um"].value, 75)
