"""Measurement and sample in the form that a fit or a prediction needs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxink.errors import InputRefusedError, require_kind
from jaxink.measurement import GonioData, MaskLimits, Readings, is_frame, kind_of, read
from jaxink.numerics.precision import refuse_in_fork
from jaxink.sample import Sample, load_sample


def read_inputs(
    data: GonioData | str | Path | Sequence[str | Path], sample: Sample | str | Path
) -> tuple[GonioData, Sample]:
    """Load a measurement and a sample, unless they are loaded already.

    Raises
    ------
    InputRefusedError
        An argument has a wrong type, a file is invalid, or a value of the sample is outside its range.
    ForkedProcessError
        In a process forked from one that has run computations.
    """
    if isinstance(data, Readings):
        raise InputRefusedError(
            "data are readings, which are fitted as a measurement of a project; write a project file that "
            "names them by readings = ..., and hand over what jaxink.load_project makes of it."
        )
    if is_frame(data):
        raise InputRefusedError(
            f"data is a {kind_of(data)}; hand over what jaxink.read makes of it, such as jaxink.read(df)."
        )
    require_kind("data", data, GonioData, str, Path, list, tuple)
    sample = read_sample(sample)
    return data if isinstance(data, GonioData) else read(data), sample


def require_sample(sample: Sample | str | Path | None) -> Sample | str | Path:
    """The sample of a measurement; of these, only a project may do without.

    Raises
    ------
    InputRefusedError
        It is None.
    """
    if sample is None:
        raise InputRefusedError(
            "sample is None; give a sample or its file, or a project (jaxink.load_project) instead of the "
            "measurement."
        )
    return sample


def read_sample(sample: Sample | str | Path) -> Sample:
    """Load a sample, unless it is loaded already.

    Raises
    ------
    InputRefusedError
        As for `read_inputs`.
    ForkedProcessError
        In a process forked from one that has run computations.
    """
    refuse_in_fork()
    require_kind("sample", sample, Sample, str, Path)
    sample = sample if isinstance(sample, Sample) else load_sample(sample)
    sample.parameters.require_ranges()
    return sample


def prepare_data(data: GonioData, sample: Sample) -> GonioData:
    """Select the wavelengths and apply the masks that a sample asks for.

    Raises
    ------
    InputRefusedError
        A wavelength of the sample is not in the data.
    """
    if sample.wavelengths_nm:
        known = np.unique(data.wavelength_nm)
        for wavelength in sample.wavelengths_nm:
            if not np.any(np.abs(known - wavelength) < 1e-6):
                raise InputRefusedError(
                    f"the sample lists {wavelength:g} nm, but {data.source or 'the measurement'} has "
                    f"{', '.join(f'{w:g}' for w in known)} nm only."
                )
        data = data.select(wavelength_nm=sample.wavelengths_nm)
    return data.with_masks(limits_of(sample))


def marked(data: GonioData, sample: Sample) -> GonioData:
    """A measurement with the masks that a sample asks for; all rows are kept, even unused ones."""
    return data.replace(mask=data.mask_bits(limits_of(sample)))


def limits_of(sample: Sample) -> MaskLimits:
    """Limits of the geometric masks that a sample asks for."""
    limits = dict(sample.masks)
    return MaskLimits(
        **{key: value or None for key, value in limits.items() if key != "grazing_theta_o_deg"},
        grazing_theta_o_deg=limits.get("grazing_theta_o_deg"),
    )
