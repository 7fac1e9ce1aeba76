"""Goniometer measurements: reading, checking, masking and noise; numpy only."""

from jaxink.measurement.balance import balances
from jaxink.measurement.columns import listed, option_words
from jaxink.measurement.dataset import Columns, GonioData
from jaxink.measurement.masks import (
    MASK_FLAGS,
    USER,
    MaskFlag,
    MaskLimits,
    angular_distance_deg,
    mask_counts,
    mask_names,
    mask_sentences,
)
from jaxink.measurement.noise import MINIMUM_PAIRS, estimate_noise, symmetry_repeatability
from jaxink.measurement.noise_model import NoiseEstimate, NoiseLevel, NoiseModel, NoiseSource, ScanScatter
from jaxink.measurement.one_sample import refuse_other_samples
from jaxink.measurement.out_of_line import readings_out_of_line
from jaxink.measurement.pairs import (
    ANGLE_TOLERANCE_DEG,
    angle_labels,
    reciprocal_differences,
    repeat_differences,
    without_copies,
)
from jaxink.measurement.point_noise import LEAST_PROBABILITY, SIGMA_TOLERANCE, FitNoise, Noise, noise_of
from jaxink.measurement.reader import (
    ONE_A_FILE,
    overrides_of_files,
    read,
    read_conditions,
    read_csv,
    read_netcdf,
    read_workbook,
)
from jaxink.measurement.readings import QUANTITIES, Readings, Spheres
from jaxink.measurement.readings_file import is_readings_file, read_readings
from jaxink.measurement.reflectance_of_bsdf import diffuse_reflectance
from jaxink.measurement.rows import BACKING, LIT_SIDE, SAMPLE, THICKNESS, Condition, Conditions, same_cell
from jaxink.measurement.scans import SAME, Scan, wavelength_words
from jaxink.measurement.spectrum_file import read_spectrum
from jaxink.measurement.table import is_frame, is_number, kind_of, refusal
from jaxink.measurement.text_file import write_csv

__all__ = [
    "ANGLE_TOLERANCE_DEG",
    "BACKING",
    "LEAST_PROBABILITY",
    "LIT_SIDE",
    "MASK_FLAGS",
    "MINIMUM_PAIRS",
    "ONE_A_FILE",
    "QUANTITIES",
    "SAME",
    "SAMPLE",
    "SIGMA_TOLERANCE",
    "THICKNESS",
    "USER",
    "Columns",
    "Condition",
    "Conditions",
    "FitNoise",
    "GonioData",
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
    "angle_labels",
    "angular_distance_deg",
    "balances",
    "diffuse_reflectance",
    "estimate_noise",
    "is_frame",
    "is_number",
    "is_readings_file",
    "kind_of",
    "listed",
    "mask_counts",
    "mask_names",
    "mask_sentences",
    "noise_of",
    "option_words",
    "overrides_of_files",
    "read",
    "read_conditions",
    "read_csv",
    "read_netcdf",
    "read_readings",
    "read_spectrum",
    "read_workbook",
    "readings_out_of_line",
    "reciprocal_differences",
    "refusal",
    "refuse_other_samples",
    "repeat_differences",
    "same_cell",
    "symmetry_repeatability",
    "wavelength_words",
    "without_copies",
    "write_csv",
]
