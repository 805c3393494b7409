"""Medians and ratios of the log that compare.sh writes."""

import re
import statistics
import sys
from collections import defaultdict

PARTS = ["analysis", "factor", "solve 256"]
seconds = defaultdict(list)
memory = defaultdict(int)
for line in open(sys.argv[1]):
    if line.startswith("= "):
        _, program, threads, mesh = line.split()
        key = (mesh, int(threads), program)
    found = re.match(r"(.*?) +([\d.]+) s wall +([\d.]+) s processor +(\d+) MiB", line)
    if found and found[1] in PARTS:
        clock = found[3] if key[1] == 1 else found[2]
        seconds[*key, found[1]].append(float(clock))
        memory[key] = max(memory[key], int(found[4]))
print("| mesh | threads | program | analysis | factor | 256 right-hand sides | MiB | factor + solves over the best peer |")
print("| --- | --- | --- | --- | --- | --- | --- | --- |")
for mesh, threads in dict.fromkeys((mesh, threads) for mesh, threads, _ in memory):
    middle = {
        program: [statistics.median(seconds[mesh, threads, program, part]) for part in PARTS]
        for program in ["dovetail", "cholmod", "mumps"]
    }
    best = min(sum(middle[peer][1:]) for peer in ["cholmod", "mumps"])
    for program, times in middle.items():
        shown = " | ".join(f"{t:.2f}" for t in times)
        ratio = sum(times[1:]) / best
        print(f"| {mesh} | {threads} | {program} | {shown} | {memory[mesh, threads, program]} | {ratio:.2f} |")
