"""Light in stacks of plane layers by Monte Carlo; nothing here imports jaxink, which it checks."""

from benchmarks.montecarlo.facets import DENSITIES, INTERFACE_FILE, Facets, fresnel, interface_alone
from benchmarks.montecarlo.photons import Result, simulate
from benchmarks.montecarlo.sample import Detectors, HenyeyGreenstein, Layer, Sample, Tabulated
from benchmarks.montecarlo.thin_sheet import Plate, plate_bsdf

__all__ = [
    "DENSITIES",
    "INTERFACE_FILE",
    "Detectors",
    "Facets",
    "HenyeyGreenstein",
    "Layer",
    "Plate",
    "Result",
    "Sample",
    "Tabulated",
    "fresnel",
    "interface_alone",
    "plate_bsdf",
    "simulate",
]
