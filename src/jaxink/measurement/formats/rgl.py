"""Files of the EPFL RGL material database, adaptive tensors (Dupuy and Jakob 2018 ACM Trans. Graph. 37, 274).

Known from the article and from EPFL's open loader (rgl-epfl/brdf-loader), with which the values agree. The
directions are those at which the file has values; nothing is interpolated but the wavelength.

The container of the EPFL RGL material database: named arrays in one binary file.

Known from Mitsuba's documentation and from EPFL's open loader (rgl-epfl/brdf-loader): twelve bytes of name,
two of version, the number of fields, and for each field its name, type, place and shape, little-endian.

A density on the unit square, given at a grid, and the map that turns uniform points into it.

The density is bilinear between the entries (Dupuy and Jakob 2018 ACM Trans. Graph. 37, 274, section 5).
"""

import math
import struct

import numpy as np
from jaxtyping import Float

from jaxink.measurement.formats.content import Content, shown
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.points import FilePoints, joined
from jaxink.measurement.formats.polar_tables import lone_values

# Closer to the horizon, the cosine by which values are divided is too small.
_LARGEST_THETA_DEG = 89.0
_CHANNELS = ("R", "G", "B")
SIGNATURE = b"tensor_file\0"
_TYPES = ("", "u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8")
_MOST_PADDING = 64
_MOST_FIELDS, _MOST_DIMENSIONS, _LONGEST_NAME = 100, 10, 200


def recognises(head: str) -> bool:
    """Whether a file is a tensor file."""
    return head.startswith(SIGNATURE.decode())


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points at which the file has values, at one wavelength."""
    fields = _checked(content, read_fields(content))
    wavelength = _wavelength(content, fields, choices)
    values = _at_wavelength(content, fields, wavelength, choices, notes)
    theta_i, phi_i = fields["theta_i"].astype(float), fields["phi_i"].astype(float)
    # Of an isotropic sample, one azimuth stands for all.
    rotation = 0 if phi_i.size <= 2 else _rotation(content, np.rad2deg(phi_i), choices)
    is_isotropic = phi_i.size <= 2
    every = choices.every or 1
    parts = []
    for k in range(0, theta_i.size, every):
        angles = float(theta_i[k]), 0.0 if is_isotropic else float(phi_i[rotation])
        parts.append(_points(fields, (rotation, k), angles, values[rotation, k], wavelength, every))
    notes.append(
        "RGL: the values hold the cosine of the view and were divided by it; "
        f"directions beyond {_LARGEST_THETA_DEG:g} degrees were left out."
    )
    return joined(parts)


def _checked(content: Content, fields: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The fields of a material, with shapes that belong together."""
    if "rgb" not in fields and "spectra" not in fields:
        raise content.refusal("is a tensor file, but holds no material (no field spectra or rgb)")
    table = "spectra" if "spectra" in fields else "rgb"
    dimensions = {"theta_i": 1, "phi_i": 1, "ndf": 2, "sigma": 2, "vndf": 4, table: 5}
    if table == "spectra":
        dimensions["wavelengths"] = 1
    for name, n in dimensions.items():
        if name not in fields:
            raise content.refusal(f"is a tensor file without the field {name}, which a material has")
        array = fields[name]
        if array.ndim != n or array.dtype != np.float32 or min(array.shape) < 1:
            text = f"the field {name} has shape {array.shape} and type {array.dtype}; it must have"
            raise content.refusal(f"{text} {n} dimensions of 32-bit numbers")
        if not np.isfinite(array).all():
            raise content.refusal(f"the field {name} has values that are not finite")
    axes = fields["phi_i"].size, fields["theta_i"].size
    n_channels = fields["wavelengths"].size if table == "spectra" else len(_CHANNELS)
    for name, leading in (("vndf", axes), (table, (*axes, n_channels))):
        array = fields[name]
        if array.shape[: len(leading)] != leading or min(array.shape[-2:]) < 2:
            raise content.refusal(
                f"the field {name} has shape {array.shape}, which does not belong to its axes"
            )
    for name in ("ndf", "sigma"):
        if min(fields[name].shape) < 2:
            raise content.refusal(f"the field {name} has shape {fields[name].shape}; it must be a table")
    if (fields["vndf"] < 0).any() or (fields["vndf"].sum(axis=(-1, -2)) <= 0).any():
        raise content.refusal("the field vndf is no density: it must be positive")
    # Its share of the total says which directions the values belong to.
    if any(lone_values(table).size for table in fields["vndf"].reshape(-1, *fields["vndf"].shape[-2:])):
        raise content.refusal("the field vndf has a value that exceeds all others together; it is damaged")
    if (fields["theta_i"] < 0).any() or (fields["theta_i"] > np.pi / 2).any():
        raise content.refusal("the field theta_i must be between 0 and pi / 2")
    return fields


