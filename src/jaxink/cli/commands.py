"""What the commands do; JAX, xarray and matplotlib are imported when it is their turn."""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jaxink
from jaxink.cli.folder import require_folder, require_writable_file
from jaxink.cli.session import EXIT_FITTED, EXIT_NOT_CONVERGED, installed_version, prepare_jax, progress
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text
from jaxink.files.spreadsheet import cell
from jaxink.files.writing import whole_folder, written_whole
from jaxink.solver.accuracy import DEFAULT_ACCURACY

if TYPE_CHECKING:
    from jaxink import FitResult, GonioData, Sample

FIGURES = "figures"
SIMPLEX = "simplex"
# What would belong to an older result if it were not written anew.
OWNED = (FIGURES, SIMPLEX)


def run_fit(
    data_file: Path,
    sample_file: Path,
    out: Path,
    options: dict[str, Any],
    columns: dict[str, Any],
    formats: Sequence[str],
    output: str,
) -> int:
    """Fit a measurement and write the result.

    Parameters
    ----------
    data_file, sample_file
        Inputs.
    out
        Folder for the result.
    options
        Fields of `FitOptions`.
    columns
        What the CSV file does not state, as `read_csv` takes it.
    formats
        File formats of the figures.
    output
        ``tables``, ``json`` or ``quiet``.

    Returns
    -------
    int
        Exit code.
    """
    require_folder(out, OWNED)
    data, sample = read_data(data_file, columns), jaxink.load_sample(sample_file)
    prepare_jax()
    chosen = jaxink.FitOptions(**options)
    with progress(quiet=output != "tables") as follow:
        result = jaxink.fit(data, sample, chosen, follow)
    files = _write(result, out, formats)
    if output == "json":
        written = {**result.to_dict(), "files": [str(file) for file in files]}
        _echo(json_text(written))
    elif output == "tables":
        from jaxink.cli.tables import console, show_result

        show_result(console(), result, files)
    return EXIT_FITTED if result.converged else EXIT_NOT_CONVERGED


def run_predict(
    source: Path,
    data_file: Path | None,
    out: Path,
    accuracy: float | None,
    columns: dict[str, Any],
    quiet: bool,
) -> int:
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

    Returns
    -------
    int
        Exit code.
    """
    require_writable_file(out, (".csv", ".nc"))
    is_sample = source.suffix == ".toml" and not os.path.isdir(source)
    if is_sample and data_file is None:
        raise InputRefusedError(
            f"{source}: a sample file has no directions of its own; name a measurement after it, whose "
            "directions are then predicted."
        )
    sample = jaxink.load_sample(source) if is_sample else None
    data = read_data(data_file, columns) if data_file is not None else None
    prepare_jax()
    config = None
    if sample is None:
        result = jaxink.load_result(source)
        sample, data = result.sample, result.data if data is None else data
        config = jaxink.SolverConfig(**result.solver) if accuracy is None else None
    from jaxink.fitting import marked

    data = marked(data, sample)
    predicted = jaxink.predict(sample, data, config, accuracy or DEFAULT_ACCURACY)
    _write_prediction(data, predicted, out)
    if not quiet:
        start = (
            " with the start values of its free parameters" if is_sample and sample.parameters.free else ""
        )
        _echo(f"{len(data)} directions of {data.source or 'the measurement'} predicted from {source}{start}.")
        for sentence in _remarks(data, sample):
            _echo(sentence)
        _echo(f"Written: {out}")
    return EXIT_FITTED


def _remarks(data: "GonioData", sample: "Sample") -> list[str]:
    """What a fit of the sample would leave out of what was predicted."""
    from jaxink.measurement.masks import mask_sentences

    *masked, _ = mask_sentences(data)
    named = sample.wavelengths_nm
    other = [w for w in sorted(set(data.wavelength_nm.tolist())) if all(abs(w - n) > 1e-6 for n in named)]
    if not (named and other):
        return masked
    wavelengths = ", ".join(f"{w:g}" for w in other)
    return [
        *masked,
        f"The sample file does not name {wavelengths} nm: predicted there with the same parameters.",
    ]


def run_demo(out: Path, formats: Sequence[str], quiet: bool) -> int:
    """Fit the embedded simulated measurement by gradient and by simplex.

    Parameters
    ----------
    out
        Folder for inputs and results.
    formats
        File formats of the figures.
    quiet
        Print nothing.

    Returns
    -------
    int
        Exit code.
    """
    from jaxink.data import simulated_example

    require_folder(out, OWNED)
    inputs = simulated_example()
    data, sample = jaxink.read(inputs[0]), jaxink.load_sample(inputs[1])
    prepare_jax()
    with progress(quiet) as follow:
        gradient, simplex = (
            jaxink.fit(data, sample, jaxink.FitOptions(method=method), follow)
            for method in ("gradient", "simplex")
        )
    files = _write(gradient, out, formats, inputs, simplex)
    if not quiet:
        from jaxink.cli.comparison import show_demo

        show_demo(gradient, simplex, files)
    return EXIT_FITTED if gradient.converged and simplex.converged else EXIT_NOT_CONVERGED


def read_data(path: Path, columns: dict[str, Any]) -> "GonioData":
    """Read a measurement, with what its CSV file does not state."""
    return jaxink.read(path, **{name: value for name, value in columns.items() if value is not None})


def _write(
    result: "FitResult",
    out: Path,
    formats: Sequence[str],
    inputs: Sequence[Path] = (),
    simplex: "FitResult | None" = None,
) -> list[Path]:
    """Write a result, its figures and what goes with it; all or nothing."""
    with whole_folder(out, owned=OWNED) as folder:
        result.write_into(folder)
        if simplex is not None:
            (folder / SIMPLEX).mkdir()
            simplex.write_into(folder / SIMPLEX)
        for file in inputs:
            shutil.copyfile(file, folder / file.name)
        if formats:
            from jaxink.plots import save_figures

            save_figures(result, folder / FIGURES, formats)
        return [out / file.relative_to(folder) for file in sorted(folder.rglob("*")) if file.is_file()]


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
    import csv

    import numpy as np

    from jaxink.measurement.masks import mask_names

    extra["masked"] = np.array(mask_names(data))
    names = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr")
    columns = [getattr(prediction, name).tolist() for name in names]
    # A blank cell where a kept column has no number, as in the file that was read.
    columns += [["" if v != v else cell(v) for v in values.tolist()] for values in extra.values()]
    try:
        with written_whole(out) as part, part.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([*names, *map(cell, extra)])
            writer.writerows(zip(*columns, strict=True))
    except OSError as problem:
        raise InputRefusedError(f"{out}: cannot be written ({problem.strerror or problem}).") from None


def _echo(text: str) -> None:
    import typer

    typer.echo(text)
