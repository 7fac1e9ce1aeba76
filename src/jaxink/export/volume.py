"""Files that describe the ink as a volume: media of Mitsuba 3 and Speos, and sheets of values."""

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.special import roots_legendre

from jaxink.export.medium import Medium, ShortForm, short_forms
from jaxink.export.speos_material import write_speos_material
from jaxink.export.text import row, write_lines
from jaxink.files.version import installed_version
from jaxink.files.writing import whole_folder

# Points of a table in the cosine, doubled until the mean cosine of the linear interpolation is this accurate.
_FEWEST_POINTS, _MOST_POINTS, _ACCURATE = 513, 32769, 1e-4
_ANGLES_DEG = np.concatenate([np.arange(0.0, 10.0, 0.25), np.arange(10.0, 180.1, 1.0)])
# How the dialogue of each program takes the values; none of these programs was available.
DIALOGUES = {
    "zemax": "OpticStudio, volume physics: the model of Henyey and Greenstein takes a mean path in lens "
    "units (give mean_free_path_mm), the share that survives a meeting (albedo) and g. If absorption is in "
    "the material instead, give 1 / scattering_per_mm as the mean path and 1 as the share.",
    "lighttools": "LightTools, volume scattering of a material: mean free path in mm or scattering "
    "coefficient in 1/mm with g, or a user-defined angular distribution from the table. Absorption is given "
    "in the material.",
    "tracepro": "TracePro, bulk scatter property: scattering coefficient in 1/mm and anisotropy g, or alpha "
    "and g of the Gegenbauer kernel. Absorption in 1/mm belongs to the material property.",
    "fred": "FRED, volume scatter of a material: scattering and absorption coefficient in 1/mm (with system "
    "units of mm) and g.",
    "asap": "ASAP, volume model of a medium: coefficients in 1/system unit and g.",
    "speos": "Speos, volume optical properties of a body: the .material file, or in the material editor "
    "absorption and diffusion in 1/mm with the phase function.",
}
VOLUME_FORMATS = ("mitsuba", *DIALOGUES, "csv")


def write_volume(
    medium: Medium, format: str, directory: str | Path, name: str = "ink", on_dots: str | None = None
) -> list[Path]:
    """Write the ink as a volume.

    Parameters
    ----------
    medium
        From `medium_of`.
    format
        One of `VOLUME_FORMATS`.
    directory
        Folder, created if it does not exist; files of the same names are replaced, all of them or none.
    name
        Prefix of the file names.
    on_dots
        From `remark_on_dots`.

    Returns
    -------
    list[Path]
        The files, sorted by name.
    """
    with whole_folder(directory) as folder:
        forms = [short_forms(medium, w) for w in range(len(medium.wavelength_nm))]
        write_lines(folder / f"{name}_volume.txt", _sheet(medium, forms, format, on_dots))
        _write_values(medium, forms, folder / f"{name}_volume.csv")
        _write_phase(medium, folder / f"{name}_phase.csv")
        if format == "mitsuba":
            for w, wavelength in enumerate(medium.wavelength_nm):
                tree = ElementTree.ElementTree(_scene(medium, w))
                ElementTree.indent(tree)
                tree.write(folder / f"{name}_{wavelength:.10g}nm_medium.xml", encoding="utf-8")
        elif format == "speos":
            write_speos_material(medium, folder / f"{name}.material")
        names = sorted(file.name for file in folder.iterdir())
    return [Path(directory) / one for one in names]


def even_table(phase: Callable) -> tuple[np.ndarray, np.ndarray]:
    """Equally spaced cosines from -1 to 1, and a phase function there with mean 1 if it is linear between."""
    node, weight = roots_legendre(4000)
    exact = np.sum(weight * node * phase(node)) / 2
    n = _FEWEST_POINTS
    while True:
        cosine = np.linspace(-1.0, 1.0, n)
        value = np.maximum(phase(cosine), 0.0)
        value /= np.trapezoid(value, cosine) / 2
        # Mean of the cosine, exact for linear pieces.
        step = cosine[1] - cosine[0]
        first, last = value[:-1], value[1:]
        mean = np.sum(step * (first + last) / 2 * cosine[:-1] + step**2 * (first / 6 + last / 3)) / 2
        if abs(mean - exact) < _ACCURATE or n >= _MOST_POINTS:
            return cosine, value
        n = 2 * n - 1


def _scene(medium: Medium, w: int) -> ElementTree.Element:
    """A scene file of one medium, to be included in another; lengths are mm."""
    scene = ElementTree.Element("scene", version="3.0.0")
    scene.append(ElementTree.Comment("\n".join(["", *_interfaces(medium, w), ""])))
    inner = ElementTree.SubElement(scene, "medium", type="homogeneous", id=medium.name)
    for key, value in (
        ("sigma_t", medium.extinction_per_mm[w]),
        ("albedo", medium.scattering_per_mm[w] / max(medium.extinction_per_mm[w], 1e-300)),
    ):
        ElementTree.SubElement(inner, "spectrum", name=key, value=f"{value:.9g}")
    ElementTree.SubElement(inner, "float", name="scale", value="1")
    phase = ElementTree.SubElement(inner, "phase", type="tabphase")
    values = even_table(medium.phase[w])[1] / (4 * np.pi)
    ElementTree.SubElement(phase, "string", name="values", value=row(values, ", "))
    return scene


