#!/usr/bin/env python3
"""What larger models would take, from the runs of benches/growth.py.

    python3 benches/growth.py --large --only dofs
    python3 benches/growth.py --large --only pairs --points 9
    python3 benches/beyond/extrapolate.py [output/growth/*/*]

Reads summary.json of each run. Runs of 72 pairs give the growth in the free dofs n: least squares through the logarithms of the last
three (`fit`), and from the last one with the exponents that nested dissection has in three dimensions (`bound`): n^(4/3) numbers, n^2
operations. The other runs give what the pairs N add to that: copies of a dense matrix of 72 N^2 bytes, and seconds. Their exponent is
that of the last two runs. Standard library only.
"""

import json
import math
import statistics
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "scripts"))
import origin  # noqa: E402

BOUND = {"elements, GiB": 4 / 3, "peak, GiB": 4 / 3, "elements, s": 2, "reduction, s": 2}


def measured(folder):
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    stages = {stage["id"]: stage for stage in summary["stages"]}
    seconds = {stage: stages[stage]["processor_seconds"] for stage in ("finite_elements", "reduction", "static_state", "response")}
    return {
        "pairs": summary["pairs"],
        "dofs": sum(body["free_dofs"] for body in summary["mesh"]["bodies"]),
        "elements, GiB": stages["finite_elements"]["peak_memory_mib"] / 1024,
        "peak, GiB": max(stage["peak_memory_mib"] or 0 for stage in summary["stages"]) / 1024,
        "elements, s": seconds["finite_elements"],
        "reduction, s": seconds["reduction"],
        "static, s": seconds["static_state"],
        "a frequency, s": seconds["response"] / summary["response"]["points"],
    }


def power(runs, x, y, e=None):
    """Exponent and value of c x^e, by least squares through the logarithms."""
    xs, ys = ([math.log(run[key]) for run in runs] for key in (x, y))
    e = e or statistics.linear_regression(xs, ys).slope
    log = statistics.mean(ys) - e * statistics.mean(xs)
    return e, lambda at: math.exp(log + e * math.log(at))


def table(*rows):
    for row in (*rows[:1], ["---"] * len(rows[0]), *rows[1:]):
        print("| " + " | ".join(c if isinstance(c, str) else f"{c:.3g}" for c in row) + " |")
    print(flush=True)


def largest(needs, room):
    """The largest x at which an increasing function stays within the room."""
    low, high = 1.0, 1e12
    for _ in range(200):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if needs(middle) <= room else (low, middle)
    return low


def main():
    folders = [Path(word) for word in sys.argv[1:]] or sorted((ROOT / "output/growth").glob("*/*"))
    runs = [measured(folder) for folder in folders if (folder / "summary.json").exists()]
    by_dofs = sorted((run for run in runs if run["pairs"] == 72), key=lambda run: run["dofs"])
    by_pairs = sorted((run for run in runs if run["pairs"] > 72), key=lambda run: run["pairs"])
    fit = {key: power(by_dofs[-3:], "dofs", key) for key in BOUND}
    bound = {key: power(by_dofs[-1:], "dofs", key, e) for key, e in BOUND.items()}
    table(
        ["free dofs, 72 pairs", "", *BOUND],
        *([str(run["dofs"]), "measured", *(run[key] for key in BOUND)] for run in by_dofs),
        ["**exponent**", "fit", *(fit[key][0] for key in BOUND)],
        *([f"{dofs:.0e}", f"extrapolated, {name}", *(of[key][1](dofs) for key in BOUND)]
          for dofs in (1e6, 1e7, 1e8) for name, of in (("fit", fit), ("bound", bound))),
    )  # fmt: skip

    # What the pairs add to the model without them.
    def dense(pairs):
        return 72 * pairs**2 / 2**30

    peak, seconds = fit["peak, GiB"][1], fit["reduction, s"][1]
    for run in by_pairs:
        run["copies"] = (run["peak, GiB"] - peak(run["dofs"])) / dense(run["pairs"])
        run["added"] = run["reduction, s"] - seconds(run["dofs"])
    copies = by_pairs[-1]["copies"]
    grows = {key: power(by_pairs[-2:], "pairs", key) for key in ("dofs", "added", "static, s", "a frequency, s")}

    def extrapolated(pairs):
        dofs, added, static, frequency = (of(pairs) for _, of in grows.values())
        return dofs, peak(dofs) + copies * dense(pairs), peak(dofs), copies, seconds(dofs) + added, static, frequency

    keys = ("static, s", "a frequency, s")
    table(
        ["pairs", "free dofs", "", "peak, GiB", "of it sparse", "copies of 72 N^2 bytes", "reduction, s", *keys],
        *([str(run["pairs"]), str(run["dofs"]), "measured", run["peak, GiB"], peak(run["dofs"]), run["copies"], run["reduction, s"],
           *(run[key] for key in keys)] for run in by_pairs),
        ["**exponent**", grows["dofs"][0], "last two", "", "", "", *(grows[key][0] for key in ("added", *keys))],
        *([f"{pairs:.0e}", f"{dofs:.2g}", "extrapolated", *more] for pairs in (1e4, 1e5) for dofs, *more in [extrapolated(pairs)]),
    )  # fmt: skip
    needs = {
        "dofs: elements": fit["elements, GiB"][1],
        "dofs: reduction": peak,
        "dofs: reduction, bound": bound["peak, GiB"][1],
        "pairs": lambda pairs: extrapolated(pairs)[1],
        "pairs: K, M and half of K": lambda pairs: 2.25 * dense(pairs),
    }
    table(["memory, GiB", *needs], *([str(room), *(largest(of, room) for of in needs.values())] for room in (24, 256, 1024)))


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
