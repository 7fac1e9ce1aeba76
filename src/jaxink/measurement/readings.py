"""Readings of instruments other than a goniometer: totals of spheres, regular light, reflectance factors."""

import dataclasses
from collections.abc import Collection
from functools import cached_property
from typing import cast

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.display.brief import brief_repr, counted
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError, no_such_name
from jaxink.measurement.checks import WAVELENGTH_RANGE_NM, wavelength_remedy
from jaxink.measurement.scans import SAME
from jaxink.measurement.table import refusal

IDEAL_SPHERE = "The integrating sphere is taken as ideal: nothing is stated of its wall and its port."
_FLOATS = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "value")
_ANGLES = {"theta_i_deg": "illumination", "theta_o_deg": "detection"}
# Of a share of the incident power, which noise may bring above 1 and below 0.
_SHARE = 1.5
# Of a ratio to an ideal diffuser or to the illuminating radiance, which exceeds 1 towards a peak or in a
# denser medium.
_FACTOR = 4.0
LOWEST = -0.1


@dataclasses.dataclass(frozen=True, eq=False)
class Spheres:
    """Integrating sphere of each reading, with the sample as part of its wall; nan where it is ideal.

    Parameters
    ----------
    wall_reflectance
        Mean reflectance of the wall outside the sample port, other ports included.
    port_fraction
        Area of the sample port over that of the sphere.
    reference_reflectance
        Reflectance of what fills the sample port while the reading of 100 % is taken: 0 if it is open, that
        of the wall if it is closed by a plug of the same coating.
    """

    __repr__ = brief_repr

    wall_reflectance: Float[np.ndarray, " readings"]
    port_fraction: Float[np.ndarray, " readings"]
    reference_reflectance: Float[np.ndarray, " readings"]

    @property
    def columns(self) -> dict[str, Float[np.ndarray, " readings"]]:
        """The arrays by name."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Readings(Presented):
    """Totals, regular light and reflectance factors of one sample.

    The arrays are copied and made read-only.

    Parameters
    ----------
    quantity
        Names of `jaxink.measurement.readings.QUANTITIES`, shape ``(readings,)``.
    theta_i_deg, theta_o_deg
        Polar angles of illumination and of detection, 0 to below 90 degrees; nan for a hemisphere, and for
        regular light that of detection.
    phi_deg
        Azimuth as in `GonioData`; nan unless both polar angles are given.
    wavelength_nm
        Wavelength in vacuum.
    value
        Shares of the incident power or reflectance factors, 1 for all light, not per cent.
    sigma
        Standard deviation of each value, or None if unknown.
    row
        Line of the source file of each reading; 1 is the first line of the file.
    spheres
        Integrating spheres with known parameters; None if all are ideal.
    source
        Name of the file.
    notes
        Sentences on what was taken for granted while reading.

    Raises
    ------
    InputRefusedError
        If an array is of another length, not finite or out of range, or a quantity is unknown; the message
        names the row.
    """

    quantity: np.ndarray
    theta_i_deg: Float[np.ndarray, " readings"]
    theta_o_deg: Float[np.ndarray, " readings"]
    phi_deg: Float[np.ndarray, " readings"]
    wavelength_nm: Float[np.ndarray, " readings"]
    value: Float[np.ndarray, " readings"]
    sigma: Float[np.ndarray, " readings"] | None = None
    # Of None, the rows below a header.
    row: Int[np.ndarray, " readings"] = cast("np.ndarray", None)
    spheres: Spheres | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        size = len(self.value)
        if size == 0:
            raise InputRefusedError(f"{self._name}: has no readings; give at least one.")
        self._freeze("row", np.arange(2, size + 2) if self.row is None else self.row, np.int64, size)
        self._freeze("quantity", self.quantity, str, size)
        for name in (*_FLOATS, *(["sigma"] if self.sigma is not None else [])):
            self._freeze(name, getattr(self, name), np.float64, size)
        self._check()

    def _freeze(self, name, values, dtype, size):
        values = np.array(values, dtype)
        if values.shape != (size,):
            raise InputRefusedError(
                f"{self._name}: {name} has shape {values.shape}; it must be ({size},), as value has."
            )
        values.setflags(write=False)
        object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return self.value.size

    @property
    def _name(self) -> str:
        return self.source or "Readings"

    def refusal(self, reading: int, column: str, text: str) -> InputRefusedError:
        """Error about one reading, which names file, row and column."""
        return refusal(self._name, text, int(self.row[reading]), column)

    def _check(self):
        """Reject the first wrong value of each column, with what would be right."""
        for k, name in enumerate(self.quantity.tolist()):
            if name not in QUANTITIES:
                raise self.refusal(k, "quantity", f"is '{name}', {no_such_name(QUANTITIES)[:-1]}")
        low, high = WAVELENGTH_RANGE_NM
        inside = (self.wavelength_nm >= low) & (self.wavelength_nm <= high)
        if not inside.all():
            k = int(np.argmin(inside))
            remedy = wavelength_remedy(self.wavelength_nm[k])
            text = f"is {self.wavelength_nm[k]:g}; it must be between {low:g} and {high:g} nm"
            raise self.refusal(k, "wavelength_nm", f"{text}; {remedy}" if remedy else text)
        for name in _ANGLES:
            self._check_angle(name)
        phi, has_phi = self.phi_deg, np.array([QUANTITIES[q].has_azimuth for q in self.quantity.tolist()])
        self._require("phi_deg", np.where(has_phi, (phi > -180) & (phi <= 180), np.isnan(phi)),
                      "in (-180, 180] degrees for light from one direction into another, and nan (in a file: "
                      "empty) for all other quantities")  # fmt: skip
        largest = np.array([QUANTITIES[q].largest for q in self.quantity.tolist()])
        right = (self.value >= LOWEST) & (self.value <= largest)
        if not right.all():
            k = int(np.argmin(right))
            text = f"is {self.value[k]:g}; it must lie between {LOWEST:g} and {largest[k]:g}, where 1 is all "
            raise self.refusal(k, "value", f"{text}light; write per cent in a column value_percent")
        if self.sigma is not None:
            self._require("sigma", (self.sigma > 0) & (self.sigma <= 1), "above 0 and at most 1")
        if self.spheres is not None:
            self._check_spheres(self.spheres)

    def _require(self, name, right, wanted, values=None):
        if not right.all():
            k = int(np.argmin(right))
            value = (getattr(self, name) if values is None else values)[k]
            raise self.refusal(k, name, f"is {value:g}; it must be {wanted}")

    def _check_angle(self, name: str):
        angle = getattr(self, name)
        for k, quantity in enumerate(self.quantity.tolist()):
            stated = getattr(QUANTITIES[quantity], name)
            if stated is None and not np.isnan(angle[k]):
                what = f"has no angle of {_ANGLES[name]} of its own; leave it out (nan; in a file: empty)"
                raise self.refusal(k, name, f"is {angle[k]:g}, but {quantity} {what}")
            if stated is not None and not 0 <= angle[k] < 90:
                text = f"is {angle[k]:g}; it must be at least 0 and below 90 degrees"
                raise self.refusal(k, name, text)

    def _check_spheres(self, spheres: Spheres):
        columns = spheres.columns
        known = ~np.isnan(columns["wall_reflectance"])
        for name, values in columns.items():
            column = f"sphere_{name}"
            half = np.isnan(values) == known
            if half.any():
                k = int(np.argmax(half))
                text = "is missing; a sphere needs its wall reflectance, port fraction and reference, or none"
                raise self.refusal(k, column, text if known[k] else "is given without a wall reflectance")
            below_1 = name != "reference_reflectance"
            right = ~known | ((values >= 0) & ((values < 1) if below_1 else (values <= 1)))
            wanted = "at least 0 and below 1" if below_1 else "between 0 and 1"
            self._require(column, right, wanted, values)
        if (known & ~self.is_of_sphere).any():
            k = int(np.argmax(known & ~self.is_of_sphere))
            text = f"is given, but {self.quantity[k]} is not read with a sphere; leave the cell empty"
            raise self.refusal(k, "sphere_wall_reflectance", text)

    @cached_property
    def is_transmission(self) -> Bool[np.ndarray, " readings"]:
        """Whether each is read behind the sample."""
        return np.array([QUANTITIES[name].is_transmission for name in self.quantity.tolist()])

    @cached_property
    def is_of_sphere(self) -> Bool[np.ndarray, " readings"]:
        """Whether each is read with an integrating sphere."""
        return np.array([QUANTITIES[name].is_of_sphere for name in self.quantity.tolist()])

    @cached_property
    def scan_index(self) -> Int[np.ndarray, " readings"]:
        """Number of the scan of each reading: those of one quantity share one."""
        return np.unique(self.quantity, return_inverse=True)[1].reshape(-1)

    def select(self, keep: Bool[np.ndarray, " readings"]) -> "Readings":
        """Some of the readings, at least one."""
        spheres = self.spheres
        if spheres is not None:
            spheres = Spheres(**{name: values[keep] for name, values in spheres.columns.items()})
        columns = {name: getattr(self, name)[keep] for name in (*_FLOATS, "quantity", "row")}
        sigma = None if self.sigma is None else self.sigma[keep]
        return dataclasses.replace(self, **columns, sigma=sigma, spheres=spheres)

    def at_wavelengths(self, wavelengths_nm: Collection[float]) -> "Readings":
        """The readings at some wavelengths; all of them if there are none.

        Raises
        ------
        InputRefusedError
            If there is no reading at one of them.
        """
        keep = np.zeros(len(self), bool)
        for wavelength in wavelengths_nm:
            here = np.abs(self.wavelength_nm - wavelength) <= SAME
            if not here.any():
                held = ", ".join(f"{w:g}" for w in np.unique(self.wavelength_nm))
                raise InputRefusedError(f"{self._name}: no reading at {wavelength:g} nm; it has {held} nm.")
            keep |= here
        return self.select(keep) if wavelengths_nm else self

    def card(self) -> Card:
        """Source, readings of each quantity and notes."""
        noise = "with standard deviations" if self.sigma is not None else "without standard deviations"
        title = f"Readings {self.source or 'in memory'}: {counted(len(self), 'reading')}, {noise}"
        rows = []
        for name in np.unique(self.quantity).tolist():
            here = self.quantity == name
            nm, value = self.wavelength_nm[here], self.value[here]
            spans = [
                f"{x.min():g}" if np.ptp(x) == 0 else f"{x.min():.4g} to {x.max():.4g}" for x in (nm, value)
            ]
            rows.append([name, *spans, str(int(here.sum()))])
        table = CardTable(["quantity", "nm", "values", "readings"], rows)
        return Card(title, (), (table,), self.notes)


@dataclasses.dataclass(frozen=True)
class ReadingKind:
    """One kind of reading.

    Parameters
    ----------
    meaning
        For the manual and for messages.
    is_transmission
        Whether light is read behind the sample.
    theta_i_deg, theta_o_deg
        Angles of incidence and of view that are taken as stated if a file leaves them out; None for a
        hemisphere, and of regular light for the angle that follows from the other one.
    largest
        Above it, a value is taken for per cent.
    is_regular
        Whether only regular light is read.
    """

    meaning: str
    is_transmission: bool
    theta_i_deg: float | None
    theta_o_deg: float | None = None
    largest: float = _SHARE
    is_regular: bool = False

    @property
    def has_azimuth(self) -> bool:
        """Whether light is read in one direction for light from one direction."""
        return self.theta_i_deg is not None and self.theta_o_deg is not None

    @property
    def is_of_sphere(self) -> bool:
        """Whether an integrating sphere illuminates the sample or collects its light."""
        return not (self.is_regular or self.has_azimuth)


# Geometries as in CIE 15: di and de are diffuse illumination with the specular (or regular)
# component included and excluded.
QUANTITIES = {
    "R_total": ReadingKind("reflectance 8:di, specular included", False, 8.0),
    "R_diffuse": ReadingKind("reflectance 8:de, specular excluded", False, 8.0),
    "T_total": ReadingKind("transmittance into the hemisphere, regular light included", True, 8.0),
    "T_diffuse": ReadingKind("transmittance into the hemisphere, regular light excluded", True, 8.0),
    "T_collimated": ReadingKind("regular transmittance", True, 0.0, is_regular=True),
    "R_specular": ReadingKind("regular reflectance", False, 8.0, is_regular=True),
    "R_di_8": ReadingKind("reflectance factor di:8, specular included", False, None, 8.0),
    "R_de_8": ReadingKind("reflectance factor de:8, specular excluded", False, None, 8.0),
    "T_di_8": ReadingKind("diffuse light seen through, regular light included", True, None, 8.0, _FACTOR),
    "T_de_8": ReadingKind("diffuse light seen through, regular light excluded", True, None, 8.0, _FACTOR),
    "R_45_0": ReadingKind("reflectance factor 45:0", False, 45.0, 0.0, _FACTOR),
    "R_0_45": ReadingKind("reflectance factor 0:45", False, 0.0, 45.0, _FACTOR),
}