def _interfaces(medium: Medium, w: int) -> list[str]:
    """What stands beside the volume, so that nothing is modelled twice."""
    inside, outside = medium.indices[:, w]
    rough = f"rough: {medium.faces}" if medium.faces else "smooth"
    return [
        f"{medium.name}, {medium.wavelength_nm[w]:.10g} nm, by jaxink {installed_version()}; lengths in mm",
        f"refractive index of the medium: {medium.refractive_index[w]:.9g}",
        f"thickness: {medium.thickness_um / 1000:.9g} mm",
        f"side I: {medium.media[0]}, refractive index {inside:.9g}; side A: {medium.media[1]}, refractive "
        f"index {outside:.9g}",
        f"the volume holds scattering and absorption only; its faces ({rough}) are refracting bodies of the "
        "scene and must be modelled there, once",
        "do not add a surface BSDF of the same ink: that contains this volume and its faces",
    ]


def _sheet(medium: Medium, forms: list[list[ShortForm]], format: str, on_dots: str | None) -> list[str]:
    lines = [f"Volume scattering of '{medium.name}', by jaxink {installed_version()}.", ""]
    if format in DIALOGUES:
        lines += [
            DIALOGUES[format],
            "(Not tried in the program: enter one wavelength and trace a test ray.)",
            "",
        ]
    lines += [
        "Coefficients are natural (base e) per mm of path. The phase function has mean 1 over the sphere; "
        "divide by 4 pi for 1/sr. g is the mean cosine of the scattering angle, 0 degrees straight on.",
        "Gegenbauer kernel: p = K (1 + g^2 - 2 g cos)^-(alpha + 1); its g is not the mean cosine.",
        "Error of a short form: largest difference of hemispherical R and T at 0, 30, 60 degrees, in per "
        "cent of the incident power, and rms of the relative difference of the BSDF up to 75 degrees, of the "
        "layer with smooth faces between its media, against the fitted phase function (the table).",
    ]
    if on_dots is not None:
        lines.append(f"Printed dots: {on_dots}")
    for w, of_wavelength in enumerate(forms):
        extinction = medium.extinction_per_mm[w]
        lines += ["", *_interfaces(medium, w)]
        lines += [
            f"scattering {medium.scattering_per_mm[w]:.6g} /mm, absorption "
            f"{medium.absorption_per_mm[w]:.6g} /mm, albedo "
            f"{medium.scattering_per_mm[w] / max(extinction, 1e-300):.8g}, mean free path "
            f"{1 / max(extinction, 1e-300):.6g} mm, g {medium.asymmetry[w]:.6g}"
        ]
        for form in of_wavelength:
            numbers = ", ".join(f"{key} {value:.6g}" for key, value in form.numbers.items())
            lines.append(
                f"  {form.kind}: {numbers}; error R {100 * form.reflectance:.3g} %, T "
                f"{100 * form.transmittance:.3g} %, BSDF {100 * form.bsdf_rms:.3g} % rms"
            )
    return lines


def _write_values(medium: Medium, forms: list[list[ShortForm]], path: Path) -> None:
    heads = ["wavelength_nm", "refractive_index", "scattering_per_mm", "absorption_per_mm", "albedo"]
    heads += ["mean_free_path_mm", "g", "thickness_mm", "index_inside", "index_outside"]
    for form in forms[0]:
        heads += [f"{form.kind}.{key}" for key in form.numbers]
        heads += [f"{form.kind}.{key}" for key in ("error_R", "error_T", "error_bsdf_rms")]
    lines = [",".join(heads)]
    for w, of_wavelength in enumerate(forms):
        extinction = max(medium.extinction_per_mm[w], 1e-300)
        values = [medium.wavelength_nm[w], medium.refractive_index[w], medium.scattering_per_mm[w]]
        values += [medium.absorption_per_mm[w], medium.scattering_per_mm[w] / extinction, 1 / extinction]
        values += [medium.asymmetry[w], medium.thickness_um / 1000, *medium.indices[:, w]]
        for form in of_wavelength:
            values += [*form.numbers.values(), form.reflectance, form.transmittance, form.bsdf_rms]
        lines.append(row(values, ","))
    write_lines(path, lines)


def _write_phase(medium: Medium, path: Path) -> None:
    cosines = np.cos(np.deg2rad(_ANGLES_DEG))
    columns = [phase(cosines) for phase in medium.phase]
    heads = ["scattering_angle_deg", *(f"phase_{w:.10g}nm" for w in medium.wavelength_nm)]
    write_lines(
        path, [",".join(heads), *(row(line, ",") for line in zip(_ANGLES_DEG, *columns, strict=True))]
    )
