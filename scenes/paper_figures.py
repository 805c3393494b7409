#!/usr/bin/env python3
"""Redraws Figures 3 to 6 of the paper from a run of scenes/paper.toml on a grid, like the paper's.

    dovetail run scenes/paper.toml --set response.points=200 --out output/paper_grid
    python3 scenes/paper_figures.py output/paper_grid output/paper_figures

Figures 3 and 4 are the response with one and with three harmonics, beside the linear one. Figures 5
and 6 are the flanks: at how many frequencies each pair separates, and the friction power of each
pair, summed over the frequencies. Both sums grow with the number of frequencies. The second folder is created; its files are fig3.svg to fig6.svg.
Needs python3 with matplotlib (pip install matplotlib).
"""

import csv
import sys
from pathlib import Path

try:
    import matplotlib
except ImportError:
    print("cannot start: no matplotlib. Remedy: pip install matplotlib", file=sys.stderr)
    sys.exit(2)

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402  (the backend comes first)


def table(path):
    """Columns by heading; a cell without a number is None."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [number(row[name]) for row in rows] for name in rows[0]}


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return cell or None


def summed(contact, mean):
    """Sums over the frequencies of the grid, of their means: the paper shows sums."""
    return [m * n for m, n in zip(contact[mean], contact["converged_points"])]


def draw_response(path, name, response, label):
    figure, axes = pyplot.subplots(figsize=(7, 4.5), layout="constrained")
    frequency = response["frequency_hz"]
    for column, style, words in [
        ("tip_linear_amplitude_m", {"color": "0.4", "linestyle": "--"}, "linear"),
        ("tip_amplitude_m", {"color": "tab:blue"}, label),
    ]:
        points = [(f, 1e3 * a) for f, a in zip(frequency, response[column]) if a is not None]
        axes.plot(*zip(*points), label=words, **style)
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude of the tip (mm)", title=name)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, frameon=False)
    figure.savefig(path)
    pyplot.close(figure)


def draw_flanks(path, name, contact, values, unit):
    """A panel per flank: along the slot to the right, outwards up, a mark per pair."""
    flanks = sorted(set(contact["contact"]))
    figure, panels = pyplot.subplots(len(flanks), figsize=(8, 4.5), layout="constrained",
                                     sharex=True, squeeze=False)
    for panel, flank in zip(panels[:, 0], flanks):
        own = [i for i, c in enumerate(contact["contact"]) if c == flank]
        along = [1e3 * contact["x_m"][i] for i in own]
        radius = [1e3 * contact["z_m"][i] for i in own]
        shown = panel.scatter(along, radius, c=[values[i] for i in own], s=260, marker="s",
                              vmin=0, vmax=max(values) or 1)
        panel.set(title=f"{flank} flank", ylabel="radius (mm)")
        panel.margins(0.06, 0.25)
    panels[-1, 0].set_xlabel("along the slot (mm)")
    figure.colorbar(shown, ax=panels[:, 0], label=unit)
    figure.suptitle(name)
    figure.savefig(path)
    pyplot.close(figure)


def main():
    if len(sys.argv) != 3 or not (Path(sys.argv[1]) / "contact.csv").is_file():
        print("usage: paper_figures.py OUTPUT_FOLDER FIGURE_FOLDER (of a run of scenes/paper.toml)",
              file=sys.stderr)
        return 2
    run, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    draw_response(out / "fig3.svg", "Figure 3: one harmonic", table(run / "response_h1.csv"), "H = 1")
    draw_response(out / "fig4.svg", "Figure 4: three harmonics", table(run / "response.csv"), "H = 3")
    contact = table(run / "contact.csv")
    draw_flanks(out / "fig5.svg", "Figure 5: pairs that separate", contact,
                summed(contact, "opening_share"), "frequencies")
    draw_flanks(out / "fig6.svg", "Figure 6: friction power, summed over the frequencies", contact,
                summed(contact, "friction_power_mean_w"), "W")
    print(f"Figures 3 to 6 in {out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
