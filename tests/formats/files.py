"""Small files of each format, written from its description and not by the exporter or for the reader.

Values are those of `bsdf`, by the canonical directions: azimuth 0 towards the source.
"""

import numpy as np


def bsdf(theta_i, theta_o, phi, side="R"):
    """Different in every direction but for the mirror image, and below 1 in total."""
    i, o = np.deg2rad(theta_i), np.deg2rad(theta_o)
    along = np.sin(o) * np.cos(np.deg2rad(phi))
    return 0.1 * (2 if side == "R" else 1) * (1 + 0.3 * np.cos(o) - (0.4 + 0.2 * np.sin(i)) * along)


def lines(*parts):
    """Text of rows; arrays are rows of numbers."""
    return (
        "\n".join(p if isinstance(p, str) else " ".join(f"{v:.12g}" for v in np.ravel(p)) for p in parts)
        + "\n"
    )


def specular_to_normal(angle, radial, azimuth):
    """Turn the pole of scatter angles into the specular direction by a rotation about the y axis."""
    r, a, t = np.deg2rad([radial, azimuth, angle])
    v = np.array([np.sin(r) * np.cos(a), np.sin(r) * np.sin(a), np.cos(r)])
    turn = np.array([[np.cos(t), 0, -np.sin(t)], [0, 1, 0], [np.sin(t), 0, np.cos(t)]])
    x, y, z = turn @ v
    return np.degrees(np.arccos(np.clip(z, -1, 1))), np.degrees(np.arctan2(y, x))


def zemax(
    side="R",
    incidences=(0, 30, 60),
    symmetry="PlaneSymmetrical",
    rotations=(0,),
    channels=None,
    weighted=False,
):
    """A BSDF file of Zemax; ``channels`` are factors by tristimulus, ``weighted`` values hold the cosine."""
    radial = np.array([0, 15, 40, 75, 110, 150])
    azimuth = np.arange(0, 181, 45) if symmetry == "PlaneSymmetrical" else np.arange(0, 361, 45)
    parts = [
        "# a comment with AngleOfIncidence 3",
        "Source\tMeasured",
        f"Symmetry\t{symmetry}",
        f"SpectralContent {'XYZ' if channels else 'Monochrome'}",
        f"ScatterType {'BRDF' if side == 'R' else 'BTDF'}",
        f"SampleRotation {len(rotations)}",
        rotations,
        f"AngleOfIncidence {len(incidences)}",
        incidences,
        f"ScatterAzimuth {len(azimuth)}",
        azimuth,
        f"ScatterRadial {len(radial)}",
        radial,
        "",
    ]
    for name, factor in (channels or {"Monochrome": 1.0}).items():
        parts += [name, "DataBegin"]
        for rotation in rotations:
            for angle in incidences:
                parts.append("TIS 0.3")
                for a in azimuth:
                    turned = [specular_to_normal(angle, r, a) for r in radial]
                    parts.append(
                        [
                            factor
                            * (1 + rotation / 100)
                            * bsdf(angle, t, p, side)
                            * (t <= 90 + 1e-9)
                            * (np.cos(np.deg2rad(t)) if weighted else 1)
                            for t, p in turned
                        ]
                    )
        parts.append("DataEnd")
    return lines(*parts)


def lighttools(
    faces=("Front",),
    sides=("BRDF", "BTDF"),
    incidences=(0, 45),
    pois=(0,),
    half=(0, 360),
    source=90,
    weighted=False,
):
    """A BSDF file of LightTools: the light arrives from azimuth 90, as far as is known."""
    radial, azimuth = np.array([0, 20, 50, 85]), np.arange(half[0], half[1] + 1, 30)
    parts = [
        f"Symmetry {'Asymmetric' if half == (0, 360) else 'PlaneSymmetrical'}",
        "SpectralContent Monochrome",
        f"ScatterAzimuth {len(azimuth)}",
        azimuth,
    ]
    parts += [f"ScatterRadial {len(radial)}", radial, "DataBegin"]
    for face in faces:
        for kind in sides:
            for poi in pois:
                for aoi in incidences:
                    parts += [
                        f"AOI {aoi}",
                        f"POI {poi}",
                        f"Side {face}",
                        "Wavelength 633",
                        f"ScatterType {kind}",
                    ]
                    parts.append("TIS 0.8")
                    side = "R" if kind == "BRDF" else "T"
                    factor = (1 if face == "Front" else 0.5) * (1 + poi / 100)
                    factor = factor * (np.cos(np.deg2rad(radial)) if weighted else 1)
                    parts += [factor * bsdf(aoi, radial, a - source, side) for a in azimuth]
    return lines(*parts, "DataEnd")


