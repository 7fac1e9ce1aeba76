"""A goniometer measurement as an immutable, checked set of arrays."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, cast

import numpy as np
from jaxtyping import Bool, Float, Int, UInt32
from numpy import ndarray

from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import write_dataset
from jaxink.measurement import checks, netcdf
from jaxink.measurement.checks import LARGEST_PER_SR, WAVELENGTH_RANGE_NM
from jaxink.measurement.columns import ANGLES
from jaxink.measurement.masks import (
    USER,
    MaskLimits,
    mask_bits,
    mask_counts,
    mask_names,
    mask_sentences,
    value_bits,
)
from jaxink.measurement.scans import SAME, Scan, scan_numbers, wavelength_words
from jaxink.measurement.table import TextTable

if TYPE_CHECKING:
    import pandas
    import xarray


Columns = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
# Of a measurement that was joined from several files: the file of each row.
FILE_COLUMN = "source_file"
_JOINT = " + "
# What a column of sides may hold instead of booleans.
_SIDES = {"R": False, "T": True}
# One value of these is that of all points.
_OF_ALL = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "is_transmission", "sigma_per_sr")
_FLOATS = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "bsdf_per_sr")
_MOST_INCIDENCES = 12


@dataclass(frozen=True, eq=False, repr=False)
class GonioData(Presented):
    """BSDF of one sample at many pairs of directions.

    The arrays are copied and made read-only; one number in place of an array is that of all points, except
    for ``bsdf_per_sr``. phi is 180 in the half-plane of the specular direction
    (reflection) or of the undeviated beam (transmission), 0 in the half-plane of the source.

    Parameters
    ----------
    theta_i_deg, theta_o_deg
        Polar angles of incidence and of view, 0 to 90 degrees, each from the outward normal of the side on
        which the light enters or leaves, shape ``(points,)``.
    phi_deg
        Azimuth of the outgoing direction minus that of the direction towards the source, in
        (-180, 180] degrees.
    wavelength_nm
        Wavelength in vacuum.
    is_transmission
        False for reflection, True for transmission.
    bsdf_per_sr
        Radiance over irradiance in 1/sr, without the cosine.
    sigma_per_sr
        Standard deviation of each value in 1/sr, or None if unknown.
    extra
        Other columns of the file, numbers or text, each of shape ``(points,)``.
    row
        Line of the source file of each point; 1 is the first line of the file.
    mask
        Reasons to exclude a point from fits, as bits of ``masks.MASK_FLAGS``; 0 if it is used.
    source
        Name of the file; of several that were joined, their names with `` + `` between them, and the extra
        column ``source_file`` has that of each point.
    notes
        Sentences on everything that was changed while reading.
    attrs
        Further information, such as the name of the sample: text or numbers.

    Raises
    ------
    InputRefusedError
        If an array is empty, of another length, not finite or out of range. Without ``row``, as no reader has
        seen the values, also if the angles are in radians, or the values in per cent or reflectance factors.
    """

    # The types describe the fields. The constructor converts its arguments or rejects them with a sentence,
    # so the type checker of the tests must not reject them first; methods are checked.
    __no_type_check__ = True

    theta_i_deg: Float[np.ndarray, " points"]
    theta_o_deg: Float[np.ndarray, " points"]
    phi_deg: Float[np.ndarray, " points"]
    wavelength_nm: Float[np.ndarray, " points"]
    is_transmission: Bool[np.ndarray, " points"]
    bsdf_per_sr: Float[np.ndarray, " points"]
    sigma_per_sr: Float[np.ndarray, " points"] | None = None
    extra: Mapping[str, np.ndarray] = field(default_factory=dict)
    # Of None, the file's first rows, and no mask, are made at once: no reader meets it.
    row: Int[np.ndarray, " points"] = cast("np.ndarray", None)
    mask: UInt32[np.ndarray, " points"] = cast("np.ndarray", None)
    source: str = ""
    notes: tuple[str, ...] = ()
    attrs: Mapping[str, str | int | float] = field(default_factory=dict)

    def __post_init__(self):
        size = np.size(self.bsdf_per_sr)
        for name in _FLOATS:
            self._freeze(name, getattr(self, name), np.float64, size)
        if self.sigma_per_sr is not None:
            self._freeze("sigma_per_sr", self.sigma_per_sr, np.float64, size)
        self._freeze("is_transmission", self._flags(), np.bool_, size)
        is_unread = self.row is None
        row = np.arange(2, size + 2) if self.row is None else self.row
        self._freeze("row", row, np.int64, size)
        self._freeze("mask", np.zeros(size) if self.mask is None else self.mask, np.uint32, size)
        extra = {str(name): _extra_column(values) for name, values in self.extra.items()}
        for name, values in extra.items():
            if values.shape != (size,):
                raise self._refusal(f"extra column {name} has shape {values.shape}, not ({size},)")
        object.__setattr__(self, "extra", MappingProxyType(extra))
        object.__setattr__(self, "attrs", MappingProxyType(dict(self.attrs)))
        object.__setattr__(self, "notes", tuple(self.notes))
        self._check_ranges()
        if is_unread:
            self._check_units()

    def __reduce__(self):
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        values |= {"extra": dict(self.extra), "attrs": dict(self.attrs)}
        return type(self), tuple(values.values())

    def __len__(self) -> int:
        return self.bsdf_per_sr.size

    def _refusal(self, text) -> InputRefusedError:
        return InputRefusedError(f"{self.source or 'GonioData'}: {text}.")

    def _flags(self) -> np.ndarray:
        """Sides as booleans: any other text would be true."""
        values = np.asarray(self.is_transmission)
        if values.dtype.kind in "OUS":
            each = values.ravel().tolist()
            known = [bool(one) if isinstance(one, bool | np.bool_) else _SIDES.get(str(one)) for one in each]
            wrong = [one for one, flag in zip(each, known, strict=True) if flag is None]
            if not wrong:
                return np.array(known, bool).reshape(values.shape)
        else:
            wrong = values[(values != 0) & (values != 1)].tolist()
            if not wrong:
                return values.astype(bool)
        raise self._refusal(
            f"is_transmission contains {wrong[0]!r}; every value must be False for reflection or True for "
            "transmission, or 'R' or 'T'"
        )

    def _freeze(self, name, values, dtype, size):
        values = np.array(values, dtype)
        if values.ndim == 0 and name in _OF_ALL:
            values = np.full(size, values)
        if values.shape != (size,) or size == 0:
            wanted = f"({size},)" if size else "(points,) with at least one point"
            raise self._refusal(f"{name} has shape {values.shape}; it must be {wanted}")
        if dtype is np.float64 and not np.isfinite(values).all():
            point = int(np.argmin(np.isfinite(values)))
            raise self._refusal(f"{name}[{point}] is {values[point]}; every value must be finite")
        values.setflags(write=False)
        object.__setattr__(self, name, values)

    def _check_ranges(self):
        low_nm, high_nm = WAVELENGTH_RANGE_NM
        between, largest = f"between {low_nm:g} and {high_nm:g}", f"{LARGEST_PER_SR:g}"
        ranges = [
            ("theta_i_deg", "between 0 and 90", lambda x: (x >= 0) & (x <= 90)),
            ("theta_o_deg", "between 0 and 90", lambda x: (x >= 0) & (x <= 90)),
            ("phi_deg", "in (-180, 180]", lambda x: (x > -180) & (x <= 180)),
            ("wavelength_nm", between, lambda x: (x >= low_nm) & (x <= high_nm)),
            ("bsdf_per_sr", f"of a magnitude up to {largest}", lambda x: np.abs(x) <= LARGEST_PER_SR),
            ("sigma_per_sr", f"positive and at most {largest}", lambda x: (x > 0) & (x <= LARGEST_PER_SR)),
        ]
        for name, wanted, is_right in ranges:
            values = getattr(self, name)
            if values is None or is_right(values).all():
                continue
            point = int(np.argmin(is_right(values)))
            if name == "wavelength_nm" and (remedy := checks.wavelength_remedy(values[point])):
                wanted += f" nm; {remedy}"
            raise self._refusal(f"{name}[{point}] is {values[point]:g}; it must be {wanted}")

    def _check_units(self):
        """As those of a file, for arrays that a user gives."""
        table = TextTable(self.source or "GonioData", (), (), np.full(len(self), None), 0, ())
        checks.refuse_radians(table, {name: getattr(self, name) for name in ANGLES})
        # Values that are all alike hold the place of a prediction.
        if np.ptp(self.bsdf_per_sr) > 0:
            mask = value_bits(self.directions, self.bsdf_per_sr)
            checks.refuse_excess(table, self.directions, self.bsdf_per_sr, self.scan_index, mask)

    @cached_property
    def side(self) -> np.ndarray:
        """``"R"`` or ``"T"`` for each point."""
        return np.where(self.is_transmission, "T", "R")

    @property
    def directions(self) -> Columns:
        """Angles, wavelength and side of each point, in the order in which a forward model takes them."""
        angles = self.theta_i_deg, self.theta_o_deg, self.phi_deg
        return *angles, self.wavelength_nm, self.is_transmission

    @property
    def used_directions(self) -> Columns:
        """Those of the points that no mask excludes."""
        theta_i, theta_o, phi, wavelength, is_transmission = (column[self.used] for column in self.directions)
        return theta_i, theta_o, phi, wavelength, is_transmission

    @property
    def signed_theta_o_deg(self) -> Float[np.ndarray, " points"]:
        """Polar angle of view, negative in the half-space of the source (azimuths below 90 degrees)."""
        return np.where(np.abs(self.phi_deg) < 90, -self.theta_o_deg, self.theta_o_deg)

    @property
    def used(self) -> Bool[np.ndarray, " points"]:
        """True if no mask excludes the point."""
        return np.equal(self.mask, 0)

    @cached_property
    def file_index(self) -> Int[np.ndarray, " points"]:
        """Which of the joined files each point comes from, from 0 in their order; 0 if there is only one."""
        if not self._files:
            return np.zeros(len(self), int)
        return np.array([self._files.index(name) for name in self.extra[FILE_COLUMN].tolist()])

    @cached_property
    def _files(self) -> tuple[str, ...]:
        """Names of the joined files; empty if there is only one, even if it has a column of this name."""
        files, column = tuple(self.source.split(_JOINT)), self.extra.get(FILE_COLUMN)
        is_joined = len(files) > 1 and column is not None and set(column.tolist()) <= set(files)
        return files if is_joined else ()

    @cached_property
    def reading_order(self) -> Int[np.ndarray, " points"]:
        """Order in which the values were written down: the row, counted on from file to file."""
        return self.row + self.file_index * (int(self.row.max()) + 1)

    def place(self, point: int) -> str:
        """Row of a point, and its file if several were joined, for messages."""
        row = f"row {self.row[point]}"
        return f"{row} of {self._files[self.file_index[point]]}" if self._files else row

    @cached_property
    def scan_index(self) -> Int[np.ndarray, " points"]:
        """Number of the scan of each point, ordered as `scans`, whatever the order of the rows."""
        return scan_numbers(self.is_transmission, self.wavelength_nm, self.theta_i_deg)

    @property
    def used_scan_index(self) -> Int[np.ndarray, " points"]:
        """Number of the scan of each point that no mask excludes, among the scans that have such points."""
        return np.unique(self.scan_index[self.used], return_inverse=True)[1].reshape(-1)

    @cached_property
    def scans(self) -> tuple[Scan, ...]:
        """The scans: reflection first, then by wavelength, then by incidence."""
        _, first = np.unique(self.scan_index, return_index=True)
        columns = (self.side[first], self.wavelength_nm[first], self.theta_i_deg[first])
        points, used = (np.bincount(self.scan_index, weights=w).astype(int) for w in (None, self.used))
        rows = zip(*(column.tolist() for column in (*columns, points, used)), strict=True)
        return tuple(Scan(index, *row) for index, row in enumerate(rows))

    def select(
        self,
        *,
        wavelength_nm: float | Sequence[float] | None = None,
        side: str | None = None,
        theta_i_deg: float | Sequence[float] | None = None,
        used_only: bool = False,
    ) -> "GonioData":
        """Points with given wavelengths, sides or angles of incidence.

        Parameters
        ----------
        wavelength_nm, theta_i_deg
            One value or several, each of which must occur in the data; None keeps all.
        side
            ``"R"`` or ``"T"``; None keeps both.
        used_only
            Drop the masked points.

        Raises
        ------
        InputRefusedError
            If a value does not occur, or no point remains.
        """
        if side not in (None, "R", "T"):
            raise self._refusal(f"side is {side!r}; it must be 'R' or 'T'")
        keep = self.used.copy() if used_only else np.ones(len(self), bool)
        for name, wanted in (("wavelength_nm", wavelength_nm), ("theta_i_deg", theta_i_deg)):
            if wanted is None:
                continue
            values, chosen = getattr(self, name), np.zeros(len(self), bool)
            for value in np.atleast_1d(wanted):
                here = np.abs(values - value) <= SAME
                if not here.any():
                    held = ", ".join(f"{v:g}" for v in np.unique(values))
                    raise self._refusal(f"no point has {name} {value:g}; the data have {held}")
                chosen |= here
            keep &= chosen
        if side is not None:
            keep &= self.is_transmission == (side == "T")
        if not keep.any():
            raise self._refusal("no point has this combination of side, wavelength_nm and theta_i_deg")
        return self._at(keep)

    def _at(self, keep) -> "GonioData":
        names = (*_FLOATS, "is_transmission", "row", "mask")
        changes = {name: getattr(self, name)[keep] for name in names}
        if self.sigma_per_sr is not None:
            changes["sigma_per_sr"] = self.sigma_per_sr[keep]
        changes["extra"] = {name: values[keep] for name, values in self.extra.items()}
        return self.replace(**changes)

    def replace(self, **changes) -> "GonioData":
        """Copy with some fields changed, checked again."""
        return dataclasses.replace(self, **changes)

    def with_masks(self, limits: MaskLimits | None = None, user=None) -> "GonioData":
        """Mask points by geometry, by sign and by the user's choice.

        Geometric masks of an earlier call are replaced; the user's masks accumulate.

        Parameters
        ----------
        limits
            Limits of the geometric masks; None: the defaults of `MaskLimits`.
        user
            True for points that the user excludes, shape ``(points,)``.

        Raises
        ------
        InputRefusedError
            If ``user`` has another shape, or no point remains.
        """
        masked = self.replace(mask=self.mask_bits(limits, user))
        if not masked.used.any():
            counts = ", ".join(f"{name} {n}" for name, n in mask_counts(masked.mask).items() if n)
            raise self._refusal(f"every point is masked ({counts})")
        return masked

    def mask_bits(self, limits: MaskLimits | None = None, user=None) -> UInt32[np.ndarray, " points"]:
        """Bits that `with_masks` sets; all points may be masked."""
        user = np.zeros(len(self), bool) if user is None else np.asarray(user)
        if user.shape != (len(self),) or user.dtype != bool:
            raise InputRefusedError(
                f"user has shape {user.shape} and type {user.dtype}; it must be ({len(self)},) bool."
            )
        bits = mask_bits(self.directions, self.bsdf_per_sr, MaskLimits() if limits is None else limits)
        return bits | np.where(user, USER.bit, self.mask & USER.bit).astype(np.uint32)

    def equals(self, other: "GonioData") -> bool:
        """True if all arrays, notes and attributes of the two are identical."""
        return all(
            _same(getattr(self, entry.name), getattr(other, entry.name)) for entry in dataclasses.fields(self)
        )

    def card(self) -> Card:
        """Source, scans, points used and notes."""
        return data_card(self.source, self.scans, self.mask, self.sigma_per_sr is not None, self.notes)

    def to_frame(self) -> "pandas.DataFrame":
        """The data as a pandas DataFrame, one line for each point, with the line of the file as index.

        The column ``masked`` names the reasons for which a fit leaves a point out; ``signed_theta_o_deg`` is
        the horizontal axis of figures.
        """
        import pandas

        names = (*_FLOATS[:4], "side", "bsdf_per_sr", "sigma_per_sr")
        columns = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        columns["signed_theta_o_deg"] = self.signed_theta_o_deg
        columns |= {**self.extra, "masked": np.array(mask_names(self.mask))}
        return pandas.DataFrame(columns, index=pandas.Index(self.row, name="row"))

    def to_dataset(self) -> "xarray.Dataset":
        """The data as an xarray Dataset along dimension ``point``.

        Coordinates: theta_i_deg, theta_o_deg, phi_deg [degree], wavelength_nm [nm], is_transmission, row.
        Variables: bsdf_per_sr, sigma_per_sr [1/sr] if known, mask, ``extra_<n>_<name>`` for other columns.
        """
        return netcdf.dataset_of(self)

    @classmethod
    def from_dataset(cls, dataset: "xarray.Dataset", called: str = "the Dataset") -> "GonioData":
        """Inverse of `to_dataset`.

        Parameters
        ----------
        dataset
            The Dataset.
        called
            Name of the Dataset in messages, such as its file.

        Raises
        ------
        InputRefusedError
            If the Dataset has another schema or version, or lacks a variable.
        """
        fields = netcdf.fields_of(dataset, called)
        try:
            return cls(**fields)
        except InputRefusedError as problem:
            # The measurement itself only knows the name of its original file.
            raise problem if called in str(problem) else InputRefusedError(f"{called}: {problem}") from None

    def to_netcdf(self, path: str | Path) -> None:
        """Write a netCDF 4 file for `read_netcdf`, completely or not at all; see `write_dataset`."""
        write_dataset(self.to_dataset(), path)


def _extra_column(values) -> np.ndarray:
    """A read-only copy: floats, or text no wider than its longest entry."""
    values = np.asarray(values)
    if values.dtype.kind in "biuf":
        values = values.astype(np.float64)
    else:
        values = np.array([str(value) for value in values.tolist()])
    values = values.copy()
    values.setflags(write=False)
    return values


def _same(mine, theirs) -> bool:
    if isinstance(mine, np.ndarray) and isinstance(theirs, np.ndarray):
        is_float = mine.dtype.kind == "f" and theirs.dtype.kind == "f"
        return mine.dtype == theirs.dtype and np.array_equal(mine, theirs, equal_nan=is_float)
    if isinstance(mine, Mapping) and isinstance(theirs, Mapping):
        return list(mine) == list(theirs) and all(_same(mine[key], theirs[key]) for key in mine)
    return type(mine) is type(theirs) and mine == theirs


def data_card(
    source: str,
    scans: Sequence[Scan],
    mask: UInt32[ndarray, " points"],
    has_sigma: bool,
    notes: Sequence[str],
) -> Card:
    """Card of a measurement; the parameters are fields of `GonioData`, or derived from them."""
    wavelengths = sorted({scan.wavelength_nm for scan in scans})
    noise = "with standard deviations" if has_sigma else "without standard deviations"
    what = f"{len(mask)} points in {len(scans)} scans, {wavelength_words(wavelengths)}"
    title = f"Measurement {source or 'in memory'}: {what}, {noise}"
    rows = []
    for side in sorted({scan.side for scan in scans}):
        for wavelength_nm in wavelengths:
            here = [s for s in scans if (s.side, s.wavelength_nm) == (side, wavelength_nm)]
            if here:
                points, used = sum(scan.points for scan in here), sum(scan.used for scan in here)
                rows.append([side, f"{wavelength_nm:g}", _incidences(here), str(points), str(used)])
    table = CardTable(["side", "nm", "incidence in degrees", "points", "used"], rows, (0, 2))
    return Card(title, mask_sentences(mask), (table,), notes)


def _incidences(scans: Sequence[Scan]) -> str:
    angles = [f"{scan.theta_i_deg:g}" for scan in scans]
    if len(angles) > _MOST_INCIDENCES:
        return f"{len(angles)} from {angles[0]} to {angles[-1]}"
    return ", ".join(angles)
