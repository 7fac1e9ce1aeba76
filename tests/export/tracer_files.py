"""Readers of the ray tracers' files, written from the formats' descriptions and not from the writers.

Each gives a function ``bsdf(component, towards_source, outgoing)`` of unit vectors in the system of
`analytic_tables`. Keywords are read in any case, with any white space and line ends, comments anywhere.
"""

import csv
import xml.etree.ElementTree as ElementTree

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from tests.ink.analytic_tables import INDEX_INSIDE

KLEMS_FULL = ((0, 1), (5, 8), (15, 16), (25, 20), (35, 24), (45, 24), (55, 24), (65, 16), (75, 12))


def _tokens(path):
    lines = path.read_bytes().decode("ascii").splitlines()
    return [token for line in lines if not line.lstrip().startswith("#") for token in line.split()]


def _polar(direction):
    return np.degrees(np.arccos(np.clip(np.abs(direction[..., 2]), 0, 1)))


def _azimuth(direction):
    return np.degrees(np.arctan2(direction[..., 1], direction[..., 0]))


# Zemax


def read_zemax(path):
    """Header and data of one file."""
    tokens = iter(_tokens(path))
    file = {}
    for token in tokens:
        key = token.lower()
        if key in ("source", "symmetry", "spectralcontent", "scattertype"):
            file[key] = next(tokens).lower()
        elif key in ("samplerotation", "angleofincidence", "scatterazimuth", "scatterradial"):
            file[key] = np.array([float(next(tokens)) for _ in range(int(next(tokens)))])
        elif key == "monochrome":
            assert next(tokens).lower() == "databegin"
            break
        else:
            raise AssertionError(f"keyword {token}")
    assert file["symmetry"] == "planesymmetrical"
    assert file["spectralcontent"] == "monochrome"
    shape = tuple(len(file[axis]) for axis in ("angleofincidence", "scatterazimuth", "scatterradial"))
    values, tis = np.empty(shape), np.empty(shape[0])
    for i in range(shape[0]):
        assert next(tokens).lower() == "tis"
        tis[i] = float(next(tokens))
        values[i] = np.reshape([float(next(tokens)) for _ in range(shape[1] * shape[2])], shape[1:])
    assert next(tokens).lower() == "dataend"
    return {**file, "values": values, "tis": tis}


def zemax(folder, name="ink_550nm"):
    """All four components."""
    files = {c: read_zemax(folder / f"{name}_{c}.bsdf") for c in ("R_II", "T_IA", "T_AI", "R_AA")}
    for component, file in files.items():
        assert file["scattertype"] == ("brdf" if component[0] == "R" else "btdf")
    return _about_specular(files, lambda angle, leaving: leaving)


def _about_specular(files, row_of):
    """BSDF of tables about the specular or refracted direction, with rows by incidence or leaving angle."""

    def bsdf(component, towards_source, outgoing):
        file, index = files[component], {"I": INDEX_INSIDE, "A": 1.0}
        towards_source, outgoing = np.broadcast_arrays(towards_source, outgoing)
        normal = np.array([0, 0, 1.0 if component[3] == "A" else -1.0])
        along = towards_source * [1, 1, 0]
        sine = np.linalg.norm(along, axis=-1, keepdims=True)
        incidence = np.degrees(np.arcsin(np.minimum(sine[..., 0], 1)))
        # At normal incidence the plane of incidence is that of the x axis.
        across = np.where(sine > 1e-9, along / np.maximum(sine, 1e-9), [1.0, 0, 0])
        if component[0] == "T":
            sine = np.minimum(sine * index[component[2]] / index[component[3]], 1)
        cosine = np.sqrt(np.maximum(1 - sine**2, 0))
        specular = cosine * normal - sine * across
        uphill = cosine * across + sine * normal
        cosine_r = np.sum(specular * outgoing, axis=-1)
        radial = np.degrees(np.arccos(np.clip(cosine_r, -1, 1)))
        from_specular = outgoing - cosine_r[..., None] * specular
        sideways = np.cross(specular, uphill)
        azimuth = np.degrees(
            np.arctan2(
                np.abs(np.sum(from_specular * sideways, axis=-1)), np.sum(from_specular * uphill, axis=-1)
            )
        )
        axes = (file["angleofincidence"], file["scatterazimuth"], file["scatterradial"])
        angle = row_of(incidence, np.degrees(np.arcsin(np.minimum(sine[..., 0], 1))))
        points = np.stack([np.minimum(angle, axes[0][-1]), azimuth, radial], axis=-1)
        return RegularGridInterpolator(axes, file["values"])(points)

    bsdf.files = files
    return bsdf


