"""What the cases with a small gain determine of it: the standard error if it is declared and free.

python -m benchmarks.validation.names.gains
"""

import json
from pathlib import Path

import jaxink
from benchmarks.validation.names.cases import Case, cases
from benchmarks.validation.names.drawing import measurement, sample_text

RESULTS = Path(__file__).with_name("gains.json")
_FREE = "\n[effects.gain]\nrelative = { free = true, value = 0, min = -0.2, max = 0.2 }\n"


def fitted(case: Case) -> dict:
    """The gain of a case with its standard error, and how much it lowers chi-square."""
    data, text, options = measurement(case), sample_text(case), jaxink.FitOptions(profile="none")
    without, with_gain = (
        jaxink.fit(data, jaxink.parse_sample(each), options) for each in (text, text + _FREE)
    )
    gain = with_gain["gain.relative"]
    return {
        "true": case.gain - 1,
        "value": gain.value,
        "standard_error": gain.standard_error,
        "delta_chi_square": without.merit.chi_square - with_gain.merit.chi_square,
    }


def main() -> None:
    """Fit them all."""
    found = {name: fitted(case) for name, case in cases().items() if case.effects == ("gain",)}
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
