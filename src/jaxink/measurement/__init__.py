"""Goniometer measurements: reading, checking, masking and noise; numpy only."""

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.masks import (
    MASK_FLAGS,
    MaskFlag,
    MaskLimits,
    mask_counts,
    mask_sentences,
)
from jaxink.measurement.noise import estimate_noise, symmetry_repeatability
from jaxink.measurement.noise_model import NoiseEstimate, NoiseModel, NoiseSource, ScanScatter
from jaxink.measurement.reader import read, read_csv, read_netcdf
from jaxink.measurement.scans import Scan

__all__ = [
    "GonioData",
    "MASK_FLAGS",
    "MaskFlag",
    "MaskLimits",
    "NoiseEstimate",
    "NoiseModel",
    "NoiseSource",
    "Scan",
    "ScanScatter",
    "estimate_noise",
    "mask_counts",
    "mask_sentences",
    "read",
    "read_csv",
    "read_netcdf",
    "symmetry_repeatability",
]
