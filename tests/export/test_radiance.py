"""Radiance, through pyradiance, reads our files and gives our numbers."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from jaxink.export import ExportOptions, write
from jaxink.ink import COMPONENTS
from jaxink.ink.hemispherical_totals import diffuse_totals
from tests.export.tracer_files import radiance
from tests.ink.analytic_tables import INDEX_INSIDE, LAMBERTIAN, lambertian, smooth_table, tilted_lobe, vector

pyradiance = pytest.importorskip("pyradiance")

DROP = ("index_step",)
TABLES = {"lambertian": lambertian, "smooth": smooth_table, "lobe": tilted_lobe}
# A process of its own: releasing one BSDF and loading another can crash pyradiance.
PROGRAM = """
import json, sys
from pyradiance import bsdf
data = bsdf.load_file(sys.argv[1])
pairs, incidences = json.load(sys.stdin)
values = [float(bsdf.query(data, *pair)[1]) for pair in pairs]
totals = [
    [bsdf.direct_hemi(data, *incidence, bsdf.SAMPLE_DF | bsdf.SAMPLE_SP | kind)
     for kind in (bsdf.SAMPLE_R, bsdf.SAMPLE_T)]
    for incidence in incidences
]
print(json.dumps([values, totals]))
"""


def radiance_degrees(direction):
    """In Radiance the front, theta below 90, is the inside of the plate."""
    x, y, z = direction * np.array([1, 1, -1])
    return float(np.degrees(np.arccos(np.clip(z, -1, 1)))), float(np.degrees(np.arctan2(y, x)))


@pytest.mark.parametrize("basis", ["klems", "tensor_tree"])
@pytest.mark.parametrize("name", TABLES)
def test_radiance_reads_what_we_wrote(basis, name, tmp_path):
    table = TABLES[name]()
    path, _ = write(table, "radiance", tmp_path, ExportOptions(drop=DROP, basis=basis))
    ours = radiance(tmp_path)
    # Off the edges of patches and cells.
    rays = [
        (component, vector(component[2], theta_i, 201.0), vector(component[3], theta_o, 201.0 + phi))
        for component in COMPONENTS
        for theta_i in (2.0, 31.0, 61.0, 81.0)
        for theta_o in (11.0, 41.0, 71.0)
        for phi in (2.0, 37.0, 143.0, 301.0)
    ]
    sides = [vector("I", 31.0, 201.0), vector("A", 31.0, 201.0)]
    asked = (
        [[*radiance_degrees(source), *radiance_degrees(out)] for _, source, out in rays],
        [radiance_degrees(source) for source in sides],
    )
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path)], input=json.dumps(asked), capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    values, totals = json.loads(run.stdout)
    # Radiance alters what it answers by position, up to 3e-4 of it.
    expected = np.array([float(ours(*ray)) for ray in rays])
    np.testing.assert_allclose(values, expected, rtol=4e-4, atol=1e-6)
    if name == "lambertian":
        np.testing.assert_allclose(
            np.array(values) * np.pi, [LAMBERTIAN[component] for component, _, _ in rays], rtol=4e-4
        )
    of_table = [np.interp(31, table.theta_deg, total[0]) for total in diffuse_totals(table)]
    expected = [[of_table[0], of_table[1]], [of_table[3], of_table[2]]]
    np.testing.assert_allclose(totals, expected, rtol=1e-2)


@pytest.mark.parametrize(
    ("basis", "kind"), [("klems", "Klems_Full"), ("tensor_tree", "Isotropic_Tensor_Tree")]
)
def test_its_checker_finds_reflections_reciprocal_and_transmissions_not(basis, kind, tmp_path):
    path, _ = write(smooth_table(), "radiance", tmp_path, ExportOptions(drop=DROP, basis=basis))
    program = Path(pyradiance.__file__).parent / "bin" / "checkBSDF"
    run = subprocess.run([program, path], capture_output=True, text=True)
    assert run.returncode == 0
    assert f"Type: {kind}" in run.stdout
    lines = run.stdout.split("Reciprocity Error")[1].splitlines()[1:4]
    inside, outside, transmission = (float(line.split()[-2]) for line in lines)
    # Mean over pairs of directions, per cent; at its worst a pair falls into cells that do not correspond.
    assert max(inside, outside) < 0.5
    if basis == "tensor_tree":
        # It expects equal transmissions; ours differ by the square of the index.
        assert transmission == pytest.approx(100 * (1 - 1 / INDEX_INSIDE**2), abs=0.5)
