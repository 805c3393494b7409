"""Medians and ratios of the log that compare.sh writes, one table for each task."""

import re
import statistics
import sys
from collections import defaultdict
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

# Parts of a task, and those whose sum is compared.
TASKS = {
    "solve": (["analysis", "factor", "solve 1", "solve 8", "solve 16", "solve 256"], ["factor", "solve 256"]),
    "inertia": (["inertia"], ["inertia"]),
    "modes": (["30 modes"], ["30 modes"]),
}
OWN = {"solve": "dovetail", "inertia": "dovetail", "modes": "blocks"}

seconds = defaultdict(list)
memory = defaultdict(int)
for line in open(sys.argv[1]):
    if line.startswith("= "):
        _, task, program, threads, mesh = line.split()
        key = (task, mesh, int(threads), program)
    found = re.match(r"(.*?) +([\d.]+) s wall +([\d.]+) s processor +(\d+) MiB", line)
    if found:
        clock = found[3] if key[2] == 1 else found[2]
        seconds[*key, found[1]].append(float(clock))
        memory[key] = max(memory[key], int(found[4]))


def median(key, part):
    times = seconds[*key, part]
    return statistics.median(times) if times else None


print(origin.line() + "\n")
for task, (parts, counted) in TASKS.items():
    print(f"| mesh | threads | program | {' | '.join(parts)} | MiB | {' + '.join(counted)} over dovetail |")
    print("| --- " * (len(parts) + 5) + "|")
    for key in (key for key in memory if key[0] == task):
        shown = [median(key, part) for part in parts]
        shown = " | ".join("" if t is None else f"{t:.3f}" for t in shown)
        own = (*key[:3], OWN[task])
        ratio = sum(median(key, p) for p in counted) / sum(median(own, p) for p in counted)
        print(f"| {key[1]} | {key[2]} | {key[3]} | {shown} | {memory[key]} | {ratio:.2f} |")
    print()
