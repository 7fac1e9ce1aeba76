"""Keys of a plan file: tables, valid values and meanings.

`docs/manual/tables.py` generates the tables of docs/manual/batch.md from these.
"""

from jaxink.sample.quantity import Entry, Quantity, quoted

PLAN_VERSION = 1
WORK = ("fit", "diagnose", "both")
TOP = {
    "schema_version": Entry(f"`{PLAN_VERSION}`", "required", "version of the plan file"),
    "title": Entry("text", "the name of the file", "heading of the report"),
    "sample": Entry("a file", "required", "sample file of all measurements, from the folder of the plan"),
    "work": Entry(
        quoted(WORK),
        f'`"{WORK[0]}"`',
        "what is done for each measurement; `both`: a fit, and a diagnosis that begins with it",
    ),
    "figures": Entry("`true` or `false`", "`false`", "whether figures are drawn for each measurement"),
    "check_input": Entry(
        "`true` or `false`",
        "`true`",
        "whether a fit that misses the noise is tested for mistakes in the input, as `jaxink fit` does",
    ),
    "measurements": Entry("a table", "required", "which measurements, see below"),
    "reading": Entry("a table", "empty", "what the files do not state, see below"),
    "fit": Entry("a table", "empty", "options of the fits, see below"),
    "diagnosis": Entry("a table", "empty", "options of the diagnoses, see below"),
    "limits": Entry("a table", "empty", "limits of one measurement, see below"),
}
MEASUREMENTS = {
    "files": Entry(
        "a pattern such as `sheets/*.csv`, or a list of patterns",
        "this or `table`",
        "one measurement for each file, in the order of their names",
    ),
    "table": Entry("a CSV file", "this or `files`", "one measurement for each row, see below"),
}
READING = {
    "wavelength_nm": Entry("a number", "-", "wavelength of every row, if the files have no column for it"),
    "side": Entry(
        quoted(("R", "T")) + ", or a list",
        "-",
        "side of every row; a list with one entry for each file of a measurement",
    ),
    "sample": Entry("text", "-", "sample to read, if the column `sample` of the files has several"),
    "sheet": Entry(
        "text", "-", "sheet of a workbook, if several are not empty; `R,T` or `A=R,B=T` joins several"
    ),
    "matrix": Entry("text", "-", "edges of a matrix that does not name them: `theta_o_deg,theta_i_deg`"),
    "phi_deg": Entry("a number", "-", "relative azimuth of every row, if the files do not state it"),
    "phi_o_deg": Entry("a number", "-", "azimuth of view of every row, with one of incidence in the files"),
    "signed_angles": Entry(
        "`true` or `false`", "`false`", "a negative `theta_o_deg` means the other half-plane"
    ),
    "face": Entry(quoted(("front", "back")), "-", "face that the light meets, if the file has both"),
    "channel": Entry("text", "-", "colour channel, if the values are colours"),
    "rotation_deg": Entry("a number", "-", "rotation of the sample, if the file has several"),
    "angle_unit": Entry(quoted(("deg", "rad")), "-", "unit of the angles"),
    "theta_i_deg": Entry("a number, or a list", "-", "angle of incidence, if the files do not state it"),
    "specular_phi_deg": Entry("a number", "-", "azimuth of the specular direction"),
    "cosine_weighted": Entry("`true` or `false`", "-", "the values are the BSDF times cos(theta_o)"),
    "every": Entry("an integer", "-", "every n-th angle of each axis only"),
    "columns": Entry("a table", "-", 'headers of columns that have other names: `{ theta_o_deg = "arm" }`'),
}
LIMITS = {
    "seconds": Quantity(
        "s",
        1.0,
        1e7,
        3600.0,
        meaning="longest time of one measurement, with all compilation; its process is ended then",
    ),
    "memory_gib": Quantity(
        "GiB",
        0.1,
        1e5,
        otherwise="the machine's, divided by the workers; unlimited with a scheduler of your own",
        meaning="most memory of the process of a worker; it is ended above it",
    ),
}
