"""The command that predicts a measurement."""

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.session import ExitCode, installed_version
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.spreadsheet import cell
from jaxink.files.writing import require_file, written_whole
from jaxink.solver.accuracy import DEFAULT_ACCURACY

if TYPE_CHECKING:
    from jaxink import GonioData, Sample


def run_predict(
    source: Path,
    data_file: Path | None,
    out: Path,
    accuracy: float | None,
    columns: dict[str, Any],
    quiet: bool,
) -> ExitCode:
    """Predict every row of a measurement and write the prediction, rows that a fit leaves out being marked.

    Parameters
    ----------
    source
        Result folder, ``result.json`` or sample file.
    data_file
        The measurement; None: that of the result.
    out
        File to write, ``.csv`` or ``.nc``.
    accuracy
        Of the discretisation; None: the sizes of the result, or the default for a sample file.
    columns
        What the CSV file does not state.
    quiet
        Print nothing.
    """
    if out.suffix not in (".csv", ".nc"):
        raise InputRefusedError(
            f"{shown_path(out)}: the suffix '{out.suffix}' is not one of .csv, .nc, which name the format."
        )
    require_file(out)
    is_sample = source.suffix == ".toml" and not os.path.isdir(source)
    if is_sample and data_file is None:
        raise InputRefusedError(
            f"{source}: a sample file has no directions of its own; name a measurement after it, whose "
            "directions are then predicted."
        )
    sample = jaxink.load_sample(source) if is_sample else None
    given = None if data_file is None else jaxink.read(data_file, **columns)
    session.prepare_jax()
    config = None
    if sample is None:
        result = jaxink.load_result(source)
        sample, given = result.sample, result.data if given is None else given
        config = result.config if accuracy is None else None
    from jaxink.fitting import marked

    assert given is not None, "a sample file without a measurement was refused"
    data = marked(given, sample)
    predicted = jaxink.predict(sample, data, config, accuracy or DEFAULT_ACCURACY)
    _write_prediction(data, predicted, out)
    if not quiet:
        start = " with the start values of its free parameters" * (is_sample and bool(sample.parameters.free))
        measured = data.source or "the measurement"
        typer.echo(f"{len(data)} directions of {measured} predicted from {source}{start}.")
        for sentence in _remarks(data, sample):
            typer.echo(sentence)
        typer.echo(f"Written: {out}")
    return ExitCode.FITTED


def _remarks(data: "GonioData", sample: "Sample") -> list[str]:
    """What a fit of the sample would leave out of what was predicted."""
    from jaxink.measurement.masks import mask_sentences

    *masked, _ = mask_sentences(data.mask)
    named = sample.wavelengths_nm
    other = [w for w in sorted(set(data.wavelength_nm.tolist())) if all(abs(w - n) > 1e-6 for n in named)]
    if not (named and other):
        return masked
    wavelengths = ", ".join(f"{w:g}" for w in other)
    return [
        *masked,
        f"The sample file does not name {wavelengths} nm: predicted there with the same parameters.",
    ]


def _write_prediction(data: "GonioData", predicted, out: Path) -> None:
    """The measurement with the prediction in the place of its values, which become a column of their own.

    Another column says why a row is masked; netCDF files have a variable for that.
    """
    extra = {**data.extra, "measured_per_sr": data.bsdf_per_sr}
    attrs = {**data.attrs, "bsdf_per_sr": f"predicted by jaxink {installed_version()}"}
    prediction = data.replace(bsdf_per_sr=predicted, sigma_per_sr=None, extra=extra, attrs=attrs)
    if out.suffix == ".nc":
        prediction.to_netcdf(out)
        return
    import numpy as np

    from jaxink.measurement.masks import mask_names

    extra["masked"] = np.array(mask_names(data.mask))
    names = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr")
    columns = [getattr(prediction, name).tolist() for name in names]
    # A blank cell where a kept column has no number, as in the file that was read.
    columns += [["" if v != v else cell(v) for v in values.tolist()] for values in extra.values()]
    with written_whole(out) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, *map(cell, extra)])
        writer.writerows(zip(*columns, strict=True))