def speos_total(theta_i, side):
    """Integral of `bsdf` times the cosine: only its even terms count."""
    return 0.1 * (2 if side == "R" else 1) * np.pi * (1 + 0.3 * 2 / 3)


def speos_table(theta_i, side, scale, is_intensity):
    """Rows of one table: azimuth 0 is the specular side, transmission beyond 90 degrees."""
    theta = np.arange(0, 91, 5.0) if side == "R" else np.arange(90, 181, 5.0)
    phi = np.arange(0, 361, 30.0)
    rows = [f"{len(theta)}\t{len(phi)}", phi]
    for t in theta:
        from_normal = t if side == "R" else 180 - t
        cosine = np.cos(np.deg2rad(from_normal)) if is_intensity else 1.0
        values = scale * cosine * bsdf(theta_i, from_normal, phi - 180, side)
        rows.append(np.concatenate([[t], values]))
    return rows


def speos_anisotropic(sides="RT", scale=1.0, is_intensity=True, rotations=(0,), spectrum=(549.5, 550.5)):
    """An ``.anisotropicbsdf`` file; the values are relative, the percentage says how much."""
    incidences = (0.0, 40.0)
    parts = ["OPTIS - Anisotropic BSDF surface file v8.0", "0", "Comment", "11", "first", "again", "1 0 0"]
    parts += [" ".join(str(int(side in sides)) for side in "RT"), str(int(not is_intensity))]
    for _ in sides:
        parts += [str(len(rotations)), rotations]
        for _ in rotations:
            parts += [str(len(incidences)), incidences]
    for side in sides:
        parts += ["0 0", "", str(len(spectrum))]
        parts += [[nm, 100 * speos_total(0, side)] for nm in spectrum]
    for side in sides:
        for _ in rotations:
            for theta_i in incidences:
                parts += speos_table(theta_i, side, scale, is_intensity)
    return lines(*parts, "End of file")


def speos_brdf(wavelengths=(450, 650), scale=1.0):
    """A ``.brdf`` file with reflection and transmission; each table has its percentage."""
    incidences = (0.0, 40.0)
    parts = ["OPTIS - brdf surface file v8.0", "0", "a comment", "0", "", "1 1", "1"]
    parts += [f"{len(incidences)}\t{len(wavelengths)}", incidences, wavelengths]
    for side in "RT":
        for theta_i in incidences:
            for nm in wavelengths:
                parts.append(f"{100 * speos_total(theta_i, side) * nm / 650:.12g}")
                parts += speos_table(theta_i, side, scale, False)
    return lines(*parts, "End of file")


def astm(columns=("450nm", "650nm"), is_radian=True, through=False):
    """The layout of ASTM E1392; the light arrives from azimuth ``phi_i``."""
    phi_i = 180.0
    rows = []
    for theta_i in (0.0, 50.0):
        for theta_s in (10.0, 35.0, 70.0, *((110.0, 160.0) if through else ())):
            for phi_s in (-170.0, -60.0, 0.0, 45.0):
                side, theta = ("R", theta_s) if theta_s < 90 else ("T", 180 - theta_s)
                value = bsdf(theta_i, theta, phi_s - phi_i, side)
                angles = np.array([theta_i, phi_i, theta_s, phi_s])
                values = [value * (1 + k) / 2 for k in range(len(columns))]
                rows.append([*(np.deg2rad(angles) if is_radian else angles), *values])
    head = ["LAB_NAME a laboratory", f"NUM_POINTS {len(rows)}"]
    head.append(f"VARS theta_i,phi_i,theta_s,phi_s,{','.join(columns)}")
    return "\r\n".join([*head, *(",".join(f"{v:.12g}" for v in row) for row in rows)]) + "\r\n"


