"""docs/optimisers.md from the kept searches."""


def write(kept: dict[str, list[dict]]) -> None:
    for name, lines in kept.items():
        best = min((l["loss"] for l in lines if l["loss"] is not None), default=None)
        if best is None:
            continue
        by = {}
        for l in lines:
            by.setdefault((l["method"], l.get("scan", "")), []).append(l)
        print(name, "best", best)
        for key, ls in by.items():
            ok = sum(l["loss"] is not None and l["loss"] <= 1.01 * best for l in ls)
            import statistics as st

            print(
                "   ",
                str(key).ljust(44),
                f"{ok}/{len(ls)}",
                "ev",
                st.median(l["evaluations"] for l in ls),
                "jac",
                st.median(l["jacobians"] for l in ls),
                "s",
                round(st.median(l["seconds"] for l in ls), 2),
                [l["outcome"][:5] + f":{l['loss']:.5g}" for l in ls][:6],
            )