# Integra


def read_integra(path):
    """Axes, values and the refracted angles of a file with one wavelength."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith(";;")]
    words = " ".join(lines).lower().split()
    assert "luminance absolute" in " ".join(words)

    def after(key, n=None):
        start = words.index(key) + 1
        if n is None:
            n, start = int(words[start]), start + 1
        return np.array([float(word) for word in words[start : start + n]])

    sigma, phi, theta = (after(key) for key in ("sigma", "phi", "theta"))
    values = after("def", sigma.size * phi.size * theta.size).reshape(sigma.size, phi.size, theta.size)
    assert words[words.index("def") + 1 + values.size] == "enddef"
    return {
        "angleofincidence": sigma,
        "scatterazimuth": phi,
        "scatterradial": theta,
        "values": values / np.pi,
        "sigmat": after("sigmat", sigma.size) if "sigmat" in words else None,
        "wavelength": after("wl", 1)[0],
    }


def integra(folder, name="ink_550nm"):
    """All four components."""
    files = {
        c: read_integra(folder / f"{name}_{c}.dd{c[0].lower()}") for c in ("R_II", "T_IA", "T_AI", "R_AA")
    }
    return _about_specular(files, lambda angle, leaving: angle)


# LightTools


def read_lighttools(path):
    """Axes, and the blocks by side, scatter type and incidence."""
    tokens = iter(_tokens(path))
    file, block, blocks = {}, {}, {}
    for token in tokens:
        key = token.lower()
        if key in ("symmetry", "spectralcontent"):
            file[key] = next(tokens).lower()
        elif key in ("scatterazimuth", "scatterradial"):
            file[key] = np.array([float(next(tokens)) for _ in range(int(next(tokens)))])
        elif key in ("aoi", "poi", "wavelength"):
            block[key] = float(next(tokens))
        elif key in ("side", "scattertype"):
            block[key] = next(tokens).lower()
        elif key == "tis":
            block["tis"] = float(next(tokens))
            shape = len(file["scatterazimuth"]), len(file["scatterradial"])
            block["values"] = np.reshape([float(next(tokens)) for _ in range(shape[0] * shape[1])], shape)
            blocks.setdefault((block["side"], block["scattertype"]), []).append(block)
            block = {}
        elif key == "dataend":
            break
        else:
            assert key == "databegin", token
    assert (file["symmetry"], file["spectralcontent"]) == ("asymmetric", "monochrome")
    return file, blocks


def lighttools(folder, name="ink_550nm"):
    """All four components."""
    file, blocks = read_lighttools(folder / f"{name}.bsdf")
    sides, kinds = {"I": "back", "A": "front"}, {"R": "brdf", "T": "btdf"}

    def bsdf(component, towards_source, outgoing):
        rows = sorted(blocks[sides[component[2]], kinds[component[0]]], key=lambda row: row["aoi"])
        axes = (np.array([row["aoi"] for row in rows]), file["scatterazimuth"], file["scatterradial"])
        azimuth = (_azimuth(outgoing) - _azimuth(towards_source) + 90) % 360
        points = np.broadcast_arrays(_polar(towards_source), azimuth, _polar(outgoing))
        return RegularGridInterpolator(axes, np.array([row["values"] for row in rows]))(np.stack(points, -1))

    bsdf.blocks = blocks
    return bsdf


# Speos


def read_speos(path):
    """Parts ``R`` and ``T``: incidences, spectrum and tables of intensities."""
    lines = iter(path.read_bytes().decode("ascii").replace("\r\n", "\n").split("\n"))
    assert next(lines).strip() == "OPTIS - Anisotropic BSDF surface file v8.0"
    assert next(lines).strip() == "0"
    next(lines)
    left = int(next(lines))
    while left > 0:
        # The count of characters includes the line ends within the description.
        left -= len(next(lines)) + 1
    assert left == -1
    assert len(next(lines).split()) == 3
    present = [kind for kind, flag in zip("RT", next(lines).split(), strict=True) if int(flag)]
    assert int(next(lines)) == 0
    parts = {}
    for kind in present:
        assert (int(next(lines)), float(next(lines))) == (1, 0.0)
        number = int(next(lines))
        parts[kind] = {"incidence": np.array(next(lines).split(), float)}
        assert len(parts[kind]["incidence"]) == number
    for kind in present:
        parts[kind]["reference"] = float(next(lines).split()[0])
        next(lines)
        number = int(next(lines))
        parts[kind]["spectrum"] = np.array([next(lines).split() for _ in range(number)], float)
    for kind in present:
        tables = []
        for _ in parts[kind]["incidence"]:
            n_theta, n_phi = map(int, next(lines).split())
            parts[kind]["phi"] = np.array(next(lines).split(), float)
            tables.append(np.array([next(lines).split() for _ in range(n_theta)], float))
            assert tables[-1].shape == (n_theta, n_phi + 1)
        parts[kind]["theta"] = tables[0][:, 0]
        parts[kind]["intensity"] = np.array(tables)[:, :, 1:]
    assert next(lines).strip() == "End of file"
    return parts


def speos(folder, name="ink_550nm"):
    """All four components."""
    files = {side: read_speos(folder / f"{name}_{file}.anisotropicbsdf") for side, file in _SPEOS_FILES}

    def bsdf(component, towards_source, outgoing):
        part = files[component[2]][component[0]]
        # X is the way the photon goes along the surface; 180 degrees from the source.
        phi = (_azimuth(outgoing) - _azimuth(towards_source) - 180) % 360
        theta = _polar(outgoing) if component[0] == "R" else 180 - _polar(outgoing)
        with np.errstate(invalid="ignore", divide="ignore"):
            values = part["intensity"] / np.abs(np.cos(np.deg2rad(part["theta"])))[:, None]
        # The horizon has no intensity, from which no BSDF comes back: that of the neighbour.
        horizon = int(np.argmin(np.abs(part["theta"] - 90)))
        values[:, horizon] = values[:, horizon - 1 if component[0] == "R" else horizon + 1]
        points = np.broadcast_arrays(_polar(towards_source), theta, phi)
        axes = (part["incidence"], part["theta"], part["phi"])
        return RegularGridInterpolator(axes, values)(np.stack(points, -1))

    bsdf.files = files
    return bsdf


_SPEOS_FILES = (("I", "inside"), ("A", "outside"))

# Radiance


def read_radiance(path):
    """Structure, and the text of the data by direction."""
    root = ElementTree.parse(path).getroot()
    space = root.tag[: root.tag.index("}") + 1]
    structure = root.find(f".//{space}IncidentDataStructure").text.strip()
    data = {}
    for block in root.iter(f"{space}WavelengthDataBlock"):
        data[block.find(f"{space}WavelengthDataDirection").text.strip()] = block.find(
            f"{space}ScatteringData"
        ).text
    return structure, data


# XML "front" is the back of Radiance; the inside of the plate is the front of Radiance.
_XML = {
    "R_II": "Reflection Back",
    "T_IA": "Transmission Back",
    "R_AA": "Reflection Front",
    "T_AI": "Transmission Front",
}


def klems_patch(direction):
    """Number of the outgoing patch."""
    theta, phi = _polar(direction), _azimuth(direction)
    edges, counts = np.array([edge for edge, _ in KLEMS_FULL]), np.array([n for _, n in KLEMS_FULL])
    ring = np.searchsorted(edges, theta, side="right") - 1
    # Patch 0 of a ring straddles azimuth 0.
    patch = np.floor((phi % 360) / 360 * counts[ring] + 0.5).astype(int) % counts[ring]
    return np.concatenate([[0], np.cumsum(counts)])[ring] + patch


def _tree_value(node, point):
    while isinstance(node, list):
        upper = [int(x >= 0.5) for x in point]
        node = node[upper[0] + 2 * upper[1] + 4 * upper[2]]
        point = [2 * x - u for x, u in zip(point, upper, strict=True)]
    size = round(len(node) ** (1 / 3))
    i, j, k = (min(int(x * size), size - 1) for x in point)
    return node[(i * size + j) * size + k]


def _tree(text):
    """Nested lists down to arrays of values."""
    stack = [[]]
    for token in text.replace("{", " { ").replace("}", " } ").split():
        if token == "{":
            stack.append([])
        elif token == "}":
            done = stack.pop()
            stack[-1].append(np.array(done, float) if not isinstance(done[0], (list, np.ndarray)) else done)
        else:
            stack[-1].append(token)
    ((root,),) = stack
    return root


def _disc_to_square(x, y):
    """Inverse of the map of Shirley and Chiu, by sectors of 90 degrees."""
    radius, angle = np.hypot(x, y), np.degrees(np.arctan2(y, x))
    sector = int(np.floor((angle + 45) / 90)) % 4
    along = radius * ((angle + 45) % 90 - 45) / 45
    a, b = ((radius, along), (-along, radius), (-radius, -along), (along, -radius))[sector]
    return (a + 1) / 2, (b + 1) / 2


def radiance(folder, name="ink_550nm"):
    """All four components, of either basis."""
    structure, data = read_radiance(folder / f"{name}.xml")
    parsed = {
        component: np.array(data[direction].split(), float).reshape(145, 145)
        if structure == "Columns"
        else _tree(data[direction])
        for component, direction in _XML.items()
    }

    def from_tree(component, towards_source, outgoing):
        towards_source, outgoing = np.broadcast_arrays(towards_source, outgoing)
        values = []
        for source, out in zip(towards_source.reshape(-1, 3), outgoing.reshape(-1, 3), strict=True):
            turn = np.deg2rad(-_azimuth(-source))
            x, y = (
                np.cos(turn) * out[0] - np.sin(turn) * out[1],
                np.sin(turn) * out[0] + np.cos(turn) * out[1],
            )
            point = (0.5 - 1e-9 - 0.5 * np.hypot(source[0], source[1]), *_disc_to_square(x, y))
            values.append(_tree_value(parsed[component], [min(max(p, 0), 1 - 1e-12) for p in point]))
        return np.reshape(values, outgoing.shape[:-1])

    def from_matrix(component, towards_source, outgoing):
        opposite = np.asarray(towards_source) * [-1, -1, 1]
        return parsed[component][klems_patch(outgoing), klems_patch(opposite)]

    return from_matrix if structure == "Columns" else from_tree


# CSV


def read_csv(path):
    """Columns by name, comments left out."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {
        name: [row[name] for row in rows]
        if name == "component"
        else np.array([float(row[name]) for row in rows])
        for name in rows[0]
    }


def flat_csv(folder, name="ink"):
    """All four components at the first wavelength."""
    columns = read_csv(folder / f"{name}_bsdf.csv")

    def bsdf(component, towards_source, outgoing):
        first = columns["wavelength_nm"][0]
        chosen = (np.array(columns["component"]) == component) & (columns["wavelength_nm"] == first)
        axes = [np.unique(columns[axis]) for axis in ("theta_i_deg", "theta_o_deg", "phi_deg")]
        shape = [len(axis) for axis in axes]
        positions = [
            np.searchsorted(axis, columns[name][chosen])
            for axis, name in zip(axes, ("theta_i_deg", "theta_o_deg", "phi_deg"), strict=True)
        ]
        values = np.full(shape, np.nan)
        values[tuple(positions)] = columns["bsdf_per_sr"][chosen]
        phi = np.abs((_azimuth(outgoing) - _azimuth(towards_source) + 180) % 360 - 180)
        points = np.broadcast_arrays(_polar(towards_source), _polar(outgoing), phi)
        return RegularGridInterpolator(axes, values)(np.stack(points, -1))

    return bsdf
