"""The container of the EPFL RGL material database: named arrays in one binary file.

Known from Mitsuba's documentation and from EPFL's open loader (rgl-epfl/brdf-loader): twelve bytes of name,
two of version, the number of fields, and for each field its name, type, place and shape, little-endian.
"""

import math
import struct

import numpy as np

from jaxink.measurement.formats.content import Content, shown

SIGNATURE = b"tensor_file\0"
_TYPES = ("", "u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8")
_MOST_PADDING = 64
_MOST_FIELDS, _MOST_DIMENSIONS, _LONGEST_NAME = 100, 10, 200


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
