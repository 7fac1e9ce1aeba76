"""Text of the part of docs/manual/diagnosis.md on false alarms and power."""

from pathlib import Path

from scipy.stats import beta, binom

from benchmarks.pages import filled, machine, table
from benchmarks.validation.power.cases import ACCURACY
from benchmarks.validation.power.study import FACTORS, LEVEL, LOOPED, N_SETS, TOO_WEAK
from jaxink.diagnosis import VerdictCode
from jaxink.effects import CATALOGUE


def upper_limit(count: int, total: int) -> float:
    """One-sided 95 % upper confidence limit of a share (Clopper, Pearson 1934)."""
    return 1.0 if count == total else float(beta.ppf(0.95, count + 1, total - count))


def measured_effects(store: dict) -> dict[str, tuple[str, dict]]:
    """Effects with their case, the first case that can tell of each."""
    found: dict[str, tuple[str, dict]] = {}
    for case_name, case in store["cases"].items():
        for name, one in case["effects"].items():
            if "reason" not in one:
                found.setdefault(name, (case_name, one))
    return found


def effect_row(name: str, case_name: str, found: dict) -> list[str]:
    """Row of an effect that the case can tell of."""
    anew = found.get("own_screens", [])
    shares = [f"{found['named'].get(str(f), '-')}{' *' * (str(f) in anew)}" for f in FACTORS]
    two = found["named"].get("2.0")
    limit = "-" if two is None else f"{100 * upper_limit(two, N_SETS):.0f} %"
    size = f"{found['limit']:.3g} {found['unit']}"
    loop = found.get("loop")
    named = "-" if loop is None else ", ".join(loop[1:]) or loop[0]
    return [name, case_name, size, found["setting"] or "-", *shares, limit, named]


def reasons_of(store: dict, seen: dict) -> dict[str, str]:
    """Why others are not seen: what a case says that could tell, rather than one that has no such thing."""
    reasons: dict[str, str] = {}
    for case_name, case in store["cases"].items():
        for name, found in case["effects"].items():
            reason = found.get("reason", "")
            if reason and name not in seen and (name not in reasons or reason == TOO_WEAK):
                reasons[name] = f"{reason} (`{case_name}`)" if reason == TOO_WEAK else reason
    return reasons


def null_line(name: str, sets: int, called: int) -> str:
    """False alarms of a case."""
    low, high = (int(binom.ppf(share, sets, LEVEL)) for share in (0.025, 0.975))
    return (
        f"- Without an effect, `{name}`: {called} of {sets} data sets have a candidate detected at the "
        f"{100 * LEVEL:.0f} % level ({low} to {high} expected)."
    )


def page(store: dict) -> str:
    """The section."""
    seen = measured_effects(store)
    reasons = reasons_of(store, seen)
    names = [effect.name for effect in CATALOGUE]
    missing = [name for name in names if name not in reasons and name not in seen]
    nulls = [null_line(name, **case["null"]) for name, case in store["cases"].items() if "null" in case]
    loops = [(name, code) for name, case in store["cases"].items() for code in case.get("loops", [])]
    misfits = [code for _, code in loops if code[0] != VerdictCode.NO_MISFIT]
    which = "; ".join(f"{code[0]} {', '.join(code[1:])}".strip() for code in misfits)
    header = ["effect", "case", "detection limit", "at", *(f"{f:g} x" for f in FACTORS)]
    header += ["upper limit at 2 x", "found"]
    return filled(
        Path(__file__).with_name("power.md.in"),
        machine=machine(),
        coarse=ACCURACY["coarse_plain_hg"],
        nulls="\n".join(nulls),
        loops=len(loops),
        loop_cases=", ".join(dict.fromkeys(f"`{name}`" for name, _ in loops)) or "not run",
        misfits=len(misfits),
        which=f": {which}" if which else "",
        sets=N_SETS,
        looped=LOOPED,
        effects=table(header, [effect_row(name, *found) for name, found in seen.items()]),
        unseen=table(["effect", "why"], [[name, reasons[name]] for name in names if name in reasons]),
        not_run=f"Not run yet: {', '.join(missing)}." if missing else "",
    )
