"""ParaView: where the flanks wear, over the frequencies of a run.

    DOVETAIL_OUT=output/paper paraview --script=views/wear.py

Left: energy that friction takes in a period, per area. Right: distance slid in a period. The time of
the animation is the frequency in Hz. It begins at the peak.
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(globals().get("__file__", "views/flanks.py"))))
import shared

folder = shared.Folder()
series = folder.open("flank.pvd")
times = list(series.TimestepValues)
ENERGY, SLIP = "energy, J/m2", "slip, um"
energy = shared.scaled(series, "friction_energy_j_m2", 1, ENERGY)
slip = shared.scaled(series, "slid_m", 1e6, SLIP)
most_energy = max(shared.at_each(energy, ENERGY, times))
most_slip = max(shared.at_each(slip, SLIP, times))


def of_energy(flanks, contact, frame, view):
    display = flanks.show(energy, contact, frame, view)
    shared.colour(display, view, ENERGY, most_energy,
                  "energy taken by friction in a period, J/m2")
    shared.times(view, series, "{time:.2f} Hz")


def of_slip(flanks, contact, frame, view):
    display = flanks.show(slip, contact, frame, view)
    shared.colour(display, view, SLIP, most_slip, "distance slid in a period, um")
    shared.times(view, series, "{time:.2f} Hz")


flanks = shared.Flanks("wear", folder, [of_energy, of_slip])
shared.animate(times, folder.peak_hz)
shared.finish(flanks.layout, 1400, 350 * len(flanks.flanks))
