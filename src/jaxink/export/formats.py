"""Catalogue of the formats, and the call that writes them."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.export.flat_csv import write_csv
from jaxink.export.guide import Guide, guide_to
from jaxink.export.integra import write_integra
from jaxink.export.lighttools import write_lighttools
from jaxink.export.limitations import (
    LOSSES,
    ExportOptions,
    Loss,
    LossRefusedError,
    expected_losses,
    losses_of,
)
from jaxink.export.mitsuba import write_mitsuba
from jaxink.export.preparation import regular_in_bins, writable
from jaxink.export.radiance import write_radiance
from jaxink.export.speos import write_speos
from jaxink.export.zemax import write_zemax
from jaxink.files.netcdf import netcdf_bytes
from jaxink.files.version import installed_version
from jaxink.files.writing import whole_folder
from jaxink.ink import ExpectedTable, InkTable


class Format(NamedTuple):
    """A file format.

    Parameters
    ----------
    title
        Name in messages.
    write
        Writes a table into a folder and returns the contents of each file, in words, by its name.
    lost
        Members of `LOSSES` that it cannot represent.
    use
        How to use the files in the program that reads them.
    missing
        What that program does with the power that a row lacks, as far as it is documented; see
        docs/manual/export.md for the sources.
    """

    title: str
    write: Callable[[InkTable, Path, ExportOptions], dict[str, str]]
    lost: tuple[str, ...] = ()
    use: str = ""
    missing: str = ""


class Export(NamedTuple):
    """Files of an export, sorted by name, and the guide to them."""

    files: list[Path]
    guide: Guide


def _write_netcdf(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    name = f"{options.name}.nc"
    (folder / name).write_bytes(netcdf_bytes(table.to_dataset()))
    return {name: "the table with all four components, for xarray and jaxink"}


_FORMATS = {
    "zemax": Format(
        "Zemax .bsdf",
        write_zemax,
        ("regular", "beyond_critical", "standard_errors"),
        "In OpticStudio, choose the scatter model BSDF for this face, with one file for reflection and one "
        "for transmission: R_II and T_IA for light from side I, R_AA and T_AI for light from side A. "
        "AngleOfIncidence in these files is the angle of the specular or refracted direction.",
        "OpticStudio: whether the missing power is lost or stays in the unscattered ray is not documented; "
        "the face's coating, not TIS, divides a ray into reflection and transmission. Trace a test ray.",
    ),
    "lighttools": Format(
        "LightTools .bsdf",
        write_lighttools,
        ("regular", "narrow_lobes", "standard_errors"),
        "In LightTools, Front is side A and Back is side I.",
        "LightTools: what happens to the missing power is not documented publicly. Trace a test ray.",
    ),
    "speos": Format(
        "Speos .anisotropicbsdf",
        write_speos,
        ("regular", "narrow_lobes", "standard_errors"),
        "In Speos, the two files of a wavelength are the two sides of one BSDF180; set both refractive "
        "indices in its peak interpolation.",
        "Speos: what happens to the missing power is not documented for this format. Trace a test ray.",
    ),
    "integra": Format(
        "Integra .ddr, .ddt, .sdr, .sdt",
        write_integra,
        ("standard_errors",),
        "In Lumicept, each side of the face takes its own files: R_II and T_IA for light from side I, R_AA "
        "and T_AI for light from side A; .sdr and .sdt are the regular light. sigma is the angle of "
        "incidence in the medium of its own side.",
        "Lumicept: what happens to the missing power is not documented publicly. Trace a test ray.",
    ),
    "radiance": Format(
        "Radiance XML",
        write_radiance,
        ("regular", "narrow_lobes", "index_step", "standard_errors"),
        "In Radiance, the front of the surface is side I; the XML format calls this side Back. Directions "
        "inside the plate are those in the plate, and no ray is refracted.",
        "Radiance: the missing power is absorbed; a ray has no other contribution than the table, unless the "
        "material is given diffuse components of its own.",
    ),
    "mitsuba": Format(
        "Mitsuba 3",
        write_mitsuba,
        ("narrow_lobes", "standard_errors"),
        "`python example_scene.py TABLE.nc picture.exr` renders an edge-lit plate with the indices of the "
        "table. In a scene of your own, the normal of the shape points from side I to side A.",
        "Mitsuba: the missing power is absorbed; a path goes on with the weight of what its row sends out. "
        "Total reflection is in the regular part of the table, unless the plug-in is told to ignore that.",
    ),
    "csv": Format(
        "CSV",
        write_csv,
        ("narrow_lobes",),
        "Every component has its own rows.",
        "The surface absorbs the missing power.",
    ),
    "netcdf": Format(
        "netCDF",
        _write_netcdf,
        use="`jaxink.read_ink_table` reads the table; `jaxink export` also takes it.",
        missing="The surface absorbs the missing power.",
    ),
}
FORMATS = tuple(_FORMATS)


def require_format(format: str) -> None:
    """Reject an unknown format."""
    require_one_of("format", format, FORMATS)


def refuse_expected(table: ExpectedTable, format: str, options: ExportOptions) -> None:
    """Reject an export that may lose something, before its table is computed.

    Raises
    ------
    LossRefusedError
        If the options do not allow what may be lost.
    """
    chosen = _FORMATS[format]
    _require_bins_fit(chosen, options)
    _refuse_losses(expected_losses(table, LOSSES), chosen, options)


def write(
    table: InkTable, format: str, directory: str | Path, options: ExportOptions | None = None
) -> list[Path]:
    """Write an ink table for a ray tracer.

    Parameters
    ----------
    table
        The table.
    format
        One of `FORMATS`.
    directory
        The folder, created if it does not exist; files of the same names are replaced, all of them or
        none.
    options
        Choices; None for the defaults.

    Returns
    -------
    list[Path]
        The files written, sorted by name; ``<name>_README.txt`` says what is in the others.

    Raises
    ------
    LossRefusedError
        If the format cannot represent the table, and the options do not allow the loss.
    InputRefusedError
        If the table is not a BSDF, or the folder cannot be written to.
    """
    require_format(format)
    return write_folder(table, format, directory, ExportOptions() if options is None else options).files


def write_folder(table: InkTable, format: str, directory: str | Path, options: ExportOptions) -> Export:
    """As `write`; also returns the guide to the files."""
    chosen = _FORMATS[format]
    table = writable(table)
    _require_bins_fit(chosen, options)
    found = losses_of(table, LOSSES)
    _refuse_losses(found, chosen, options)
    losses = [loss for loss in found if loss.name in chosen.lost]
    if options.regular_bin_deg is not None:
        table = regular_in_bins(table, options.regular_bin_deg)
        losses = [loss for loss in losses if loss.name != "regular"]
    table = _with_losses(table, losses)
    with whole_folder(directory) as folder:
        contents = chosen.write(table, folder, options)
        readme = f"{options.name}_README.txt"
        guide = guide_to(table, {**contents, readme: "this text"}, losses, chosen.use, chosen.missing)
        lines = [_headline(table, chosen), *guide.lines(), ""]
        (folder / readme).write_text("\n".join(lines), encoding="utf-8")
        names = sorted(file.name for file in folder.iterdir())
    return Export([Path(directory) / name for name in names], guide)


def _headline(table: InkTable, chosen: Format) -> str:
    """First line of the text beside the files."""
    wavelengths = ", ".join(f"{wavelength_nm:g}" for wavelength_nm in table.wavelength_nm)
    parts = [table.attrs.get("title"), f"BSDF at {wavelengths} nm, {chosen.title}"]
    known = [" ".join(str(part).split()) for part in parts if part]
    return f"{', '.join(known)}, written by jaxink {installed_version()}."


def _refuse_losses(found: Sequence[Loss], chosen: Format, options: ExportOptions) -> None:
    """Reject an export that would lose something that the options do not allow.

    ``found`` is what some format would lose of the table.
    """
    spread = ("regular",) if options.regular_bin_deg is not None else ()
    by_name = {loss.name: loss for loss in found}
    refused = [by_name[n] for n in chosen.lost if n in by_name and n not in (*options.drop, *spread)]
    if refused:
        able = [name for name, format in _FORMATS.items() if not by_name.keys() & set(format.lost)]
        raise LossRefusedError(chosen.title, refused, able)


def _require_bins_fit(chosen: Format, options: ExportOptions) -> None:
    if options.regular_bin_deg is not None and "regular" not in chosen.lost:
        raise InputRefusedError(
            f"{chosen.title} stores the regular part separately; leave out regular_bin_deg "
            "(--regular-bin-deg)."
        )


def _with_losses(table: InkTable, losses: list[Loss]) -> InkTable:
    """The table with what is lost among its attributes, which all files contain."""
    if not losses:
        return table
    attrs = table.attrs | {"lost": "; ".join(map(str, losses))}
    if any(loss.name == "standard_errors" for loss in losses):
        attrs.pop("standard_error", None)
    return dataclasses.replace(table, attrs=attrs)
