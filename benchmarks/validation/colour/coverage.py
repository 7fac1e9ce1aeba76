"""How often standard errors of concentrations and colours cover the truth, in repeated draws of the noise.

The two-pigment ink of `pigments`, fitted by its concentrations. A draw covers a quantity if the fit is within
one standard error of the truth. A stopped run goes on where it was.

python -m benchmarks.validation.colour.coverage [--draws 50]
"""

import argparse
import json
from pathlib import Path

import jaxink
from benchmarks.validation.colour.pigments import HEAD, PIGMENTS, TRUTH, WAVES, drawn, noise_free, truth
from jaxink.colour import SampleSpectra

RESULTS = Path(__file__).parent / "coverage.json"
GEOMETRY, NUMBERS = "45:0", ("X", "Y", "Z", "x", "y", "L", "a", "b")


def main() -> None:
    """Draw, fit and keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=50)
    asked = parser.parse_args()
    clean, sample = noise_free(), jaxink.parse_sample(HEAD + PIGMENTS)
    (true,) = SampleSpectra(truth(), [GEOMETRY], WAVES).colours("D65", 2, None)
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    for seed in range(len(kept), asked.draws):
        options = jaxink.FitOptions(profile="none", scan=False)
        result = jaxink.fit(drawn(clean, 1000 + seed), sample, options)
        (found,) = result.colour([GEOMETRY]).colours
        distances = {n: (result.values[n] - v) / result[n].standard_error for n, v in TRUTH.items()}
        for name in NUMBERS:
            distances[name] = (found.values[name] - true.values[name]) / found.standard_errors[name]
        kept.append({"reduced_chi_square": result.merit.reduced_chi_square, "distances": distances})
        RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    for name in kept[0]["distances"]:
        inside = sum(abs(one["distances"][name]) <= 1 for one in kept)
        print(f"{name}: {inside} of {len(kept)}")


if __name__ == "__main__":
    main()
