"""Measured against fitted colours, in every direction that was measured at all wavelengths."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from jaxink.colour.cie import difference, lab_of
from jaxink.colour.viewing import Illuminant, Viewing
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.measurement import GonioData

_PLACES = ("theta_i_deg", "theta_o_deg", "phi_deg")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ColoursAtPoints(Presented):
    """CIELAB measured and fitted, in each direction.

    Parameters
    ----------
    viewing
        Light, observer and band.
    first
        Row of `jaxink.GonioData` of each direction, at the first wavelength.
    data
        The measurement.
    measured, fitted
        CIELAB of pi times the BSDF.
    """

    viewing: Viewing
    first: Int[np.ndarray, " directions"]
    data: GonioData
    measured: Float[np.ndarray, "directions 3"]
    fitted: Float[np.ndarray, "directions 3"]

    @property
    def differences(self) -> Float[np.ndarray, " directions"]:
        """CIEDE2000 between measured and fitted."""
        return difference(self.measured, self.fitted)

    def _sides(self) -> list[tuple[str, np.ndarray]]:
        behind = self.data.is_transmission[self.first]
        each = (("reflection", ~behind), ("transmission", behind))
        return [(name, here) for name, here in each if here.any()]

    def to_dict(self) -> dict[str, Any]:
        """Plain data: mean, median and largest difference on each side."""
        found = self.differences
        return {
            name: {
                "directions": int(here.sum()),
                "mean": float(found[here].mean()),
                "median": float(np.median(found[here])),
                "largest": float(found[here].max()),
            }
            for name, here in self._sides()
        }

    def card(self) -> Card:
        """Differences on each side, and where they are largest."""
        rows = []
        found = self.differences
        for name, here in self._sides():
            worst = self.first[here][np.argmax(found[here])]
            at = ":".join(f"{getattr(self.data, place)[worst]:g}" for place in _PLACES)
            numbers = (found[here].mean(), np.median(found[here]), found[here].max())
            rows.append([name, str(int(here.sum())), *(f"{number:.2f}" for number in numbers), at])
        heads = ["side", "directions", "mean", "median", "largest", "there (theta_i:theta_o:phi)"]
        table = CardTable(heads, rows, (0, 5), "CIEDE2000, measured against fitted")
        return Card("Colours at the measured directions", [self.viewing.sentence], (table,))


def colours_at_points(
    data: GonioData,
    predicted_per_sr: Float[np.ndarray, " used"],
    illuminant: str | Illuminant = "D65",
    observer_deg: int = 2,
) -> ColoursAtPoints:
    """Compare the colours of a measurement with those of its prediction.

    Parameters
    ----------
    data
        The measurement; masked points do not count, nor do directions that lack a wavelength.
    predicted_per_sr
        Prediction at its used points.
    illuminant, observer_deg
        See `Viewing.of`.

    Raises
    ------
    InputRefusedError
        If no direction has all wavelengths, or there are fewer than two of them.
    """
    used = np.flatnonzero(data.used)
    keys = np.column_stack([data.is_transmission[used], *(getattr(data, place)[used] for place in _PLACES)])
    waves, wave = np.unique(data.wavelength_nm[used], return_inverse=True)
    viewing = Viewing.of(waves, illuminant, observer_deg)
    _, direction = np.unique(np.round(keys, 6), axis=0, return_inverse=True)
    # Repeated readings are averaged.
    size = int(direction.max()) + 1
    counts, sums, fits = (np.zeros((size, len(waves))) for _ in range(3))
    at = direction.reshape(-1), wave.reshape(-1)
    np.add.at(counts, at, 1.0)
    np.add.at(sums, at, data.bsdf_per_sr[used])
    np.add.at(fits, at, predicted_per_sr)
    first = np.full(size, -1)
    first[at[0][::-1]] = used[::-1]
    whole = (counts > 0).all(axis=1)
    if not whole.any():
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: no direction was measured at all of "
            f"{len(waves)} wavelengths, so no colour was measured."
        )
    # Black is seen as black, whatever the noise around it.
    xyz = [np.pi * np.maximum(one[whole] / counts[whole], 0.0) @ viewing.weights.T for one in (sums, fits)]
    measured, fitted = (lab_of(one, viewing.white) for one in xyz)
    return ColoursAtPoints(viewing, first[whole], data, measured, fitted)
