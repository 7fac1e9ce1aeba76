"""Binary files of the MERL BRDF database.

Known from the reader that MERL publishes with the database, as quoted by many open programs, and from the one
of libbsdf: isotropic reflection in half and difference angles, three channels. Values at a regular grid of
directions are read by the lookup of MERL's reader, the cell that the direction is in.
"""

import struct

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.formats.content import Content
from jaxink.measurement.formats.exchange_options import ExchangeOptions, required
from jaxink.measurement.formats.points import FilePoints

_SHAPE = (90, 90, 180)
_HEADER = struct.pack("<3i", *_SHAPE)
_CHANNELS = ("R", "G", "B")
_SCALE = {"R": 1.0 / 1500, "G": 1.15 / 1500, "B": 1.66 / 1500}
_BYTES = len(_HEADER) + 3 * 8 * 90 * 90 * 180
# Closer to grazing, the measurements are not reliable.
_LARGEST_THETA_DEG = 80.0
_STEP_DEG = 5


def recognises(head: str) -> bool:
    """Whether a file starts with the sizes of MERL's tables."""
    return head[: len(_HEADER)].encode("latin-1") == _HEADER


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of a grid of directions, for one channel."""
    if len(content.data) != _BYTES:
        text = f"has {len(content.data)} bytes; one of MERL has {_BYTES}; it is incomplete, or another file"
        raise content.refusal(text)
    why = "the values are the channels R, G and B, of which one is read"
    channel = required(content.source, choices, "channel", why).upper()
    if channel not in _CHANNELS:
        raise content.refusal(f"channel is {choices.channel!r}; it must be R, G or B")
    why = "the values are those of a colour channel and state no wavelength"
    wavelength = required(content.source, choices, "wavelength_nm", why)
    size = _SHAPE[0] * _SHAPE[1] * _SHAPE[2]
    offset = len(_HEADER) + 8 * size * _CHANNELS.index(channel)
    table = np.frombuffer(content.data, "<f8", size, offset).reshape(_SHAPE)
    step = _STEP_DEG if choices.every is None else choices.every
    polar = np.arange(0.0, _LARGEST_THETA_DEG + 1e-6, step)
    theta_i, theta_o, phi = np.meshgrid(polar, polar, np.arange(0.0, 180.0 + 1e-6, step), indexing="ij")
    # Along the normal, all azimuths are one direction.
    once = (theta_o > 0) | (phi == 0)
    theta_i, theta_o, phi = theta_i[once], theta_o[once], phi[once]
    values = table[_cells(theta_i, theta_o, phi)]
    valid = np.isfinite(values) & (values >= 0)
    notes.append(
        f"MERL: channel {channel} at {wavelength:g} nm, as stated by the caller, in steps of {step} degrees "
        f"up to {_LARGEST_THETA_DEG:g}; each value is that of the table's cell."
    )
    if not valid.all():
        notes.append(f"{int((~valid).sum())} directions without a valid value were left out.")
    n = int(valid.sum())
    return FilePoints(
        theta_i_deg=theta_i[valid],
        theta_o_deg=theta_o[valid],
        phi_deg=phi[valid],
        wavelength_nm=np.full(n, wavelength),
        is_transmission=np.zeros(n, bool),
        bsdf_per_sr=_SCALE[channel] * values[valid],
        row=np.arange(1, n + 1),
    )


def _cells(
    theta_i_deg: Float[np.ndarray, " points"],
    theta_o_deg: Float[np.ndarray, " points"],
    phi_deg: Float[np.ndarray, " points"],
) -> tuple[Int[np.ndarray, " points"], Int[np.ndarray, " points"], Int[np.ndarray, " points"]]:
    """Cell of each direction: half angle, difference angle and its azimuth."""
    i, o, phi = (np.deg2rad(angle) for angle in (theta_i_deg, theta_o_deg, phi_deg))
    source = np.stack([np.sin(i), np.zeros_like(i), np.cos(i)])
    view = np.stack([np.sin(o) * np.cos(phi), np.sin(o) * np.sin(phi), np.cos(o)])
    half = source + view
    half /= np.linalg.norm(half, axis=0)
    theta_h = np.arccos(np.clip(half[2], -1, 1))
    phi_h = np.arctan2(half[1], half[0])
    # The source, turned so that the half direction becomes the normal.
    x = source[0] * np.cos(phi_h) + source[1] * np.sin(phi_h)
    y = source[1] * np.cos(phi_h) - source[0] * np.sin(phi_h)
    x, z = (
        x * np.cos(theta_h) - source[2] * np.sin(theta_h),
        x * np.sin(theta_h) + source[2] * np.cos(theta_h),
    )
    theta_d = np.arccos(np.clip(z, -1, 1))
    # Opposite azimuths are the two orders of source and view, which are reciprocal.
    phi_d = np.mod(np.arctan2(y, x), np.pi)
    cells = (np.sqrt(np.rad2deg(theta_h) * 90), np.rad2deg(theta_d), np.rad2deg(phi_d))
    # Rounding must not put a direction at the edge of a cell into the one before.
    first, second, third = (
        np.clip(np.floor(cell + 1e-9).astype(int), 0, size - 1)
        for cell, size in zip(cells, _SHAPE, strict=True)
    )
    return first, second, third
