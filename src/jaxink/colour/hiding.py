"""Drawdowns: colour and hiding of an ink against its thickness, over a black and a white card."""

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.colour.arrangement import BACKING, Arrangement, thickness_name, with_card
from jaxink.colour.coordinates import Colour
from jaxink.colour.geometry import Geometry
from jaxink.colour.of_sample import ParameterCovariance, SampleSpectra
from jaxink.colour.viewing import Illuminant, Viewing
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.sample import Sample

# Of the lacquered cards on which drawdowns are made (ISO 6504-3: at most 5 %, and 80 +- 2 %).
BLACK, WHITE = 0.01, 0.80
# A ratio that counts as hiding, in the paint industry.
HIDING = 0.98
_TOLERANCE = 1e-6
CONTRAST_RATIO, CIEDE2000 = "contrast ratio", "CIEDE2000"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Drawdown(Presented):
    """An ink over a black and over a white card, against its thickness.

    Parameters
    ----------
    thickness_um
        Thicknesses.
    black, white
        Colours over either card, one for each.
    cards
        Reflectances of the cards.
    spectra
        The sample on a card; its thickness and the card are set as parameters.
    viewing
        Light and observer.
    """

    thickness_um: Float[np.ndarray, " thicknesses"]
    black: tuple[Colour, ...]
    white: tuple[Colour, ...]
    cards: tuple[float, float]
    spectra: SampleSpectra
    viewing: Viewing
    thickness: str

    @property
    def contrast_ratio(self) -> Float[np.ndarray, " thicknesses"]:
        """Opacity: Y over black divided by Y over white."""
        return np.array([b.values["Y"] / w.values["Y"] for b, w in zip(self.black, self.white, strict=True)])

    @property
    def difference(self) -> Float[np.ndarray, " thicknesses"]:
        """CIEDE2000 between the ink over black and over white."""
        return np.array([b.difference(w) for b, w in zip(self.black, self.white, strict=True)])

    def thickness_for(self, target: float, measure: str = CONTRAST_RATIO) -> float:
        """Thickness, in um, at which the ink hides the difference of the cards to some degree.

        Parameters
        ----------
        target
            Contrast ratio to be reached, or CIEDE2000 between black and white not to be exceeded.
        measure
            ``contrast ratio`` or ``CIEDE2000``.

        Raises
        ------
        InputRefusedError
            If it is not reached between the smallest and the largest thickness.
        """
        if measure not in (CONTRAST_RATIO, CIEDE2000):
            raise InputRefusedError(
                f"the measure is {measure!r}; it must be '{CONTRAST_RATIO}' or '{CIEDE2000}'."
            )

        def excess(log_thickness: float) -> float:
            black, white = (self._colour(float(np.exp(log_thickness)), card) for card in self.cards)
            if measure == CONTRAST_RATIO:
                return black.values["Y"] / white.values["Y"] - target
            return target - black.difference(white)

        known = self.contrast_ratio - target if measure == CONTRAST_RATIO else target - self.difference
        reached = np.flatnonzero(known >= 0)
        low, high = self.thickness_um[0], self.thickness_um[-1]
        if not reached.size or reached[0] == 0:
            values = self.contrast_ratio if measure == CONTRAST_RATIO else self.difference
            raise InputRefusedError(
                f"a {measure} of {target:g} is reached {'below' if reached.size else 'above'} the "
                f"thicknesses of the drawdown, {low:g} to {high:g} um, over which it goes from "
                f"{values[0]:.4g} to {values[-1]:.4g}; choose others."
            )
        # Not before: a fit imports this module, but finds no root.
        from scipy.optimize import brentq

        ends = np.log(self.thickness_um[reached[0] - 1 : reached[0] + 1])
        return float(np.exp(brentq(excess, *ends, xtol=_TOLERANCE)))

    def _colour(self, thickness_um: float, card: float) -> Colour:
        values = {self.thickness: thickness_um, BACKING: card}
        return Colour("ink", self.viewing, self.spectra.at(values)[0])

    @cached_property
    def _rows(self) -> list[list[str]]:
        each = zip(
            self.thickness_um, self.black, self.white, self.contrast_ratio, self.difference, strict=True
        )
        return [
            [f"{t:.4g}", *b.row()[6:9], *w.row()[6:9], f"{ratio:.4f}", f"{gap:.2f}"]
            for t, b, w, ratio, gap in each
        ]

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "light": self.viewing.sentence,
            "cards": list(self.cards),
            "thickness_um": self.thickness_um.tolist(),
            "black": [colour.to_dict() for colour in self.black],
            "white": [colour.to_dict() for colour in self.white],
            "contrast_ratio": self.contrast_ratio.tolist(),
            "ciede2000": self.difference.tolist(),
        }

    def card(self) -> Card:
        """CIELAB over both cards, contrast ratio and difference at each thickness."""
        heads = ["um", *(f"{name} over {card:g}" for card in self.cards for name in ("L*", "a*", "b*"))]
        table = CardTable([*heads, "contrast ratio", "CIEDE2000"], self._rows, ())
        title = f"Drawdown seen {self.spectra.geometries[0].name}"
        return Card(title, [self.viewing.sentence], (table,))


def drawdown(
    sample: Sample,
    wavelength_nm: Sequence[float] | Float[np.ndarray, " wavelengths"],
    thickness_um: Sequence[float] | Float[np.ndarray, " thicknesses"],
    geometry: str | Geometry = "45:0",
    illuminant: str | Illuminant = "D65",
    observer_deg: int = 2,
    cards: tuple[float, float] = (BLACK, WHITE),
    arrangement: Arrangement | None = None,
    known: ParameterCovariance | None = None,
) -> Drawdown:
    """Colours of an ink over black and white against its thickness.

    Parameters
    ----------
    sample, wavelength_nm
        The sample, and the wavelengths at which it is known.
    thickness_um
        Thicknesses above 0, ascending.
    geometry, illuminant, observer_deg
        See `jaxink.colour.fitted_colours`.
    cards
        Reflectance of the black and of the white card.
    arrangement
        Which layer is the ink, whether it is lit from the back, without its clear layers, in contact with
        the card; the rest does not count. None: free, in contact.
    known
        Covariance of parameters by their names in the arrangement, for standard errors.

    Raises
    ------
    InputRefusedError
        If the thicknesses do not ascend, or the ink has none.
    """
    grid = np.asarray(thickness_um, float)
    if len(grid) < 2 or not (np.all(np.diff(grid) > 0) and grid[0] > 0):
        raise InputRefusedError("the thicknesses of a drawdown must be two or more above 0, ascending.")
    if arrangement is None:
        arrangement = Arrangement(over=cards[0], contact=True, free=True)
    name = thickness_name(sample, arrangement.layer)
    waves = tuple(np.asarray(wavelength_nm, float).tolist())
    placed = dataclasses.replace(
        arrangement, thickness_um=float(np.sqrt(grid[0] * grid[-1])), over=cards[0]
    ).of(dataclasses.replace(sample, wavelengths_nm=waves))
    placed = with_card(placed, cards[0], arrangement.contact)
    spectra = SampleSpectra(placed, [geometry], waves)
    viewing = Viewing.of(spectra.wavelength_nm, illuminant, observer_deg)

    def colours(card: float) -> tuple[Colour, ...]:
        return tuple(
            spectra.colours(illuminant, observer_deg, known, {name: float(t), BACKING: card})[0] for t in grid
        )

    return Drawdown(grid, colours(cards[0]), colours(cards[1]), cards, spectra, viewing, name)