def mountain(incidence=(40.0, 200.0), kind="DSF", channels=1):
    """A text file of pab-opto; one system of coordinates for the source and the view."""
    theta_i, phi_i = incidence
    head = ['#sample_name "a plate"', f"#format: theta phi {kind}", f"#intheta {theta_i}", f"#inphi {phi_i}"]
    head += ["#upphi 0", f"#colorimetry: CIE-{'XYZ' if channels == 3 else 'Y'}"]
    rows = []
    for theta in (5.0, 30.0, 60.0, 100.0, 150.0, 178.0):
        for phi in (0.0, 50.0, 110.0, 200.0, 260.0):
            side = "R" if (theta < 90) == (theta_i < 90) else "T"
            from_normal = min(theta, 180 - theta)
            value = bsdf(min(theta_i, 180 - theta_i), from_normal, phi - phi_i, side)
            value *= np.cos(np.deg2rad(from_normal)) if kind == "DSF" else 1
            rows.append([theta, phi, *(value * (1 + k) / channels for k in range(channels))])
    return "\n".join(head) + "\n" + "\n".join("\t".join(f"{v:.12g}" for v in row) for row in rows) + "\n"


def reflet(theta_i=20.0, specular_phi=-90.0, states_incidence=False, scale=1.0):
    """A text file of REFLET: signed polar angles, azimuths from -90 to 90."""
    head = ["Light Tec", "Phi measure step : 45", f"Theta Lighting{f' : {theta_i}' * states_incidence}"]
    rows = []
    for theta in (-60.0, -20.0, 20.0, 60.0):
        phi = np.arange(-90, 91, 45.0) + (180 if theta < 0 else 0)
        rows.append([theta, *(scale * bsdf(theta_i, abs(theta), phi - specular_phi + 180))])
    return "\n".join(head) + "\n" + "\n".join("\t".join(f"{v:.12g}" for v in row) for row in rows) + "\n"


def half_and_difference(theta_i, theta_o, phi):
    """Half angle, difference angle and its azimuth, by the angles between the directions."""
    i, o, p = np.deg2rad([theta_i, theta_o, phi])
    source = np.array([np.sin(i), 0, np.cos(i)])
    view = np.array([np.sin(o) * np.cos(p), np.sin(o) * np.sin(p), np.cos(o)])
    half = (source + view) / np.linalg.norm(source + view)
    normal = np.array([0, 0, 1.0])
    # Azimuth of the source about the half direction, from the side away from the normal.
    away = half * half[2] - normal
    across = np.cross(half, away)
    return (
        np.degrees(np.arccos(half[2])),
        np.degrees(np.arccos(np.clip(source @ half, -1, 1))),
        np.degrees(np.arctan2(source @ across, source @ away)) % 180,
    )


def merl(function):
    """A binary file of MERL; ``function(channel, theta_h, theta_d, phi_d)`` in the middle of each cell."""
    theta_h = (np.arange(90) + 0.5) ** 2 / 90
    grid = np.meshgrid(theta_h, np.arange(90) + 0.5, np.arange(180) + 0.5, indexing="ij")
    scales = {"R": 1500, "G": 1500 / 1.15, "B": 1500 / 1.66}
    tables = [np.asarray(scale * function(name, *grid), "<f8").tobytes() for name, scale in scales.items()]
    return np.array([90, 90, 180], "<i4").tobytes() + b"".join(tables)


def tensor_file(fields):
    """The container of EPFL's materials."""
    types = {"uint8": 1, "float32": 10}
    start = 18 + sum(13 + len(name) + 8 * array.ndim for name, array in fields.items())
    head, data = b"tensor_file\0\1\0" + np.array(len(fields), "<u4").tobytes(), b""
    for name, array in fields.items():
        data += b"\0" * (-(start + len(data)) % 8)
        head += np.array(len(name), "<u2").tobytes() + name.encode() + np.array(array.ndim, "<u2").tobytes()
        head += bytes([types[str(array.dtype)]]) + np.array(start + len(data), "<u8").tobytes()
        head += np.array(array.shape, "<u8").tobytes()
        data += array.tobytes()
    return head + data


