"""Edge-lit plate with ink on its lower face, seen from above.

Run as ``python example_scene.py ink.nc picture.exr``, with the variant as an optional third argument.
"""

import sys

import mitsuba as mi
import numpy as np
import xarray


def indices_of(filename):
    """Refractive indices of the inside of the plate and of the other side; their means over wavelengths."""
    with xarray.open_dataset(filename) as table:
        return tuple(float(np.mean(table[name].values)) for name in ("index_inside", "index_outside"))


def plate_with_ink(filename, size=(64, 48), samples=64, **table):
    """Scene dictionary for ``mi.load_dict``.

    Parameters
    ----------
    filename
        netCDF file of jaxink; the refractive indices of the plate and of its surroundings are those of the
        table.
    size
        Width and height of the picture in pixels.
    samples
        Samples per pixel.
    table
        Other properties of ``jaxink_table``, such as ``wavelength_nm``.
    """
    to = mi.ScalarTransform4f()
    inside, outside = indices_of(filename)
    glass = {"type": "dielectric", "int_ior": inside, "ext_ior": outside}
    ink = {"type": "jaxink_table", "filename": filename, **table}
    # Plate of 10 by 6 by 0.6 with outward normals; the ink is on the lower face.
    half = to.scale([5, 3, 1])
    faces = {
        "lower": (to.translate([0, 0, -0.3]) @ to.rotate([1, 0, 0], 180) @ half, ink),
        "upper": (to.translate([0, 0, 0.3]) @ half, glass),
        "left": (to.translate([-5, 0, 0]) @ to.rotate([0, 1, 0], -90) @ to.scale([0.3, 3, 1]), glass),
        "right": (to.translate([5, 0, 0]) @ to.rotate([0, 1, 0], 90) @ to.scale([0.3, 3, 1]), glass),
        "near": (to.translate([0, -3, 0]) @ to.rotate([1, 0, 0], 90) @ to.scale([5, 0.3, 1]), glass),
        "far": (to.translate([0, 3, 0]) @ to.rotate([1, 0, 0], -90) @ to.scale([5, 0.3, 1]), glass),
    }
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 24},
        "lamp": {
            "type": "rectangle",
            "to_world": to.translate([-5.2, 0, 0]) @ to.rotate([0, 1, 0], 90) @ to.scale([0.3, 3, 1]),
            "emitter": {"type": "area", "radiance": {"type": "spectrum", "value": 10.0}},
        },
        "sensor": {
            "type": "perspective",
            "fov": 50,
            "to_world": to.look_at(origin=[0, -9, 9], target=[0, 0, 0], up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": size[0], "height": size[1]},
            "sampler": {"type": "independent", "sample_count": samples},
        },
    }
    for name, (to_world, bsdf) in faces.items():
        scene[name] = {"type": "rectangle", "to_world": to_world, "bsdf": bsdf}
    return scene


if __name__ == "__main__":
    mi.set_variant(sys.argv[3] if len(sys.argv) > 3 else "scalar_rgb")
    import jaxink_table  # noqa: F401

    mi.util.write_bitmap(sys.argv[2], mi.render(mi.load_dict(plate_with_ink(sys.argv[1]))))
