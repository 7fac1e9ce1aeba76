"""Keys of a project file.

`docs/manual/tables.py` generates the tables of docs/manual/projects.md from these.
"""

from jaxink.sample import TOP as SAMPLE_TOP
from jaxink.sample import Entry

PROJECT_VERSION = 1
TOP = {
    "schema_version": Entry(f"`{PROJECT_VERSION}`", "required", "version of the project file"),
    "title": Entry("text", "empty", "for people"),
    "sample": Entry(
        "a file, or a table",
        "required",
        "the sample that all measurements have in common: a sample file, or `[sample]` with its content",
    ),
    "instruments": Entry(
        "tables", "none", "`[instruments.NAME]`: properties of an instrument, which its measurements share"
    ),
    "specimens": Entry(
        "tables", "none", "`[specimens.NAME]`: changes that the measurements of one print or drawdown share"
    ),
    "backings": Entry(
        "a table",
        "none",
        "reflectance of the cards that files name, such as `{ white = 0.83, black = 0.04 }`; "
        "also a table as `[backing]`, or `false` for no backing",
    ),
    "measurements": Entry("tables", "required", "one `[[measurements]]` for each"),
}
# Of a sample file, what is a property of an instrument.
INSTRUMENT = {key: SAMPLE_TOP[key] for key in ("instrument", "noise", "masks", "effects")}
MEASUREMENT = {
    "name": Entry("letters, digits, `-` and `_`", "required", "names its parameters and its folder"),
    "data": Entry("a file, or a list", "this or `readings`", "files of a BSDF, from the project's folder"),
    "readings": Entry(
        "a file", "this or `data`", "totals, collimated light or reflectance factors: [readings](readings.md)"
    ),
    "rows": Entry(
        "a table",
        "all rows",
        'rows of the files that are read: the cell by column, such as `{ lit_side = "ink" }`; '
        'see "Several conditions in one file"',
    ),
    "reading": Entry(
        "a table",
        "empty",
        "what the files do not state: keywords of `jaxink.read`, or of `jaxink.read_readings`",
    ),
    "instrument": Entry("a name", "none", "one of `[instruments.NAME]`, or a word for people"),
    "specimen": Entry("a name", "none", "one of `[specimens.NAME]`"),
    "lit_side": Entry(
        'a layer, `"front"` or `"back"`', "the first layer", "which of the outer layers is lit"
    ),
    "changes": Entry("a table", "empty", "what differs from the common sample and the specimen, see below"),
}
# Keywords of `jaxink.read` that a file of TOML can hold.
READING = (
    "wavelength_nm",
    "side",
    "sample",
    "sheet",
    "matrix",
    "phi_deg",
    "phi_o_deg",
    "signed_angles",
    "face",
    "channel",
    "rotation_deg",
    "angle_unit",
    "theta_i_deg",
    "specular_phi_deg",
    "cosine_weighted",
    "scale",
    "every",
    "columns",
)
