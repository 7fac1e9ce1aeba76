"""The ink of a result or of a sample, as a renderer takes it: a table, and a medium."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.export import Medium, medium_of
from jaxink.fitting import FitResult, load_result
from jaxink.ink import InkLayers, InkTable, TableOptions, find_ink, ink_table
from jaxink.numerics.fingerprint import fingerprint
from jaxink.sample import Sample, load_sample

# Interpolation of a narrow peak; a rendering needs no more.
ACCURACY = 1e-3


@dataclasses.dataclass(frozen=True, eq=False)
class RenderedInk:
    """An ink between its plate (side I) and the other side (A).

    Parameters
    ----------
    name
        Where it comes from, for people.
    table
        Its BSDF.
    medium
        The same as a volume; None if it is not one layer with smooth faces.
    why_no_volume
        Why there is no medium.
    """

    name: str
    table: InkTable
    medium: Medium | None
    why_no_volume: str = ""

    @property
    def identity(self) -> str | None:
        """The same for the same ink."""
        table = self.table
        arrays = table.wavelength_nm, table.theta_deg, table.phi_deg, table.bsdf_per_sr, table.regular
        return fingerprint([np.asarray(a) for a in arrays])

    @classmethod
    def of(
        cls,
        source: str | Path | FitResult | Sample,
        layers: Sequence[str] | None = None,
        inside: str | None = None,
        plate_index: float | None = None,
        alone: bool = False,
    ) -> "RenderedInk":
        """The ink of a result, of the folder of a result or of a diagnosis, or of a sample or sample file.

        Parameters
        ----------
        source
            Result, sample, or path.
        layers, inside
            As for `jaxink.ink.find_ink`.
        plate_index
            Refractive index of the plate that carries the ink in the scene, in optical contact; None: that of
            the medium next to the ink in the sample.
        alone
            Whether to leave out effects that the sample declares, such as air between plate and ink, which a
            better print does not have.

        Raises
        ------
        InputRefusedError
            If the ink is not clear, or has rough faces, whose lobes are narrower than the table.
        """
        name, sample, wavelengths = sample_of(source, alone)
        ink = find_ink(sample, layers, inside, plate_index)
        if any(sample.layers[k].roughness for k in range(ink.first, ink.last + 1)):
            raise InputRefusedError(
                f"{name or sample.title}: the ink has rough faces, whose lobes are narrower than the angles "
                "of its table; a rendering needs smooth faces."
            )
        options = TableOptions(inside=inside, index_inside=plate_index, accuracy=ACCURACY)
        # Of the sample, not of the result: a rendering has no use for standard errors.
        table = ink_table(sample, layers, wavelengths or None, options=options)
        return cls(name or sample.title, table, *_volume(ink, table))

    def describe(self) -> dict[str, Any]:
        """What is rendered, as plain data."""
        medium = self.medium
        about = {
            "name": self.name,
            "wavelength_nm": self.table.wavelength_nm.tolist(),
            "index_inside": self.table.index_inside.tolist(),
            "index_outside": self.table.index_outside.tolist(),
        }
        if medium is None:
            return about | {"volume": self.why_no_volume}
        return about | {
            "thickness_um": medium.thickness_um,
            "scattering_per_mm": medium.scattering_per_mm.tolist(),
            "absorption_per_mm": medium.absorption_per_mm.tolist(),
            "g": medium.asymmetry.tolist(),
        }


def sample_of(source: str | Path | FitResult | Sample, alone: bool) -> tuple[str, Sample, tuple[float, ...]]:
    """What a source is called, its sample, and the wavelengths that are known of it.

    Parameters: see `RenderedInk.of`.
    """
    name = str(source) if isinstance(source, str | Path) else ""
    if isinstance(source, str | Path):
        path = Path(source)
        source = load_sample(path) if path.suffix == ".toml" and path.is_file() else load_result(path)
    sample = source if isinstance(source, Sample) else source.sample
    wavelengths = sample.wavelengths_nm
    if not isinstance(source, Sample):
        wavelengths = tuple(np.unique(source.data.wavelength_nm[source.data.used]).tolist())
    if alone:
        sample = dataclasses.replace(sample, effects=())
    return name, sample, wavelengths


def _volume(ink: InkLayers, table: InkTable) -> tuple[Medium | None, str]:
    """The medium, or why there is none."""
    effects = table.attrs.get("effects_included")
    if effects:
        return None, (
            f"its table contains the effects that the sample declares ({effects}), which a volume does not; "
            "leave them out (--ink-alone)."
        )
    try:
        return medium_of(ink, table.wavelength_nm.tolist()), ""
    except InputRefusedError as problem:
        return None, str(problem)
