"""``jaxink predict``."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.one_measurement import is_described
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.spreadsheet import cell
from jaxink.files.version import installed_version
from jaxink.files.writing import require_file, written_whole
from jaxink.solver import DEFAULT_ACCURACY

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
    is_sample = is_described(source)
    if is_sample and not data_files:
        raise InputRefusedError(
            f"{source}: a sample file has no directions; give a measurement after it, whose rows are then "
            "predicted."
        )
    sample = jaxink.load_sample(source) if is_sample else None
    given = jaxink.read(data_files, **columns, needs_values=False) if data_files else None
    session.prepare_jax()
    config, fitted = None, None
    if sample is None:
        result = jaxink.load_result(source)
        sample, fitted = result.sample, result.data
        given = fitted if given is None else given
        config = result.config if accuracy is None else None
    from jaxink.fitting import marked, unknown_nm
    from jaxink.sample import assigned

    changes = assigned(sample.parameters, list(settings))
    sample = sample.replace(changes)

    assert given is not None, "a sample file without a measurement is rejected above"
    data = marked(given, sample)
    unknown = unknown_nm(sample, data)
    if unknown and out.suffix == ".nc":
        raise InputRefusedError(
            f"{shown_path(out)}: the sample has no values of its per-wavelength parameters at "
            f"{_listed(unknown)} nm, and a .nc file has no blank predictions; write a .csv file."
        )
    predicted = jaxink.predict(sample, data, config, accuracy or DEFAULT_ACCURACY)
    write_prediction(data, predicted, unknown, out)
    if not quiet:
        start = " with the values that it states for its free parameters" * (
            is_sample and bool(sample.parameters.free)
        )
        measured = data.source or "the measurement"
        n_predicted = int((predicted == predicted).sum())
        lines = [f"{n_predicted} directions of {measured} predicted from {source}{start}."]
        if changes:
            shown = (f"{n} = {v:g} {sample.parameters[n].unit}".rstrip() for n, v in changes.items())
            lines.append(f"Set: {', '.join(shown)}.")
        typer.echo("\n".join([*lines, *_remarks(data, sample, unknown), f"Written: {out}"]))
        warnings = [] if fitted is None else other_conditions(data, fitted, unknown)
        if unknown:
            warnings.insert(
                0,
                f"{len(data) - n_predicted} rows at {_listed(unknown)} nm are blank: parameters that change "
                "with the wavelength have no value there.",
            )
        for warning in warnings:
            typer.echo(f"Warning: {warning}", err=True)
    return ExitCode.FITTED


def _listed(wavelengths_nm: Sequence[float]) -> str:
    return ", ".join(f"{wave:g}" for wave in wavelengths_nm)


def other_conditions(data: "GonioData", fitted: "GonioData", unknown_nm: Sequence[float] = ()) -> list[str]:
    """In what a measurement differs from the one that was fitted: sides, wavelengths, incidences.

    Wavelengths ``unknown_nm``, which are not predicted, do not count.
    """
    used, lines = fitted.used, []
    sides = [{"R": "reflection", "T": "transmission"}[side] for side in _sides(data) - _sides(fitted, used)]
    if sides:
        lines.append(f"the fit had no points in {sides[0]}, which is predicted nevertheless.")
    waves = sorted(set(fitted.wavelength_nm[used].tolist()))
    other = _not_among(data, [*waves, *unknown_nm])
    if other:
        had = f"{waves[0]:g}" if len(waves) == 1 else f"{len(waves)} from {waves[0]:g} to {waves[-1]:g}"
        lines.append(
            f"{_listed(other)} nm was not fitted (the fit had {had} nm); parameters that follow no formula "
            "of the wavelength are taken as they are."
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


def _not_among(data: "GonioData", known_nm: Sequence[float]) -> list[float]:
    held = sorted(set(data.wavelength_nm.tolist()))
    return [wave for wave in held if all(abs(wave - known) > 1e-6 for known in known_nm)]


def _remarks(data: "GonioData", sample: "Sample", unknown_nm: Sequence[float]) -> list[str]:
    """Sentences on masked rows and on wavelengths that the sample file does not name."""
    from jaxink.measurement import mask_sentences

    *masked, _ = mask_sentences(data.mask)
    named = sample.wavelengths_nm
    other = _not_among(data, [*named, *unknown_nm])
    if not (named and other):
        return masked
    return [
        *masked,
        f"The sample file does not name {_listed(other)} nm; the prediction there uses the same parameters.",
    ]


def write_prediction(data: "GonioData", predicted, unknown_nm: Sequence[float], out: Path) -> None:
    """Write the measurement with predicted values; the measured ones and the masks are columns beside them.

    netCDF files have a variable for the masks instead. Rows at the wavelengths ``unknown_nm`` have no
    prediction; a column says why.
    """
    import numpy as np

    # No reader lets a measurement pass that is 0 everywhere: such a file has directions only.
    has_values = np.bincount(data.file_index, weights=data.bsdf_per_sr != 0) > 0
    extra = dict(data.extra)
    if has_values.any():
        extra["measured_per_sr"] = np.where(has_values[data.file_index], data.bsdf_per_sr, np.nan)
    if out.suffix == ".nc":
        attrs = {**data.attrs, "bsdf_per_sr": f"predicted by jaxink {installed_version()}"}
        data.replace(bsdf_per_sr=predicted, sigma_per_sr=None, extra=extra, attrs=attrs).to_netcdf(out)
        return
    from jaxink.measurement import mask_names

    extra["masked"] = np.array(mask_names(data.mask))
    if unknown_nm:
        blank = np.isin(data.wavelength_nm, unknown_nm)
        extra["not_predicted"] = np.where(blank, "no parameter values at this wavelength", "")
    names = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side")
    columns = [getattr(data, name).tolist() for name in names]
    # Blank cells remain blank.
    columns.append(["" if v != v else v for v in predicted.tolist()])
    columns += [["" if v != v else cell(v) for v in values.tolist()] for values in extra.values()]
    with written_whole(out) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, "bsdf_per_sr", *map(cell, extra)])
        writer.writerows(zip(*columns, strict=True))
