"""Measurement and sample as a fit or a prediction takes them."""

from pathlib import Path

import numpy as np

from jaxink.errors import InputRefusedError, require_kind
from jaxink.measurement import GonioData, MaskLimits, read
from jaxink.numerics.forking import refuse_in_fork
from jaxink.sample import Sample, load_sample


def read_inputs(data: GonioData | str | Path, sample: Sample | str | Path) -> tuple[GonioData, Sample]:
    """A measurement and a sample, each given itself or as its file.

    Parameters
    ----------
    data
        Measurement, or its file.
    sample
        Sample, or its file.

    Raises
    ------
    InputRefusedError
        If one is neither, cannot be read, or a value of the sample is outside its range.
    ForkedProcessError
        In a process that was forked off one that had computed.
    """
    refuse_in_fork()
    require_kind("data", data, GonioData, str, Path)
    require_kind("sample", sample, Sample, str, Path)
    sample = sample if isinstance(sample, Sample) else load_sample(sample)
    sample.parameters.require_ranges()
    return read(data) if isinstance(data, str | Path) else data, sample


def prepare_data(data: GonioData, sample: Sample) -> GonioData:
    """The rows and masks that a sample asks for.

    Parameters
    ----------
    data
        The measurement.
    sample
        Names wavelengths and masks.

    Raises
    ------
    InputRefusedError
        If a wavelength of the sample is not in the data.
    """
    if sample.wavelengths_nm:
        known = np.unique(data.wavelength_nm)
        for wavelength in sample.wavelengths_nm:
            if not np.any(np.abs(known - wavelength) < 1e-6):
                raise InputRefusedError(
                    f"the sample names {wavelength:g} nm, but {data.source or 'the measurement'} holds "
                    f"{', '.join(f'{w:g}' for w in known)} nm only."
                )
        data = data.select(wavelength_nm=sample.wavelengths_nm)
    return data.with_masks(_limits(sample))


def marked(data: GonioData, sample: Sample) -> GonioData:
    """A measurement with the masks that a sample asks for, all rows kept, be none of them used.

    Parameters
    ----------
    data
        The measurement.
    sample
        Names masks.
    """
    return data.replace(mask=data.mask_bits(_limits(sample)))


def _limits(sample: Sample) -> MaskLimits:
    limits = dict(sample.masks)
    return MaskLimits(
        **{key: value or None for key, value in limits.items() if key != "grazing_theta_o_deg"},
        grazing_theta_o_deg=limits.get("grazing_theta_o_deg"),
    )
