"""Seeded faults: what disks, editors, other programs and curious people do to files."""

import json
import re
from copy import deepcopy
from random import Random
from typing import Any

import h5py
import numpy as np

# In place of a value of a TOML file.
ABSURD_TOML = (
    "0",
    "1",
    "0.5",
    "1.5",
    "100",
    "550",
    "1e6",
    "nan",
    "-inf",
    "1e400",
    "-0.0",
    "1e-320",
    "1e308",
    "-1e308",
    "1" * 400,
    "1" * 5000,
    "0x" + "f" * 5000,
    str(2**63),
    "9" * 18,
    "true",
    '""',
    '"x"',
    '"=1+1"',
    r'"\u0000"',
    r'"\ud7ff\U0010ffff"',
    '"' + "x" * 20_000 + '"',
    "'''\n\n'''",
    "[]",
    "{}",
    "[{}]",
    "[[1, 2], [3]]",
    "[1, [2, [3]]]",
    "[" * 900 + "]" * 900,
    "{ a = " * 900 + "1" + "}" * 900,
    "[" + "0.5, " * 5000 + "]",
    "[1e308, 1e308, nan]",
    "{ value = 1 }",
    "{ value = nan, free = true, min = 1, max = 2 }",
    "{ free = true, min = 1, max = 1.0000000000000002 }",
    "{ free = true, min = -1e308, max = 1e308 }",
    "{ per_wavelength = true, value = [1, 2, 3] }",
    '{ tie = "9**9**9**9" }',
    '{ tie = "' + "-" * 20_000 + '1" }',
    '{ tie = "ink.thickness_um" }',
    '{ tie = "0 * ink.thickness_um + 0.5" }',
    '{ dispersion = "cauchy", a = 1.5, b_um2 = { free = true, min = -1, max = 1 } }',
    '{ dispersion = "sellmeier", b1 = 1.3, c1_um2 = 0.3025 }',
    '{ dispersion = "table", wavelength_nm = [400, 400], value = [1.5, 1.5] }',
    '{ density = "height_map", heights_um = "/dev/zero", pitch_um = 1 }',
    '{ density = "height_map", heights_um = "\\u0000.npy", pitch_um = 1 }',
    '{ spectrum = "gaussian", height_rms_um = 1e-300, correlation_length_um = 1e6 }',
    "1979-05-27T07:32:00Z",
    "07:32:00.999999",
    "a",
    "",
)
# In place of a cell.
ABSURD_CELLS = (
    "",
    " ",
    "nan",
    "-inf",
    "1e400",
    "1e308",
    "-1e308",
    "1e-320",
    "-0.0",
    "1" * 400,
    "1" * 5000,
    "1" * 200_000,
    "1_0",
    "0x10",
    "\uff11\uff12",
    "\u0661",
    "1,5",
    '"',
    '"1\n2"',
    "\0",
    "\u2028",
    "=1+1",
    "R",
    "T",
    "true",
    "None",
    "#",
    "\ufeff1",
    "x" * 1000,
    "\U0010ffff",
    "wavelength_nm",
    "sample",
    "theta_i_rad",
)
# In place of a value of a JSON file.
ABSURD_JSON = (
    None,
    True,
    False,
    0,
    -1,
    10**6,
    10**400,
    -(2**63),
    0.5,
    1e308,
    -0.0,
    float("nan"),
    float("inf"),
    "",
    "x",
    "\0",
    "x" * 20_000,
    "../../etc/passwd",
    "/dev/zero",
    "9**9**9**9",
    [],
    {},
    [[]],
    [None],
    [1, 2, 3],
    [[1, 2], [3]],
    {"a": {"b": {}}},
    {"value": 1},
)


def bytes_of(content: bytes, random: Random) -> bytes:
    """Bytes flipped, lost, doubled, overwritten or put in."""
    content = bytearray(content)
    for _ in range(random.choice((1, 1, 1, 2, 5, 30))):
        at = random.randrange(len(content) + 1)
        length = min(random.choice((1, 1, 2, 8, 64, 1000)), len(content) - at)
        match random.randrange(7):
            case 0 if at < len(content):
                content[at] ^= 1 << random.randrange(8)
            case 1 if at < len(content):
                content[at] = random.randrange(256)
            case 2:
                del content[at : at + length]
            case 3:
                content[at:at] = content[at : at + length] * random.choice((1, 1, 100))
            case 4:
                content[at : at + length] = random.randbytes(length)
            case 5:
                del content[at:]
            case 6:
                content[at:at] = random.choice(
                    (b"\0", b"\xff", b"\xef\xbb\xbf", b"[" * 50, b'"', b"\r", b",", b"9" * 50)
                )
    return bytes(content)


def lines_of(text: str, random: Random) -> str:
    """Lines lost, doubled, exchanged or joined."""
    lines = text.split("\n")
    for _ in range(random.choice((1, 1, 3))):
        one, other = (random.randrange(len(lines)) for _ in range(2))
        match random.randrange(5):
            case 0:
                del lines[one]
            case 1:
                lines.insert(other, lines[one])
            case 2:
                lines[one], lines[other] = lines[other], lines[one]
            case 3:
                lines[one] += lines[other]
            case 4:
                lines[one:one] = lines[one : one + 20] * 50
        lines = lines or [""]
    return "\n".join(lines)