def _wavelength(content: Content, fields: dict[str, np.ndarray], choices: ExchangeOptions) -> float:
    """The wavelength to read; between those of a spectrum, values are interpolated."""
    nm = choices.wavelength_nm
    if "spectra" not in fields:
        if nm is None:
            why = "the values are those of a colour channel and state no wavelength"
            raise ask(content.source, "wavelength_nm", why)
        return nm
    axis = fields["wavelengths"].astype(float)
    if (np.diff(axis) <= 0).any():
        raise content.refusal("the wavelengths must ascend")
    span = f"{axis[0]:g} to {axis[-1]:g} nm"
    if nm is None:
        why = f"the file has {axis.size} wavelengths from {span}, of which one is read"
        raise ask(content.source, "wavelength_nm", why)
    if not axis[0] <= nm <= axis[-1]:
        raise content.refusal(f"wavelength_nm is {nm:g}; the file has {span}")
    return nm


def _at_wavelength(
    content: Content,
    fields: dict[str, np.ndarray],
    wavelength_nm: float,
    choices: ExchangeOptions,
    notes: list[str],
) -> Float[np.ndarray, "phi theta m m"]:
    if "spectra" not in fields:
        if choices.channel is None:
            raise ask(
                content.source, "channel", "the values are the channels R, G and B, of which one is read"
            )
        channel = choices.channel.upper()
        if channel not in _CHANNELS:
            raise content.refusal(f"channel is {choices.channel!r}; it must be R, G or B")
        notes.append(
            f"Channel {channel} is read as the BSDF at {wavelength_nm:g} nm, as stated by the caller."
        )
        return fields["rgb"][:, :, _CHANNELS.index(channel)].astype(float)
    if choices.channel is not None:
        raise content.refusal("the file has a spectrum, not channels; leave out the channel")
    axis, spectra = fields["wavelengths"].astype(float), fields["spectra"]
    upper = min(int(np.searchsorted(axis, wavelength_nm)), axis.size - 1)
    lower = max(upper - 1, 0)
    step = axis[upper] - axis[lower]
    weight = (wavelength_nm - axis[lower]) / step if step > 0 else 0.0
    return (1 - weight) * spectra[:, :, lower].astype(float) + weight * spectra[:, :, upper].astype(float)


def _rotation(content: Content, phi_i_deg: np.ndarray, choices: ExchangeOptions) -> int:
    listed = ", ".join(f"{angle:g}" for angle in phi_i_deg)
    if choices.rotation_deg is None:
        why = f"the azimuths of the source are {listed} degrees, of which one is read"
        raise ask(content.source, "rotation_deg", why)
    near = int(np.argmin(np.abs(phi_i_deg - choices.rotation_deg)))
    if abs(phi_i_deg[near] - choices.rotation_deg) > 0.01:
        raise content.refusal(f"rotation_deg is {choices.rotation_deg:g}; the file has {listed}")
    return near


def _points(
    fields: dict[str, np.ndarray],
    place: tuple[int, int],
    angles: tuple[float, float],
    values: Float[np.ndarray, "m m"],
    wavelength_nm: float,
    every: int,
) -> FilePoints:
    """The points of one incidence: each value belongs to a facet, which turns the source into the view."""
    theta_i, phi_i = angles
    ny, nx = values.shape
    # The last row is the first one after a turn, and the first column the normal of the facets.
    y, x = np.meshgrid(np.arange(0, ny - 1, every), np.arange(0, nx, every), indexing="ij")
    once = (x > 0) | (y == 0)
    y, x = y[once], x[once]
    u, v = warped(fields["vndf"][place], x / (nx - 1), y / (ny - 1))
    theta_m, phi_m = u**2 * np.pi / 2, (2 * v - 1) * np.pi - phi_i
    facet = np.stack([np.sin(theta_m) * np.cos(phi_m), np.sin(theta_m) * np.sin(phi_m), np.cos(theta_m)])
    source = np.array([np.sin(theta_i), 0.0, np.cos(theta_i)])
    view = 2 * (source @ facet) * facet - source[:, None]
    theta_o = np.rad2deg(np.arccos(np.clip(view[2], -1, 1)))
    density = interpolated(fields["ndf"].astype(float), u, v)
    own = np.array([np.sqrt(theta_i * 2 / np.pi)]), np.array([(phi_i + np.pi) / (2 * np.pi)])
    area = interpolated(fields["sigma"].astype(float), *own)[0]
    keep = (theta_o <= _LARGEST_THETA_DEG) & (source @ facet > 0) & (area > 0)
    bsdf = values[y, x] * density / (4 * area if area > 0 else 1) / np.where(keep, view[2], 1)
    n = int(keep.sum())
    return FilePoints(
        # Of 32-bit radians.
        theta_i_deg=np.full(n, np.round(np.rad2deg(theta_i), 5)),
        theta_o_deg=theta_o[keep],
        phi_deg=np.rad2deg(np.arctan2(view[1], view[0]))[keep],
        wavelength_nm=np.full(n, wavelength_nm),
        is_transmission=np.zeros(n, bool),
        bsdf_per_sr=bsdf[keep],
        row=1 + np.flatnonzero(keep),
    )


