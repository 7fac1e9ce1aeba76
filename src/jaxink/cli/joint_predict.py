"""``jaxink predict`` for every measurement of a joint fit or of a project file."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.one_measurement import is_described
from jaxink.cli.predict import write_prediction
from jaxink.cli.session import ExitCode
from jaxink.display.brief import counted
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.spreadsheet import cell
from jaxink.files.writing import require_folder, whole_folder, written_whole
from jaxink.measurement import GonioData, Readings
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig

# What was measured, of which sample, and at which resolution to predict it; None: at the accuracy asked for.
_Wanted = tuple[GonioData | Readings, Sample, SolverConfig | None]


def run_joint_predict(
    source: Path, out: Path, accuracy: float | None, settings: Sequence[str], quiet: bool
) -> ExitCode:
    """Predict every measurement and write a CSV file for each; parameters as for `run_predict`.

    Parameters
    ----------
    source
        Folder of a joint fit, or a project file, whose start values are then used.
    out
        Folder of the files.
    accuracy, settings, quiet
        As for `run_predict`; there may be no settings.
    """
    is_project = is_described(source)
    if settings:
        remedy = (
            "write it in the project file, among the changes of the measurement"
            if is_project
            else "add --measurement NAME"
        )
        raise InputRefusedError(
            f"--set {settings[0]}: a value is set in the sample of one measurement; {remedy}."
        )
    if out.suffix in (".csv", ".nc"):
        other = "" if is_project else ", or add --measurement NAME"
        raise InputRefusedError(
            f"{shown_path(out)}: names one file, but all measurements of {shown_path(source)} are predicted; "
            f"give a folder{other}."
        )
    require_folder(out)
    wanted = _of_project(source) if is_project else _of_result(source, accuracy)
    with whole_folder(out) as folder:
        for name, (data, sample, config) in wanted.items():
            file = folder / f"{name}.csv"
            if isinstance(data, Readings):
                _write_readings(data, sample, config, accuracy, file)
            else:
                _write_bsdf(data, sample, config, accuracy, file)
    if not quiet:
        start = " with the values that it states for its free parameters" * is_project
        lines = [f"{counted(len(wanted), 'measurement')} of {source} predicted{start}."]
        typer.echo("\n".join([*lines, *(f"Written: {out / name}.csv" for name in wanted)]))
    return ExitCode.FITTED


def _of_project(source: Path) -> dict[str, _Wanted]:
    project = jaxink.load_project(source)
    session.prepare_jax()
    return {one.name: (one.data, one.sample, None) for one in project.measurements}


def _of_result(source: Path, accuracy: float | None) -> dict[str, _Wanted]:
    session.prepare_jax()
    result = jaxink.load_joint_result(source)
    return {
        name: (one.data, one.sample, one.config if accuracy is None else None)
        for name, one in result.measurements.items()
    }


def _write_bsdf(
    data: GonioData, sample: Sample, config: SolverConfig | None, accuracy: float | None, file: Path
) -> None:
    from jaxink.fitting import marked, unknown_nm

    data = marked(data, sample)
    predicted = jaxink.predict(sample, data, config, accuracy or DEFAULT_ACCURACY)
    write_prediction(data, predicted, unknown_nm(sample, data), file)


def _write_readings(
    data: Readings, sample: Sample, config: SolverConfig | None, accuracy: float | None, file: Path
) -> None:
    """Write the readings with their predicted values beside the measured ones."""
    predicted = jaxink.predict(sample, data, config, accuracy or DEFAULT_ACCURACY)
    columns = {
        "quantity": data.quantity.tolist(),
        "theta_i_deg": data.theta_i_deg.tolist(),
        "theta_o_deg": data.theta_o_deg.tolist(),
        "phi_deg": data.phi_deg.tolist(),
        "wavelength_nm": data.wavelength_nm.tolist(),
        "value": predicted.tolist(),
        "measured": data.value.tolist(),
    }
    with written_whole(file) as part, part.open("w", encoding="utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow("" if isinstance(v, float) and math.isnan(v) else cell(v) for v in row)
