"""Names of what is written down beside readings, and is no condition of a measurement."""

import re

_RECORDS = {
    *(
        "repeat",
        "repeats",
        "repetition",
        "replicate",
        "run",
        "scan",
        "pass",
        "sweep",
        "frame",
        "shot",
        "cycle",
    ),
    *("series", "index", "number", "no", "nr", "id", "row", "file", "filename", "operator", "time"),
    *("timestamp", "datetime", "date", "day", "hour", "comment", "comments", "note", "notes", "remark"),
    *("remarks", "mask", "masked", "flag", "quality", "valid"),
}


def names_a_record(name: str) -> bool:
    """Whether a name is that of repeats, or of something that is no condition."""
    return bool(set(re.split(r"[^a-z]+", name.lower())) & _RECORDS)
