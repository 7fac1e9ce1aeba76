"""Light in stacks of plane layers by Monte Carlo; nothing here imports jaxink, which it checks."""

from benchmarks.montecarlo.counts import Result
from benchmarks.montecarlo.facets import DENSITIES, Facets, fresnel
from benchmarks.montecarlo.fluorescence import Absorbed, emitted
from benchmarks.montecarlo.interface import INTERFACE_FILE, interface_alone
from benchmarks.montecarlo.photons import simulate
from benchmarks.montecarlo.sample import Detectors, HenyeyGreenstein, Layer, Sample, Tabulated
from benchmarks.montecarlo.thin_sheet import Plate, plate_bsdf

__all__ = [
    "DENSITIES",
    "INTERFACE_FILE",
    "Absorbed",
    "Detectors",
    "Facets",
    "HenyeyGreenstein",
    "Layer",
    "Plate",
    "Result",
    "Sample",
    "Tabulated",
    "emitted",
    "fresnel",
    "interface_alone",
    "plate_bsdf",
    "simulate",
]
