"""A sample as it would be in another arrangement: another thickness, on a card, lit from behind, free."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from jaxink.errors import InputRefusedError, require_number
from jaxink.sample import Backing, Parameter, ParameterTable, Sample, opposite_medium, turned_over

BACKING = "backing.reflectance"
# Keys of a sample file, um.
_LARGEST_UM = 1e7


@dataclasses.dataclass(frozen=True)
class Arrangement:
    """What differs from the sample that was measured; the ink stays the same.

    Parameters
    ----------
    thickness_um
        Thickness of the ink; None for its own.
    over
        Reflectance of a diffusing card behind the sample: a number, or one by wavelength in nm; None for
        what is behind the sample as it is, ``"nothing"`` for none.
    contact
        Whether the card is in optical contact with the last layer, as paper with the ink printed on it.
    lit_from
        ``front`` as measured, or ``back``. The card is always behind what is lit.
    free
        Whether the clear layers are taken away.
    layer
        Name of the ink whose thickness is given; None: the only scattering layer.
    """

    thickness_um: float | None = None
    over: float | Mapping[float, float] | str | None = None
    contact: bool = False
    lit_from: str = "front"
    free: bool = False
    layer: str | None = None

    def __post_init__(self):
        if self.lit_from not in ("front", "back"):
            raise InputRefusedError(f"lit_from is {self.lit_from!r}; it must be 'front' or 'back'.")
        if isinstance(self.over, str) and self.over != "nothing":
            raise InputRefusedError(f"over is {self.over!r}; it must be a reflectance, or 'nothing'.")
        numbers = self.over.values() if isinstance(self.over, Mapping) else [self.over]
        for number in numbers:
            if number is not None and not isinstance(number, str):
                require_number("the reflectance of the card", number)
                if not 0 <= number <= 1:
                    raise InputRefusedError(
                        f"the reflectance of the card is {number:g}; it must be between 0 and 1."
                    )
        if self.contact and (self.over is None or self.over == "nothing"):
            raise InputRefusedError("contact = True needs a card; give its reflectance as over.")
        if self.thickness_um is not None:
            require_number("thickness_um", self.thickness_um)
            if not 0 <= self.thickness_um <= _LARGEST_UM:
                raise InputRefusedError(
                    f"thickness_um is {self.thickness_um:g}; it must be between 0 and {_LARGEST_UM:g}."
                )

    def of(self, sample: Sample) -> Sample:
        """The sample in this arrangement.

        Raises
        ------
        InputRefusedError
            If the ink is not clear, or it or the sample cannot be arranged so.
        """
        if self.lit_from == "back":
            sample = self._turned(sample)
        if self.thickness_um is not None:
            sample = with_thickness(sample, thickness_name(sample, self.layer), self.thickness_um)
        if self.free:
            kept = tuple(layer for layer in sample.layers if layer.scatters)
            sample = dataclasses.replace(sample, layers=kept)
        if self.over is None:
            return sample
        card = None if isinstance(self.over, str) else self.over
        return with_card(sample, card, self.contact)

    def _turned(self, sample: Sample) -> Sample:
        if sample.layers[-1].opaque:
            raise InputRefusedError(
                f"{sample.layers[-1].name} is opaque; light from behind does not pass it, so give the ink a "
                "thickness to see it from there."
            )
        if sample.backing is not None and self.over is None:
            raise InputRefusedError(
                "the sample has a card behind it, which would be in front of it; say what is behind it when "
                "it is lit from the back: over, a reflectance or 'nothing'."
            )
        turned = turned_over(dataclasses.replace(sample, backing=None))
        if turned is None:
            raise InputRefusedError(
                "a tie names a refractive index of the surroundings, so the sample cannot be turned over; "
                "write the number in its place."
            )
        return turned

    def name_of(self, parameter: str) -> str:
        """Name, in this arrangement, of a parameter of the sample."""
        return opposite_medium(parameter) if self.lit_from == "back" else parameter

    @property
    def set_names(self) -> tuple[str, ...]:
        """Stems of parameters that this arrangement states, which a fit knows nothing of."""
        return () if self.over is None else (BACKING,)

    @property
    def words(self) -> str:
        """For people; empty for the sample as it was measured."""
        parts = []
        if self.thickness_um is not None:
            parts.append(f"{self.thickness_um:g} um")
        if self.free:
            parts.append("free")
        if self.lit_from == "back":
            parts.append("lit from the back")
        if self.over is not None:
            known = isinstance(self.over, int | float)
            what = "nothing" if self.over == "nothing" else f"{self.over:g}" if known else "a card"
            parts.append(f"over {what}{' in contact' if self.contact else ''}")
        return ", ".join(parts)


def thickness_name(sample: Sample, layer: str | None = None) -> str:
    """Name of the thickness of the ink.

    Parameters
    ----------
    sample
        The sample.
    layer
        Name of the ink; None: the only scattering layer.

    Raises
    ------
    InputRefusedError
        If the layer does not exist, is opaque, or several scatter and none is named.
    """
    inks = [one for one in sample.layers if one.scatters]
    names = ", ".join(one.name for one in inks)
    found = [one for one in inks if layer in (None, one.name)]
    if not found:
        raise InputRefusedError(f"'{layer}' is no ink of the sample; it must be one of: {names}.")
    if len(found) > 1:
        raise InputRefusedError(f"several layers scatter ({names}); name the one whose thickness is meant.")
    if found[0].opaque:
        raise InputRefusedError(
            f"{found[0].name} is opaque, so its coefficients per length are unknown and nothing "
            "follows for a thickness; measure and fit a layer that lets light through."
        )
    return f"{found[0].name}.thickness_um"


def with_thickness(sample: Sample, name: str, thickness_um: float) -> Sample:
    """The sample with another thickness of a layer, whatever the range of a fit."""
    table = sample.parameters.replace(
        name, value=float(thickness_um), free=False, tie=None, minimum=0.0, maximum=_LARGEST_UM, prior=None
    )
    return dataclasses.replace(sample, parameters=table)


def with_card(
    sample: Sample, reflectance: float | Mapping[float, float] | None, contact: bool = False
) -> Sample:
    """The sample with a card behind it in place of the present one; None for no card.

    Raises
    ------
    InputRefusedError
        If the card lacks a wavelength of the sample.
    """
    kept = [p for p in sample.parameters.values() if p.name.split("@")[0] != BACKING]
    if reflectance is None:
        return dataclasses.replace(sample, backing=None, parameters=ParameterTable(kept))
    card = Backing("both" if contact else "R", contact)
    stated = [
        Parameter(name, float(value), minimum=0.0, maximum=1.0)
        for name, value in _card_values(sample, reflectance).items()
    ]
    return dataclasses.replace(sample, backing=card, parameters=ParameterTable([*kept, *stated]))


def _card_values(sample: Sample, reflectance: float | Mapping[float, float]) -> dict[str, float]:
    if not isinstance(reflectance, Mapping):
        return {BACKING: reflectance}
    known = sorted(reflectance)
    waves = sample.wavelengths_nm or tuple(known)
    if not known or min(waves) < known[0] or max(waves) > known[-1]:
        reach = f"{known[0]:g} to {known[-1]:g} nm" if known else "no wavelength"
        raise InputRefusedError(
            f"the reflectance of the card is known at {reach}; it must reach from {min(waves):g} to "
            f"{max(waves):g} nm."
        )
    values = np.interp(waves, known, [reflectance[wave] for wave in known])
    return {f"{BACKING}@{w:g}": float(v) for w, v in zip(waves, values, strict=True)}


def arranged_names(arrangement: Arrangement, names: Sequence[str], thickness: str | None) -> list[str | None]:
    """Names, in an arrangement, of parameters of a fit; None of those that the arrangement states.

    Parameters
    ----------
    arrangement
        The arrangement.
    names
        The parameters.
    thickness
        Name of the thickness that it states; None if it states none.
    """
    stated = {*arrangement.set_names, *([thickness] if thickness else [])}
    return [None if n.split("@")[0] in stated else arrangement.name_of(n) for n in names]
