"""Spectra of spectrophotometers: CGATS text and CxF3."""

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.measurement.readings_file import is_readings_file

CGATS = """CGATS.17
ORIGINATOR "by hand"
MEASUREMENT_GEOMETRY "45/0"
NUMBER_OF_FIELDS 5
BEGIN_DATA_FORMAT
SAMPLE_ID SAMPLE_NAME SPECTRAL_NM400 SPECTRAL_NM410 LAB_L
END_DATA_FORMAT
NUMBER_OF_SETS 2
BEGIN_DATA
1 "cyan ink" 0.31 0.33 50
2 black 0.02 0.03 20
END_DATA
"""
CXF = """<?xml version="1.0" encoding="UTF-8"?>
<cc:CxF xmlns:cc="http://colorexchangeformat.com/CxF3-core"><cc:Resources><cc:ObjectCollection>
<cc:Object ObjectType="Standard" Name="red" Id="c1"><cc:ColorValues>
<cc:ReflectanceSpectrum ColorSpecification="s1" StartWL="400">0.1 0.2 0.7</cc:ReflectanceSpectrum>
</cc:ColorValues></cc:Object></cc:ObjectCollection>
<cc:ColorSpecificationCollection><cc:ColorSpecification Id="s1"><cc:MeasurementSpec>
<cc:MeasurementType>Spectrum_Reflectance</cc:MeasurementType>
<cc:GeometryChoice><cc:SingleAngle><cc:SingleAngleConfiguration>Annular</cc:SingleAngleConfiguration>
<cc:IlluminationAngle>45</cc:IlluminationAngle><cc:MeasurementAngle>0</cc:MeasurementAngle></cc:SingleAngle>
</cc:GeometryChoice><cc:WavelengthRange StartWL="400" Increment="20"/></cc:MeasurementSpec>
</cc:ColorSpecification></cc:ColorSpecificationCollection></cc:Resources></cc:CxF>
"""


@pytest.fixture
def file(tmp_path):
    def write(text, name="chart.txt"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_a_sample_of_a_chart(file):
    path = file(CGATS)
    assert is_readings_file(path)
    for name in ("1", "cyan ink"):
        found = jaxink.read_readings(path, sample=name)
        assert found.quantity.tolist() == ["R_45_0"] * 2
        np.testing.assert_allclose(found.wavelength_nm, [400, 410])
        np.testing.assert_allclose(found.value, [0.31, 0.33])
        assert found.theta_i_deg.tolist() == [45, 45]
        assert found.row.tolist() == [10, 10]


def test_per_cent_and_a_norm(file):
    per_cent = CGATS.replace("0.31 0.33", "31 33")
    np.testing.assert_allclose(jaxink.read_readings(file(per_cent), sample="1").value, [0.31, 0.33])
    normed = per_cent.replace("NUMBER_OF_SETS", "SPECTRAL_NORM 100\nNUMBER_OF_SETS")
    np.testing.assert_allclose(jaxink.read_readings(file(normed), sample="1").value, [0.31, 0.33])


def test_an_object_of_cxf(file):
    path = file(CXF, "red.cxf")
    assert is_readings_file(path)
    found = jaxink.read_readings(path)
    np.testing.assert_allclose(found.wavelength_nm, [400, 420, 440])
    np.testing.assert_allclose(found.value, [0.1, 0.2, 0.7])
    assert found.quantity.tolist() == ["R_45_0"] * 3
    sphere = CXF.replace("SingleAngle>", "Sphere>")
    assert jaxink.read_readings(file(sphere), quantity="R_de_8").quantity[0] == "R_de_8"


@pytest.mark.parametrize(
    ("text", "stated", "named"),
    [
        (CGATS, {}, "1, 2"),
        (CGATS, {"sample": "red"}, "red"),
        (CGATS, {"sample": "1", "quantity": "R_0_45"}, "R_0_45"),
        (CGATS, {"sample": "1", "wavelength_nm": 400.0}, "wavelength_nm"),
        (CGATS.replace('MEASUREMENT_GEOMETRY "45/0"\n', ""), {"sample": "1"}, "geometry"),
        (CGATS.replace("0.33 50", "0.33"), {}, "row 10"),
        (CGATS.replace("0.33", "x"), {}, "SPECTRAL_NM410"),
        (CGATS.replace("SPECTRAL_NM", "XYZ_"), {}, "SPECTRAL_NM400"),
        (CXF.replace("</cc:CxF>", ""), {}, "XML"),
        (CXF.replace("ReflectanceSpectrum", "ColorCIELab"), {}, "ReflectanceSpectrum"),
        (CXF.replace('Increment="20"', ""), {}, "Increment"),
        (CXF.replace("<cc:CxF", "<!DOCTYPE a><cc:CxF"), {}, "document type"),
        (CXF, {"quantity": "R_45"}, "R_45"),
        ("quantity,value\nR_total,0.5\n", {"sample": "1"}, "sample"),
    ],
)
def test_what_is_left_open_or_wrong(file, text, stated, named, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.read_readings(file(text), **stated)
    told(str(refused.value), named)


def test_a_project_names_the_sample(file, tmp_path):
    file(CGATS)
    project = """
schema_version = 1
[sample]
schema_version = 1
wavelength_nm = [400, 410]
noise = { relative = 0.01 }
[[sample.layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 20
scattering_per_mm = { free = true, min = 1, max = 1000, value = 100 }
absorption_per_mm = 1
asymmetry_parameter = 0.5
[[measurements]]
name = "chart"
readings = "chart.txt"
reading = { sample = "2" }
"""
    found = jaxink.parse_project(project, "project", tmp_path)
    np.testing.assert_allclose(found.measurements[0].data.value, [0.02, 0.03])
