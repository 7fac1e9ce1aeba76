"""What the cases that stay open determine of their effect: its standard error if it is declared and free.

Of a rough face with a backing, the backing, the rough face being declared and free with and without it.

python -m benchmarks.validation.names.determined
"""

import json
import math
from pathlib import Path

import jaxink
from benchmarks.validation.names.cases import Case, cases
from benchmarks.validation.names.drawing import measurement, sample_text

RESULTS = Path(__file__).with_name("determined.json")
_GAIN = "\n[effects.gain]\nrelative = { free = true, value = 0, min = -0.2, max = 0.2 }\n"
_MIE = 'phase_function = "mie"\n'
_SPREAD = _MIE + "radius_variance_ln = { free = true, value = 0.1, min = 0, max = 0.4 }\n"
_ROUGH = (
    'back_roughness = { density = "cauchy", sigma_deg = { free = true, value = 4, min = 1, max = 10 } }\n'
)
_BACKING = "\n[backing]\nreflectance = { free = true, value = 0.1, min = 0, max = 1 }\n"
_OPEN = ("spread-4", "spread-6", "rough_and_backing-3")


def fitted(case: Case) -> dict:
    """The effect's number in a case with its standard error, and how much it lowers chi-square."""
    data, text, options = measurement(case), sample_text(case), jaxink.FitOptions(profile="none")
    if case.backing is not None:
        name, true = "backing.reflectance", case.backing
        text = text.replace("\n\n[noise]", "\n" + _ROUGH + "\n[noise]")
        freed = text + _BACKING
    elif case.effects == ("gain",):
        name, true, freed = "gain.relative", case.gain - 1, text + _GAIN
    else:
        name, true = "ink.radius_variance_ln", math.log(case.ink.size_ratio) ** 2
        freed = text.replace(_MIE, _SPREAD)
    without, with_effect = (jaxink.fit(data, jaxink.parse_sample(each), options) for each in (text, freed))
    found = with_effect[name]
    return {
        "true": true,
        "value": found.value,
        "standard_error": found.standard_error,
        "delta_chi_square": without.merit.chi_square - with_effect.merit.chi_square,
    }


def main() -> None:
    """Fit those that are missing."""
    found = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for name, case in cases().items():
        if name not in found and (case.effects == ("gain",) or name in _OPEN):
            found[name] = fitted(case)
            RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