def read_fields(content: Content) -> dict[str, np.ndarray]:
    """The arrays by their names; they are views of the content.

    Raises
    ------
    InputRefusedError
        If the file is incomplete, or not such a container.
    """
    source = _Bytes(content, len(SIGNATURE))
    if source.take("<2B", "the version") != (1, 0):
        raise content.refusal("has an unknown version of the tensor format; only 1.0 is known")
    (n_fields,) = source.take("<I", "the number of fields")
    if n_fields > _MOST_FIELDS:
        raise content.refusal(f"states {n_fields} fields; at most {_MOST_FIELDS} are allowed")
    fields = [_field(source, content) for _ in range(n_fields)]
    # Fields are aligned, so a few bytes may be between them and behind the last one.
    end = max((end for _, _, end in fields), default=len(content.data))
    if len(content.data) - max(end, source.place) > _MOST_PADDING:
        text = f"has {len(content.data)} bytes, but its fields end at {end}; it holds more than it states"
        raise content.refusal(text)
    return {name: array for name, array, _ in fields}


class _Bytes:
    """Bytes from one place on."""

    def __init__(self, content: Content, start: int):
        self.content, self._next = content, start

    @property
    def place(self) -> int:
        """Of the next byte."""
        return self._next

    def take(self, form: str, what: str) -> tuple:
        size = struct.calcsize(form)
        if self._next + size > len(self.content.data):
            raise self.content.refusal(f"the file ends within {what}; it is incomplete")
        self._next += size
        return struct.unpack_from(form, self.content.data, self._next - size)


def _field(source: _Bytes, content: Content) -> tuple[str, np.ndarray, int]:
    """Name and array of the next field, and the place where it ends."""
    (length,) = source.take("<H", "the header of a field")
    if length > _LONGEST_NAME:
        raise content.refusal(f"the name of a field has {length} characters; the file is damaged")
    (name,) = source.take(f"<{length}s", "the name of a field")
    name = name.decode("latin-1")
    n_dimensions, kind, offset = source.take("<HBQ", f"the header of the field {shown(name)}")
    if n_dimensions > _MOST_DIMENSIONS or not 0 < kind < len(_TYPES):
        raise content.refusal(f"the header of the field {shown(name)} is damaged")
    shape = source.take(f"<{n_dimensions}Q", f"the shape of the field {shown(name)}")
    dtype = np.dtype("<" + _TYPES[kind])
    size = math.prod(shape)
    if offset + size * dtype.itemsize > len(content.data):
        text = (
            f"the field {shown(name)} needs bytes up to {offset + size * dtype.itemsize}, but the file has "
        )
        raise content.refusal(f"{text}{len(content.data)}; it is incomplete")
    array = np.frombuffer(content.data, dtype, size, offset).reshape(shape)
    return name, array, offset + size * dtype.itemsize


def warped(
    density: Float[np.ndarray, "ny nx"], x: Float[np.ndarray, " points"], y: Float[np.ndarray, " points"]
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Points with the given density, of uniform points (x, y) of the unit square.

    The row is chosen by y from the density of all rows, then the column by x from the density along that row.
    """
    density = np.asarray(density, float)
    row_powers = (density[:, :-1] + density[:, 1:]).sum(axis=1) / 2
    row, v = _inverse_cdf(np.broadcast_to(row_powers, (y.size, row_powers.size)), y)
    along = (1 - v)[:, None] * density[row] + v[:, None] * density[row + 1]
    column, u = _inverse_cdf(along, x)
    ny, nx = density.shape
    return (column + u) / (nx - 1), (row + v) / (ny - 1)


def interpolated(
    table: Float[np.ndarray, "ny nx"], x: Float[np.ndarray, "*points"], y: Float[np.ndarray, "*points"]
) -> Float[np.ndarray, "*points"]:
    """A table over the unit square between its entries, bilinearly."""
    ny, nx = table.shape
    column, row = (np.clip(np.floor(p * (n - 1)).astype(int), 0, n - 2) for p, n in ((x, nx), (y, ny)))
    u, v = x * (nx - 1) - column, y * (ny - 1) - row
    below = (1 - u) * table[row, column] + u * table[row, column + 1]
    above = (1 - u) * table[row + 1, column] + u * table[row + 1, column + 1]
    return (1 - v) * below + v * above


def _inverse_cdf(nodes: Float[np.ndarray, "points nodes"], share: Float[np.ndarray, " points"]):
    """Interval, and place within it, up to which a piecewise linear density holds the given share."""
    steps = (nodes[:, :-1] + nodes[:, 1:]) / 2
    cumulative = np.concatenate([np.zeros((len(nodes), 1)), np.cumsum(steps, axis=1)], axis=1)
    wanted = np.clip(share, 0, 1) * cumulative[:, -1]
    interval = np.clip((cumulative[:, 1:] < wanted[:, None]).sum(axis=1), 0, steps.shape[1] - 1)
    points = np.arange(len(nodes))
    first, last = nodes[points, interval], nodes[points, interval + 1]
    rest = wanted - cumulative[points, interval]
    # Of first t + (last - first) t^2 / 2 = rest, the root within the interval, without cancellation.
    root = np.sqrt(np.maximum(first**2 + 2 * rest * (last - first), 0))
    total = first + root
    place = np.where(total > 0, 2 * rest / np.where(total > 0, total, 1), 0.0)
    return interval, np.clip(place, 0, 1)
