"""``jaxink predict``."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.spreadsheet import cell
from jaxink.files.version import installed_version
from jaxink.files.writing import require_file, written_whole
from jaxink.solver.accuracy import DEFAULT_ACCURACY

if TYPE_CHECKING:
    from jaxink import GonioData, Sample

# Incidences that differ by less are the same.
_SAME_DEG = 0.5


def run_predict(
    source: Path,
    data_files: Sequence[Path],
    out: Path,
    accuracy: float | None,
    columns: dict[str, Any],
    quiet: bool,
    settings: Sequence[str] = (),
) -> ExitCode:
    """Predict every row of a measurement and write the prediction, with masked rows marked.

    Without ``data_files`` the measurement of the result is predicted; without ``accuracy`` the resolution is
    that of the result. ``columns`` are keywords of `jaxink.read`, ``settings`` values of parameters such as
    ``ink.thickness_um=60``.
    """
    if out.suffix not in (".csv", ".nc"):
        raise InputRefusedError(
            f"{shown_path(out)}: the suffix '{out.suffix}' names no format; it must be .csv or .nc."
        )
    require_file(out)
    is_sample = source.suffix == ".toml" and not os.path.isdir(source)
    if is_sample and not data_files:
        raise InputRefusedError(
            f"{source}: a sample file has no directions; give a measurement after it, whose rows are then "
            "predicted."
        )
    sample = jaxink.load_sample(source) if is_sample else None
    given = jaxink.read(data_files, **columns) if data_files else None
    session.prepare_jax()
    config, fitted = None, None
    if sample is None:
        result = jaxink.load_result(source)
        sample, fitted = result.sample, result.data
        given = fitted if given is None else given
        config = result.config if accuracy is None else None
    from jaxink.fitting import marked
    from jaxink.sample.replacing import assigned

    changes = assigned(sample.parameters, list(settings))
    sample = sample.replace(changes)

    assert given is not None, "a sample file without a measurement is rejected above"
    data = marked(given, sample)
    predicted = jaxink.predict(sample, data, config, accuracy or DEFAULT_ACCURACY)
    _write_prediction(data, predicted, out)
    if not quiet:
        start = " with the start values of its free parameters" * (is_sample and bool(sample.parameters.free))
        measured = data.source or "the measurement"
        lines = [f"{len(data)} directions of {measured} predicted from {source}{start}."]
        if changes:
            shown = (f"{n} = {v:g} {sample.parameters[n].unit}".rstrip() for n, v in changes.items())
            lines.append(f"Set: {', '.join(shown)}.")
        typer.echo("\n".join([*lines, *_remarks(data, sample), f"Written: {out}"]))
        for warning in [] if fitted is None else other_conditions(data, fitted):
            typer.echo(f"Warning: {warning}", err=True)
    return ExitCode.FITTED


def other_conditions(data: "GonioData", fitted: "GonioData") -> list[str]:
    """In what a measurement differs from the one that was fitted: sides, wavelengths, incidences."""
    used, lines = fitted.used, []
    sides = [{"R": "reflection", "T": "transmission"}[side] for side in _sides(data) - _sides(fitted, used)]
    if sides:
        lines.append(f"the fit had no points in {sides[0]}, which is predicted nevertheless.")
    waves = sorted(set(fitted.wavelength_nm[used].tolist()))
    other = [w for w in sorted(set(data.wavelength_nm.tolist())) if all(abs(w - n) > 1e-6 for n in waves)]
    if other:
        had = f"{waves[0]:g}" if len(waves) == 1 else f"{len(waves)} from {waves[0]:g} to {waves[-1]:g}"
        lines.append(
            f"{', '.join(f'{w:g}' for w in other)} nm was not fitted (the fit had {had} nm); values that "
            "change with the wavelength are not those of it."
        )
    low, high = fitted.theta_i_deg[used].min(), fitted.theta_i_deg[used].max()
    beyond = sorted({t for t in data.theta_i_deg.tolist() if not low - _SAME_DEG <= t <= high + _SAME_DEG})
    if beyond:
        lines.append(
            f"incidence at {', '.join(f'{t:g}' for t in beyond)} degrees is outside the fitted "
            f"{low:g} to {high:g} degrees."
        )
    return lines


def _sides(data: "GonioData", used: Any = slice(None)) -> set[str]:
    return {"T" if is_transmission else "R" for is_transmission in data.is_transmission[used].tolist()}


def _remarks(data: "GonioData", sample: "Sample") -> list[str]:
    """Sentences on masked rows and on wavelengths that the sample file does not name."""
    from jaxink.measurement.masks import mask_sentences

    *masked, _ = mask_sentences(data.mask)
    named = sample.wavelengths_nm
    other = [w for w in sorted(set(data.wavelength_nm.tolist())) if all(abs(w - n) > 1e-6 for n in named)]
    if not (named and other):
        return masked
    wavelengths = ", ".join(f"{w:g}" for w in other)
    return [
        *masked,
        f"The sample file does not name {wavelengths} nm; the prediction there uses the same parameters.",
    ]


def _write_prediction(data: "GonioData", predicted, out: Path) -> None:
    """Write the measurement with predicted values; the measured ones and the masks are columns beside them.

    netCDF files have a variable for the masks instead.
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
    # Blank cells remain blank.
    columns += [["" if v != v else cell(v) for v in values.tolist()] for values in extra.values()]
    with written_whole(out) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, *map(cell, extra)])
        writer.writerows(zip(*columns, strict=True))
