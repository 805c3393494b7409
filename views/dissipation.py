"""ParaView: where friction dissipates: over all frequencies of a run, and at each of them.

    DOVETAIL_OUT=output/paper paraview --script=views/dissipation.py

Left: friction power per area, summed over the frequencies asked for (the paper's Figure 6). Right:
at the frequency that the time of the animation is, in Hz. It begins at the peak.
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(globals().get("__file__", "views/flanks.py"))))
import shared

folder = shared.Folder()
series = folder.open("flank.pvd")
times = list(series.TimestepValues)
ALL, ONE = "summed power, MW/m2", "power, kW/m2"
summed = shared.scaled(folder.open("flank_dissipation.vtu"), "dissipation_sum_w_m2", 1e-6, ALL)
single = shared.scaled(series, "dissipation_w_m2", 1e-3, ONE)
[most_of_all] = shared.at_each(summed, ALL, [0])
most_of_one = max(shared.at_each(single, ONE, times))


def over_all(flanks, contact, frame, view):
    display = flanks.show(summed, contact, frame, view)
    shared.colour(display, view, ALL, shared.POWER, most_of_all,
                  "friction power, sum of all frequencies, MW/m2")


def at_one(flanks, contact, frame, view):
    display = flanks.show(single, contact, frame, view)
    shared.colour(display, view, ONE, shared.POWER, most_of_one, "friction power, kW/m2")
    shared.times(view, series, "{time:.2f} Hz")


flanks = shared.Flanks("dissipation", folder, [over_all, at_one])
shared.animate(times, folder.peak_hz)
shared.finish(flanks.layout, 1400, 350 * len(flanks.contacts))
