"""``jaxink init --project``."""

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.cli.init import drafted, require_new, show, stated_fields
from jaxink.cli.session import CommandLine, ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.writing import written_whole
from jaxink.measurement import THICKNESS, is_number
from jaxink.projects import conditions_in, first_measurements, parse_project, project_text
from jaxink.sample import draft_text

_SAMPLE = "sample.toml"


def run_init_project(
    data_files: Sequence[Path],
    out: Path,
    given: dict[str, str | None],
    columns: dict[str, Any],
    options: Sequence[str],
    force: bool,
    quiet: bool,
) -> ExitCode:
    """Write a first project of several measurements, and the sample file that they share.

    Arguments as for `jaxink.cli.init.run_init`; the sample file is drafted from the first measurement.
    """
    folder = out.parent
    sample_file = folder / _SAMPLE
    if out.name.lower() == _SAMPLE:
        raise InputRefusedError(
            f"{shown_path(out)}: is the name of the common sample file; give the project another, such as "
            "project.toml."
        )
    require_new(out, force)
    require_new(sample_file, force, "write the project into another folder, such as --out ink/project.toml")
    if "rows" in columns:
        raise InputRefusedError("--rows chooses one condition, but a project takes all; leave it out.")
    tables = first_measurements(data_files, folder, columns)
    bsdfs = [i for i, table in enumerate(tables) if "data" in table]
    if not bsdfs:
        raise InputRefusedError(
            "all files are readings; jaxink init drafts a sample from a BSDF, so write the sample file by "
            "hand (docs/manual/sample-file.md)."
        )
    base = tables[bsdfs[0]]
    stated = stated_fields(given)
    first = next((values for values, _ in conditions_in(base, folder)), {})
    if THICKNESS in first and first[THICKNESS].column.unit == "um" and is_number(first[THICKNESS].cell):
        stated.setdefault("ink_um", float(first[THICKNESS].cell))
    rows = {name: value.cell for name, value in first.items() if value.divides}
    reading = base.get("reading", {})
    data = jaxink.read(data_files[bsdfs[0]], **reading, **({"rows": rows} if rows else {}))
    held = {"--out": out, "--project": True, "--force": force, "--wavelengths": given["wavelengths_nm"]}
    command = CommandLine("init", data_files, held)
    draft, assumed = drafted(data, stated, None if quiet else command, options)
    text = draft_text(data, draft, assumed)
    sample = jaxink.parse_sample(text, shown_path(sample_file), folder)
    layers = [layer.name for layer in sample.layers]
    with written_whole(sample_file) as part, written_whole(out) as project_part:
        part.write_text(text, encoding="utf-8")
        # What is written can be read, or the reason is said.
        staged = Path(os.path.relpath(part, folder)).as_posix()
        project = parse_project(project_text(tables, folder, staged, layers), shown_path(out), folder)
        project_part.write_text(project_text(tables, folder, _SAMPLE, layers), encoding="utf-8")
    if not quiet:
        show(data, sample, draft, assumed, sample_file)
        names = ", ".join(one.name for one in project.measurements)
        typer.echo(f"Written {out}: {len(project)} measurements ({names}), of which {sample_file} is common.")
        typer.echo(f"Next: {shlex.join(['jaxink', 'fit', str(out), '--out', 'result'])}")
    return ExitCode.FITTED
