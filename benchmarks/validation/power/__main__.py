"""False alarms and power of the diagnosis; writes its part of docs/manual/diagnosis.md.

python -m benchmarks.validation.power [--null N] [--loops N] [--effect-loops] [--case NAME]
                                    [--only EFFECT,...]

At twice the detection limit every data set is drawn from the model: its prediction with an effect at that
strength, nonlinear, plus the declared noise with its scan factors; the declared model is fitted to it anew,
and the residual screened: by the screen made at the fit to the case, or where fits go far after an effect, by
one made at each fit. At the other multiples the linear model of the screen serves, noise added to the
direction of the effect, unless refits find that its limit is not linear: then all are drawn from the model.
Results are kept effect by effect in results.json, so that a run that was stopped goes on; --null screens so
many null data sets, --loops runs the whole procedure on some, --effect-loops on one with each effect. The
first case tells of all effects it can; --case NAME adds those that another sample has.
"""

import argparse
import json
from pathlib import Path

from benchmarks.pages import write_section
from benchmarks.validation.power.drawing import Case
from benchmarks.validation.power.page import page
from benchmarks.validation.power.study import N_NULL, effect_loops, false_alarms, null_loops, power
from jaxink.numerics.precision import computing

MARK = "false alarms and power, by benchmarks.validation.power"
STORE = Path(__file__).with_name("results.json")


def main() -> None:
    """Go on where the last run stopped, and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", default="plain_hg")
    parser.add_argument("--null", type=int, default=N_NULL)
    parser.add_argument("--loops", type=int, default=0)
    parser.add_argument("--effect-loops", action="store_true")
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    only = arguments.only.split(",") if arguments.only else []
    whole = json.loads(STORE.read_text()) if STORE.exists() else {"cases": {}}
    store = whole["cases"].setdefault(arguments.case, {"effects": {}})
    effects = store["effects"]

    def save():
        """Keep what is there."""
        STORE.write_text(json.dumps(whole, indent=1) + "\n")

    with computing():
        case = Case(arguments.case)
        if store.get("null", {"sets": 0})["sets"] < arguments.null:
            store["null"] = false_alarms(case, arguments.null)
            save()
        for name, reason in case.model.listed.not_testable.items():
            effects.setdefault(name, {"reason": reason})
        for position, candidate in enumerate(case.candidates):
            name = candidate.name
            if name in effects or (only and name not in only):
                continue
            effects[name] = power(case, position, name)
            print(name, effects[name], flush=True)
            save()
        if arguments.loops:
            null_loops(case, arguments.loops, store, save)
        if arguments.effect_loops:
            effect_loops(case, store, only, save)
    save()
    write_section("diagnosis.md", MARK, page(whole))


if __name__ == "__main__":
    main()
