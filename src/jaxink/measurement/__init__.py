"""Goniometer measurements: reading, checking, masking and noise; numpy only."""

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.masks import MASK_FLAGS, MaskFlag, MaskLimits, mask_counts, mask_sentences
from jaxink.measurement.noise import estimate_noise, symmetry_repeatability
from jaxink.measurement.noise_model import NoiseEstimate, NoiseLevel, NoiseModel, NoiseSource, ScanScatter
from jaxink.measurement.point_noise import FitNoise, Noise, noise_of
from jaxink.measurement.reader import read, read_csv, read_netcdf, read_workbook
from jaxink.measurement.readings import Readings, Spheres
from jaxink.measurement.readings_file import read_readings
from jaxink.measurement.scans import Scan
from jaxink.measurement.text_file import write_csv

__all__ = [
    "FitNoise",
    "GonioData",
    "MASK_FLAGS",
    "MaskFlag",
    "MaskLimits",
    "Noise",
    "NoiseEstimate",
    "NoiseLevel",
    "NoiseModel",
    "NoiseSource",
    "Readings",
    "Scan",
    "ScanScatter",
    "Spheres",
    "estimate_noise",
    "mask_counts",
    "mask_sentences",
    "noise_of",
    "read",
    "read_csv",
    "read_workbook",
    "read_netcdf",
    "read_readings",
    "symmetry_repeatability",
    "write_csv",
]