def rgl(theta_i_deg=(0.0, 35.0, 60.0), n=9, wavelengths=(400.0, 600.0), phi_i_deg=(0.0,)):
    """A material whose facets have the density 2 x of the polar variable x, at even azimuths.

    A uniform point (s, t) is then the facet (sqrt(s), t). Values are such that the BSDF is `bsdf` times the
    wavelength over 600 nm: with ndf = 1 and sigma = 1 / 4, the spectra are the BSDF times cos(theta_o).
    """
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    theta_m, phi_m = np.deg2rad(90 * np.sqrt(x) ** 2), (2 * y - 1) * np.pi
    spectra = np.zeros((len(phi_i_deg), len(theta_i_deg), len(wavelengths), n, n), "f4")
    for p, phi_i in enumerate(np.deg2rad(phi_i_deg)):
        for k, theta in enumerate(np.deg2rad(theta_i_deg)):
            facet = np.stack(
                [np.sin(theta_m) * np.cos(phi_m), np.sin(theta_m) * np.sin(phi_m), np.cos(theta_m)], axis=-1
            )
            source = np.array([np.sin(theta) * np.cos(phi_i), np.sin(theta) * np.sin(phi_i), np.cos(theta)])
            view = 2 * (facet @ source)[..., None] * facet - source
            theta_o = np.degrees(np.arccos(np.clip(view[..., 2], -1, 1)))
            azimuth = np.degrees(np.arctan2(view[..., 1], view[..., 0]) - phi_i)
            values = bsdf(np.degrees(theta), theta_o, azimuth) * np.cos(np.deg2rad(theta_o))
            for w, nm in enumerate(wavelengths):
                spectra[p, k, w] = np.maximum(values, 0) * nm / 600
    ramp = np.tile(np.linspace(0, 1, 33, dtype="f4"), (len(phi_i_deg), len(theta_i_deg), 5, 1))
    return {
        "description": np.frombuffer(b"made for a test", "u1"),
        "theta_i": np.deg2rad(theta_i_deg).astype("f4"),
        "phi_i": np.deg2rad(phi_i_deg).astype("f4"),
        "wavelengths": np.array(wavelengths, "f4"),
        "ndf": np.ones((4, 5), "f4"),
        "sigma": np.full((3, 6), 0.25, "f4"),
        "vndf": ramp,
        "luminance": spectra.mean(axis=2),
        "spectra": spectra,
        "jacobian": np.array([0], "u1"),
    }


def integra(
    side="R",
    model="spectral 1",
    symmetry="PlaneSymmetrical",
    data="Luminance Absolute",
    psi=(),
    factors=(1.0,),
    kbdf=None,
):
    """A DDR or DDT file of Integra; ``factors`` are those of its channels, ``kbdf`` one of each incidence."""
    sigma, theta = (0, 30, 60), np.array([0, 15, 40, 75, 110, 150])
    phi = np.arange(0, 181, 45) if symmetry == "PlaneSymmetrical" else np.arange(0, 361, 45)
    names = {"BW": ["bw"], "RGB": ["red", "green", "blue"]}.get(model, ["wl 450", "wl 650"])
    parts = [
        ";; a comment with sigma 3",
        "Source Measured",
        f"TypeSym {symmetry}",
        f"TypeColorModel {model}",
        f"TypeData {data}",
        *([f"psi {len(psi)}", psi] if psi else []),
        f"sigma {len(sigma)}",
        sigma,
        *(["sigmat", sigma] if side == "T" else []),
        f"phi {len(phi)}",
        phi,
        f"theta {len(theta)}",
        theta,
    ]
    for name, factor in zip(names, factors, strict=False):
        parts.append(name)
        if kbdf is not None:
            parts += [" kbdf", kbdf]
        parts.append(" def")
        for rotation in psi or (0,):
            for s, angle in enumerate(sigma):
                parts.append(f";; Sigma = {angle}")
                scale = factor * (1 + rotation / 100) / (1 if kbdf is None else kbdf[s])
                for p in phi:
                    turned = [specular_to_normal(angle, t, p) for t in theta]
                    parts.append([scale * _integra_value(data, angle, *each, side) for each in turned])
        parts.append(" enddef")
    return lines(*parts)


def _integra_value(data, theta_i, theta_o, phi, side):
    weight = np.cos(np.deg2rad(theta_o)) if data.startswith("Intensity") else np.pi
    return bsdf(theta_i, theta_o, phi, side) * weight * (theta_o <= 90 + 1e-9)


def integra_regular(model="spectral 2", channels=("wl 450", "wl 650")):
    """An SDR or SDT file of Integra: 0.1 at normal incidence, 0.4 at 60 degrees, doubled by channel."""
    parts = [";; regular light", "Source Measured", f"TypeColorModel {model}", "sigma 3", (0, 60, 90)]
    for k, name in enumerate(channels):
        parts += [name, " def", np.array([0.1, 0.4, 1.0]) * (k + 1) / 2, " enddef"]
    return lines(*parts)