def toml(text: str, random: Random) -> bytes:
    """A TOML file with values, keys, lines or bytes changed."""
    for _ in range(random.choice((1, 1, 2, 4))):
        kind = random.randrange(6)
        if kind <= 2 and (values := list(re.finditer(r"(?<== )[^\n,}]+", text))):
            value = random.choice(values)
            text = text[: value.start()] + random.choice(ABSURD_TOML) + text[value.end() :]
        elif kind == 3 and (keys := list(re.finditer(r"\w+(?= = )", text))):
            key, other = random.choice(keys), random.choice(keys)[0]
            new = random.choice(
                (other, "a." * 2000 + "a", "x" * 3000, '""', '"\\n"', f"{other}.{key[0]}", key[0][:-1])
            )
            text = text[: key.start()] + new + text[key.end() :]
        elif kind == 4:
            text = lines_of(text, random)
        elif kind == 5:
            return bytes_of(text.encode(), random)
    return text.encode()


def csv(text: str, random: Random) -> bytes:
    """A CSV file with cells, columns, lines or bytes changed."""
    for _ in range(random.choice((1, 1, 2, 4))):
        rows = [line.split(",") for line in text.rstrip("\n").split("\n")]
        kind = random.randrange(7)
        if kind <= 1:
            row = random.choice(rows)
            row[random.randrange(len(row))] = random.choice(ABSURD_CELLS)
        elif kind == 2:
            column, cell = random.randrange(len(rows[0])), random.choice(ABSURD_CELLS)[:5000]
            for row in rows[random.randrange(2) :]:
                row[column % len(row)] = cell
        elif kind == 3:
            column, other = random.randrange(len(rows[0])), random.randrange(len(rows[0]))
            for row in rows:
                if random.random() < 0.999:
                    row.insert(other, row[column % len(row)])
        elif kind == 4:
            column = random.randrange(len(rows[0]))
            for row in rows:
                del row[column % len(row)]
            rows = [row or [""] for row in rows]
        text = "\n".join(",".join(row) for row in rows) + "\n"
        if kind == 5:
            text = lines_of(text, random)
        elif kind == 6:
            content = bytes_of(text.encode(), random)
            return content.replace(b",", random.choice((b",", b";", b"\t", b" ")))
    return text.encode("utf-8", "surrogatepass")


def json_text(plain: Any, random: Random) -> bytes:
    """A JSON file with keys lost, renamed or new, and values exchanged, nested or absurd."""
    plain = deepcopy(plain)
    for _ in range(random.choice((1, 1, 2, 4))):
        if not plain:
            break
        inner, key = _place(plain, random)
        kind = random.randrange(8)
        if kind <= 3:
            inner[key] = deepcopy(random.choice(ABSURD_JSON))
        elif kind == 4:
            del inner[key]
        elif kind == 5:
            other, there = _place(plain, random)
            inner[key] = deepcopy(other[there])
        elif kind == 6 and isinstance(inner, dict):
            inner[random.choice(("x", "", f"{key}s", "schema"))] = (
                inner.pop(key) if random.random() < 0.5 else 1
            )
        elif isinstance(inner, list):
            inner.insert(random.randrange(len(inner) + 1), deepcopy(inner[key]))
    text = json.dumps(plain)
    match random.randrange(12):
        case 0:
            return bytes_of(text.encode(), random)
        case 1:
            return text.replace("0", "1" * random.choice((400, 5000)), 1).encode()
        case 2:
            return (random.choice(("[", '{"a":')) * 5000 + text).encode()
    return text.encode()


def _place(plain: Any, random: Random) -> tuple[Any, Any]:
    """A container within, and one of its keys."""
    places = [(plain, key) for key in plain]
    place = random.choice(places)
    while random.random() < 0.7:
        inner = place[0][place[1]]
        if not isinstance(inner, dict | list) or not inner:
            break
        keys = list(inner) if isinstance(inner, dict) else range(len(inner))
        place = inner, random.choice(keys)
    return place


def netcdf(path, random: Random) -> None:
    """A netCDF file with bytes, or variables and attributes, changed in place."""
    if random.random() < 0.4:
        path.write_bytes(bytes_of(path.read_bytes(), random))
        return
    with h5py.File(path, "r+") as file:
        for _ in range(random.choice((1, 1, 2))):
            _change_hdf(file, random)


def _change_hdf(file: h5py.File, random: Random) -> None:
    names = list(file)
    if not names:
        return
    name = random.choice(names)
    if file[name].size > 10**6:
        return
    attrs = random.choice((file.attrs, file[name].attrs))
    kind = random.randrange(8)
    if kind == 0:
        del file[name]
    elif kind == 1 and len(attrs):
        del attrs[random.choice(list(attrs))]
    elif kind == 2 and len(attrs):
        value = random.choice((np.nan, -1, 10**9, "", "x", "[", "{}", "null", [1.0, 2.0], b"\xff"))
        attrs[random.choice(list(attrs))] = value
    elif kind == 3:
        new = random.choice(("x", "extra_x", "extra_99999999999999999999_", "extra_1_a", "sigma_per_sr_"))
        if new not in file:
            file.move(name, new)
    else:
        shape = file[name].shape
        del file[name]
        match kind:
            case 4:
                # 745 GiB, of which the file holds none.
                file.create_dataset(name, (10**11,), float, chunks=(10**4,))
            case 5:
                file[name] = np.full(
                    tuple(max(n - 1, 0) for n in shape) or (1,), random.choice((np.nan, 1e308, 0.0))
                )
            case 6:
                file[name] = np.full(shape, random.choice((np.nan, np.inf, -1.0, 1e308)))
            case 7:
                file.create_dataset(name, shape, h5py.string_dtype())
