"""Every bad project gets a sentence that names the place and the remedy."""

import dataclasses

import pytest

import jaxink
from jaxink.errors import InputRefusedError
from tests.projects.conftest import PROJECT, project_of
from tests.samples import edited

FIRST = 'name = "thin"\ndata = "thin.csv"'
# What is changed in the project file, and what the sentence names.
BAD = {
    "version": (("schema_version = 1", "schema_version = 2"), ("schema_version", "1")),
    "no version": (("schema_version = 1\n", ""), ("schema_version",)),
    "unknown key": (("title =", "titel ="), ("titel", "title")),
    "no sample": (('sample = "ink.toml"\n', ""), ("sample", "[sample]")),
    "absent sample": (("ink.toml", "inks.toml"), ("inks.toml",)),
    "sample a number": (('"ink.toml"', "3"), ("sample",)),
    "no measurements": ((PROJECT[PROJECT.index("[specimens") :], ""), ("[[measurements]]",)),
    "measurements a table": (
        (PROJECT[PROJECT.index("[specimens") :], "[measurements]\n"),
        ("[[measurements]]",),
    ),
    "no name": (('name = "thin"\n', ""), ("measurement 1", "name")),
    "bad name": (('name = "thin"', 'name = "thin ink"'), ("thin ink", "letters")),
    "name twice": (('name = "thick"\n', 'name = "Thin"\n'), ("thin", "differ")),
    "no data": (('data = "thin.csv"\n', ""), ("thin", "data")),
    "absent data": (("thin.csv", "thinn.csv"), ("thinn.csv",)),
    "data a number": (('"thin.csv"', "7"), ("data",)),
    "unknown key of a measurement": ((FIRST, FIRST + "\nlit = 3"), ("'lit'", "lit_side")),
    "unknown specimen": ((FIRST, FIRST + '\nspecimen = "thik"'), ("thik", "thick")),
    "unused specimen": (('specimen = "thick"\n', ""), ("specimens.thick",)),
    "specimen a number": ((FIRST, FIRST + "\nspecimen = 3"), ("specimen",)),
    "specimen named as the measurement": (
        ('data = "thick.csv"', 'data = "thick.csv"\nchanges.noise.relative = 0.01'),
        ("thick", "name"),
    ),
    "instrument with a layer": (
        ("[specimens.thick]", "[instruments.arm]\nink.thickness_um = 3\n[specimens.thick]"),
        ("instruments.arm", "ink"),
    ),
    "unused instrument": (
        ("[specimens.thick]", "[instruments.arm]\nnoise.relative = 0.01\n[specimens.thick]"),
        ("instruments.arm",),
    ),
    "unknown instrument": (
        (
            "[specimens.thick]",
            "[instruments.arm]\nnoise.relative = 0.01\n[specimens.thick]",
            FIRST,
            FIRST + '\ninstrument = "arms"',
        ),
        ("arms", "arm"),
    ),
    "unknown layer": ((FIRST, FIRST + "\nchanges.paint.thickness_um = 3"), ("changes.paint", "ink")),
    "unknown key of a layer": ((FIRST, FIRST + "\nchanges.ink.thick = 3"), ("thin", "thick")),
    "layer a number": ((FIRST, FIRST + "\nchanges.ink = 3"), ("changes.ink",)),
    "changes a number": ((FIRST, FIRST + "\nchanges = 3"), ("changes",)),
    "value out of range": ((FIRST, FIRST + "\nchanges.ink.thickness_um = -3"), ("ink.thickness_um", "-3")),
    "free without a range": (
        (FIRST, FIRST + "\nchanges.ink.thickness_um = { free = true }"),
        ("ink.thickness_um", "min"),
    ),
    "unknown side": (('lit_side = "ink"', 'lit_side = "top"'), ("lit_side", "top", "ink")),
    "opaque layer lit": (("ink.thickness_um = 75", 'ink.thickness_um = "opaque"'), ("opaque",)),
    "unknown keyword of reading": ((FIRST, FIRST + "\nreading.colour = 3"), ("colour",)),
    "another wavelength": ((FIRST, FIRST + "\nchanges.wavelength_nm = 600"), ("thin", "600")),
    "nothing free": (
        (
            FIRST,
            FIRST
            + "\nchanges.ink.scattering_per_mm = 60\nchanges.ink.absorption_per_mm = 1"
            + "\nchanges.ink.asymmetry_parameter = 0.5",
        ),
        ("thin", "free"),
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_project_is_refused(case, project_folder, told):
    changes, named = BAD[case]
    text = PROJECT
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new)
    with pytest.raises(InputRefusedError) as refused:
        jaxink.fit(project_of(text, project_folder))
    told(str(refused.value), *named)


def test_a_project_has_no_sample_beside_it(project, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.fit(project, "ink.toml")
    told(str(refused.value), "sample")


def test_a_shared_parameter_is_the_same_everywhere(project, told):
    one, other, *_ = project.measurements
    table = other.sample.parameters.replace("ink.scattering_per_mm", maximum=400.0)
    changed = dataclasses.replace(other, sample=dataclasses.replace(other.sample, parameters=table))
    with pytest.raises(InputRefusedError) as refused:
        dataclasses.replace(project, measurements=(one, changed))
    told(str(refused.value), "ink.scattering_per_mm", "thin", "thick")


def test_changes_replace_single_keys_and_false_removes_a_table(project_folder):
    text = edited(
        PROJECT,
        (FIRST, FIRST + "\nchanges.noise.relative = 0.01\nchanges.backing = { reflectance = 0.5 }"),
    )
    project = project_of(text, project_folder)
    noise = project["thin"].sample.noise
    assert (noise.relative, noise.floor_per_sr) == (0.01, 1e-4)
    assert "thin/backing.reflectance" in project.parameters
    assert project["thick"].sample.backing is None
    removed = edited(text, ("backing = { reflectance = 0.5 }", "backing = false"))
    assert project_of(removed, project_folder)["thin"].sample.backing is None
