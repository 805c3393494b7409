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
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
GIB = 2.0**30
BOUND = {"elements, GiB": 4 / 3, "peak, GiB": 4 / 3, "elements, s": 2, "reduction, s": 2}


def measured(folder):
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    stages = {stage["id"]: stage for stage in summary["stages"]}
    points = summary["response"]["points"]
    return {
        "pairs": summary["pairs"],
        "dofs": sum(body["free_dofs"] for body in summary["mesh"]["bodies"]),
        "elements, GiB": stages["finite_elements"]["peak_memory_mib"] / 1024,
        "peak, GiB": max(stage["peak_memory_mib"] or 0 for stage in summary["stages"]) / 1024,
        "elements, s": stages["finite_elements"]["processor_seconds"],
        "reduction, s": stages["reduction"]["processor_seconds"],
        "static, s": stages["static_state"]["processor_seconds"],
        "a frequency, s": stages["response"]["processor_seconds"] / points,
    }


class Power:
    """c x^e, by least squares through the logarithms."""

    def __init__(self, points, e=None):
        logs = [(math.log(x), math.log(y)) for x, y in points]
        mx, my = (sum(p[i] for p in logs) / len(logs) for i in (0, 1))
        if e is None:
            e = sum((x - mx) * (y - my) for x, y in logs) / sum((x - mx) ** 2 for x, _ in logs)
        self.e, self.log = e, my - e * mx

    def __call__(self, x):
        return math.exp(self.log + self.e * math.log(x))

    def inverse(self, y):
        return math.exp((math.log(y) - self.log) / self.e)


def row(*cells):
    print("| " + " | ".join(c if isinstance(c, str) else f"{c:.3g}" for c in cells) + " |", flush=True)


def heads(*cells):
    print()
    row(*cells)
    row(*["---"] * len(cells))


def largest(fits, room):
    """The largest x at which an increasing function stays within the room."""
    low, high = 1.0, 1e12
    for _ in range(200):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if fits(middle) <= room else (low, middle)
    return low


def main():
    folders = [Path(word) for word in sys.argv[1:]] or sorted((ROOT / "output/growth").glob("*/*"))
    runs = [measured(folder) for folder in folders if (folder / "summary.json").exists()]
    by_dofs = sorted((run for run in runs if run["pairs"] == 72), key=lambda run: run["dofs"])
    by_pairs = sorted((run for run in runs if run["pairs"] > 72), key=lambda run: run["pairs"])
    if len(by_dofs) < 3 or len(by_pairs) < 2:
        raise SystemExit("at least three runs of 72 pairs and two of more are needed: benches/growth.py --large")
    keys = list(BOUND)

    heads("free dofs, 72 pairs", "", *keys)
    for run in by_dofs:
        row(str(run["dofs"]), "measured", *(run[key] for key in keys))
    fit = {key: Power([(run["dofs"], run[key]) for run in by_dofs[-3:]]) for key in keys}
    bound = {key: Power([(by_dofs[-1]["dofs"], by_dofs[-1][key])], e) for key, e in BOUND.items()}
    row("**exponent**", "fit", *(fit[key].e for key in keys))
    for dofs in (1e6, 1e7, 1e8):
        for name, power in (("fit", fit), ("bound", bound)):
            row(f"{dofs:.0e}", f"extrapolated, {name}", *(power[key](dofs) for key in keys))

    # What the pairs add to the model without them.
    def sparse(key, dofs):
        return fit[key](dofs)

    heads("pairs", "free dofs", "", "peak, GiB", "of it sparse", "copies of 72 N^2 bytes", "reduction, s", "static, s", "a frequency, s")
    for run in by_pairs:
        dense = 72 * run["pairs"] ** 2 / GIB
        run["copies"] = (run["peak, GiB"] - sparse("peak, GiB", run["dofs"])) / dense
        run["added"] = run["reduction, s"] - sparse("reduction, s", run["dofs"])
        row(str(run["pairs"]), str(run["dofs"]), "measured", run["peak, GiB"], sparse("peak, GiB", run["dofs"]), run["copies"],
            run["reduction, s"], run["static, s"], run["a frequency, s"])  # fmt: skip
    last = by_pairs[-2:]
    copies = last[-1]["copies"]
    grows = {key: Power([(run["pairs"], run[key]) for run in last]) for key in ("dofs", "added", "static, s", "a frequency, s")}
    row("**exponent**", grows["dofs"].e, "last two", "", "", "", grows["added"].e, grows["static, s"].e, grows["a frequency, s"].e)

    def peak(pairs, dofs):
        return sparse("peak, GiB", dofs) + copies * 72 * pairs**2 / GIB

    for pairs in (1e4, 1e5):
        dofs = grows["dofs"](pairs)
        row(f"{pairs:.0e}", f"{dofs:.2g}", "extrapolated", peak(pairs, dofs), sparse("peak, GiB", dofs), copies,
            sparse("reduction, s", dofs) + grows["added"](pairs), grows["static, s"](pairs), grows["a frequency, s"](pairs))  # fmt: skip

    heads("memory, GiB", "dofs: elements", "dofs: reduction", "dofs: reduction, bound", "pairs", "pairs: K, M and half of K")
    for room in (24, 256, 1024):
        row(str(room), fit["elements, GiB"].inverse(room), fit["peak, GiB"].inverse(room), bound["peak, GiB"].inverse(room),
            largest(lambda pairs: peak(pairs, grows["dofs"](pairs)), room),
            largest(lambda pairs: 2.25 * 72 * pairs**2 / GIB, room))  # fmt: skip


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
