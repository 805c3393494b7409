#!/usr/bin/env python3
"""Writes tables of docs/study_results.md from the folder of a study.

    python3 scripts/study_tables.py FOLDER settings FIGURE
        each numerical parameter: of each value the estimated error of the figure, and what it took
    python3 scripts/study_tables.py FOLDER cases CASE ...
        the figures of these cases, with their differences from the finest, and the orders that show

The first line says from which commit the program was built that made the folder, and on which day.
"""

import csv
import json
import sys
from pathlib import Path

# Ends of headings: what is written, and the factor to it.
UNITS = {
    "_j_m2": ("J/m²", 1),
    "_hz": ("Hz", 1),
    "_pa": ("MPa", 1e-6),
    "_n": ("N", 1),
    "_w": ("W", 1),
    "_m": ("mm", 1e3),
    "_mib": ("MiB", 1),
}


def digits(value, count):
    """So many digits in all, without an exponent where that is short."""
    if value == 0 or (float(value).is_integer() and abs(value) < 1e6):
        return f"{value:.0f}"
    power = int(f"{value:.{count - 1}e}".split("e")[1])
    if not -4 <= power < 6:
        return f"{value:.{count - 1}e}".replace("e-0", "e-")
    return f"{value:.{max(0, count - 1 - power)}f}"


def percent(share):
    return f"{digits(100 * share, 2)} %"


def order(limit):
    """The order that the values of a parameter show, in words."""
    if limit["how"] == "richardson":
        return f"{limit['order']:.1f}"
    return {"finest": "none shows", "unchanged": "no influence"}.get(limit["how"], "no sizes")


def print_table(summary, header, rows):
    print(f"Measured at commit {summary['commit']}, {summary['day']}.\n")
    for row in [header, ["---"] * len(header), *rows]:
        print("| " + " | ".join(row) + " |")


def settings(summary, cases, figure):
    rows = []
    for refinement in summary["refinements"]:
        names = {p["name"]: p["values"] for p in summary["parameters"]}[refinement["parameter"]]
        of = next(f for f in refinement["figures"] if f["figure"] == figure)
        # Values without sizes are compared with the last one, each by itself.
        by_size = of["limit"]["how"] != "reference"
        errors = of["estimated_errors" if by_size else "differences"]
        values = []
        for name, case, error in zip(names, refinement["cases"], errors):
            seconds = digits(float(cases[case]["processor_seconds"]), 2)
            values.append(f"{name}: {percent(error)} ({seconds})" if error else f"{name} ({seconds})")
        rows.append([refinement["parameter"].replace("_", " "), ", ".join(values), order(of["limit"])])
    header = ["parameter", "values: estimated error (processor seconds)", "order"]
    print_table(summary, header, rows)


def of_cases(folder, summary, cases, names):
    chosen = [cases[name] for name in names]
    shown = [p["name"] for p in summary["parameters"]]
    header = [", ".join(case[p] for p in shown) for case in chosen]
    found = [r for r in summary["refinements"] if r["cases"] == names]
    orders = {f["figure"]: order(f["limit"]) for r in found for f in r["figures"]}
    pairs = [json.loads((folder / "cases" / n / "summary.json").read_text())["pairs"] for n in names]
    rows = [["pairs", *map(str, pairs)]]
    figures = [h for h in chosen[0] if f"difference_{h}" in chosen[0]]
    for heading in ["processor_seconds", "peak_memory_mib", *figures]:
        end = next((end for end in UNITS if heading.endswith(end)), "")
        unit, factor = UNITS.get(end, ("", 1))
        if heading.endswith(("slip_m", "slid_m")):
            unit, factor = "µm", 1e6
        words = heading.removesuffix(end).replace("_", " ")
        row = [f"{words} ({unit})" if unit else words]
        for case in chosen:
            cell = digits(factor * float(case[heading]), 5 if heading in figures else 3)
            difference = float(case.get(f"difference_{heading}", 0))
            row.append(cell + (f" ({percent(difference)})" if difference else ""))
        rows.append(row)
    if orders:
        header.append("order")
        rows = [[*row, orders.get(figure, "")] for row, figure in zip(rows, ["", "", "", *figures])]
    print_table(summary, ["", *header], rows)


def main():
    if len(sys.argv) < 4 or sys.argv[2] not in ("settings", "cases"):
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    summary = json.loads((folder / "summary.json").read_text())
    with open(folder / "table.csv", newline="") as file:
        cases = {row["case"]: row for row in csv.DictReader(file)}
    if sys.argv[2] == "settings":
        settings(summary, cases, sys.argv[3])
    else:
        of_cases(folder, summary, cases, sys.argv[3:])


if __name__ == "__main__":
    main()
