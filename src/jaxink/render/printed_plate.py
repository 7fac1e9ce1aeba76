"""A printed plate, whole and in parts: its sheet, and the ink on it."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.fitting import FitResult
from jaxink.ink import InkTable, TableOptions, find_ink, ink_table
from jaxink.numerics.fingerprint import fingerprint
from jaxink.render.rendered_ink import ACCURACY, RenderedInk, sample_of
from jaxink.sample import Sample


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedPlate:
    """One clear plate with an ink on it, as it is measured.

    Parameters
    ----------
    ink
        The ink as seen from inside its plate.
    sheet
        BSDF of plate and ink together between their surroundings, on the full hemisphere, as the model
        predicts it; side I is that of the plate.
    """

    ink: RenderedInk
    sheet: InkTable

    @property
    def wavelength_nm(self) -> Float[np.ndarray, " wavelengths"]:
        """Wavelengths."""
        return self.sheet.wavelength_nm

    @property
    def surroundings(self) -> Float[np.ndarray, " wavelengths"]:
        """Refractive index in front of the plate."""
        return self.sheet.index_inside

    @property
    def identity(self) -> list[str | None]:
        """The same for the same plate."""
        sheet = self.sheet
        return [
            self.ink.identity,
            fingerprint([np.asarray(a) for a in (sheet.theta_deg, sheet.bsdf_per_sr, sheet.regular)]),
        ]

    @classmethod
    def of(
        cls,
        source: str | Path | FitResult | Sample,
        layers: Sequence[str] | None = None,
        inside: str | None = None,
        alone: bool = False,
    ) -> "PrintedPlate":
        """The plate of a result, or of a sample.

        Parameters
        ----------
        source, layers, inside, alone
            As for `RenderedInk.of`.

        Raises
        ------
        InputRefusedError
            If the sample is not one clear plate, which does not absorb, with an ink on it, both with smooth
            faces and without further effects.
        """
        name, sample, wavelengths = sample_of(source, alone)
        called = name or sample.title
        ink = find_ink(sample, layers, inside)
        others = [layer for k, layer in enumerate(sample.layers) if not ink.first <= k <= ink.last]
        if len(others) != 1 or others[0].scatters or ink.media[0] != others[0].name:
            raise InputRefusedError(
                f"{called}: consists of the layers {', '.join(layer.name for layer in sample.layers)}; the "
                "sphere is made of one clear plate with the ink on it."
            )
        (plate,) = others
        if sample.backing is not None:
            raise InputRefusedError(
                f"{called}: the sample has a backing; the sphere is made of a plate with ink in front of "
                "black, so take a sample without a backing."
            )
        if sample.effects:
            raise InputRefusedError(
                f"{called}: the sample declares effects ({', '.join(e.name for e in sample.effects)}), which "
                "neither a body nor a volume has; leave them out (--ink-alone)."
            )
        if plate.roughness:
            raise InputRefusedError(
                f"{called}: the plate '{plate.name}' has rough faces; a rendering needs smooth faces."
            )
        start = sample.parameters.values_with({})
        for wavelength in wavelengths or (None,):
            values = start if wavelength is None else sample.at_wavelength(start, wavelength)
            absorbs = float(values.get(f"{plate.name}.absorption_per_mm", 0.0))
            if absorbs > 0:
                raise InputRefusedError(
                    f"{called}: the plate '{plate.name}' absorbs ({absorbs:g} per mm); the sphere has a "
                    "thinner plate, so take one without absorption."
                )
        rendered = RenderedInk.of(source, layers, inside, alone=alone)
        every = [layer.name for layer in sample.layers]
        # Side I of the whole is where its plate is.
        options = TableOptions(inside=ink.inside, accuracy=ACCURACY)
        return cls(rendered, ink_table(sample, every, wavelengths or None, options=options))
