"""Which measurement of a joint fit a command is about."""

import os
from pathlib import Path

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import read_json
from jaxink.files.reading import shown_path
from jaxink.files.result_folder import (
    JOINT_FILE,
    LARGEST_RESULT_BYTES,
    MEASUREMENTS,
    RESULT_FILE,
    SAMPLE_FILE,
    joint_file,
)
from jaxink.sample import document_of, text_of


def is_described(source: Path) -> bool:
    """Whether a path is the TOML file of a sample or project, and not a result."""
    return source.suffix == ".toml" and not os.path.isdir(source)


def is_of_many(source: Path) -> bool:
    """Whether a path is a joint fit, or a TOML file with measurements."""
    if not is_described(source):
        return _is_joint(source)
    return "measurements" in document_of(text_of(source, "sample"), str(source))


def _is_joint(source: Path) -> bool:
    joint = joint_file(source)
    return joint.name == JOINT_FILE and (joint == source or os.path.lexists(joint))


def of_measurement(source: Path, measurement: str | None) -> Path:
    """The result that a command takes: a folder or, of readings, the sample file of the fit.

    Parameters
    ----------
    source
        Folder of a fit, of a diagnosis or of a joint fit, or a file.
    measurement
        Name of a measurement of the joint fit; None: the only one, or the only one of a BSDF.

    Raises
    ------
    InputRefusedError
        The joint fit has several measurements, or none of that name; or it is no joint fit.
    """
    if not _is_joint(source):
        if measurement is not None:
            raise InputRefusedError(
                f"{shown_path(source)}: is no joint fit; leave out --measurement {measurement}."
            )
        return source
    folder = joint_file(source).parent
    plain = read_json(folder / JOINT_FILE, LARGEST_RESULT_BYTES, "result")
    names = [name for name in plain.get("measurements", ()) if isinstance(name, str)]
    results = {name: folder / MEASUREMENTS / name for name in names}
    of_bsdf = [name for name, result in results.items() if os.path.lexists(result / RESULT_FILE)]
    if measurement is None:
        candidates = of_bsdf or names
        if len(candidates) != 1:
            raise InputRefusedError(
                f"{shown_path(folder)}: is a joint fit of {', '.join(names)}; name the measurement whose "
                "sample is meant by --measurement."
            )
        measurement = candidates[0]
    if measurement not in results:
        raise InputRefusedError(
            f"--measurement {measurement}: is not in {shown_path(folder)}, whose measurements are: "
            f"{', '.join(names)}."
        )
    return results[measurement] if measurement in of_bsdf else results[measurement] / SAMPLE_FILE
