"""ParaView: pressure and status on the flanks over the frequencies of a run, each flank as the maps
show it.

    DOVETAIL_OUT=output/paper paraview --script=views/flanks.py

The time of the animation is the frequency in Hz. It begins at the peak.
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(globals().get("__file__", "views/flanks.py"))))
import shared

folder = shared.Folder()
series = folder.open("flank.pvd")
times = list(series.TimestepValues)
PRESSURE = "mean pressure, MPa"
pressure = shared.scaled(series, "pressure_mean_pa", 1e-6, PRESSURE)
most = max(shared.at_each(pressure, PRESSURE, times))


def of_pressure(flanks, contact, frame, view):
    display = flanks.show(pressure, contact, frame, view)
    shared.colour(display, view, PRESSURE, most,
                  "mean pressure of the period, MPa")
    shared.times(view, series, "{time:.2f} Hz")


def of_status(flanks, contact, frame, view):
    display = flanks.show(series, contact, frame, view)
    shared.colour_by_status(display, view, "what the pairs do")
    shared.times(view, series, "{time:.2f} Hz")


flanks = shared.Flanks("flanks", folder, [of_pressure, of_status])
shared.animate(times, folder.peak_hz)
shared.finish(flanks.layout, 1400, 350 * len(flanks.flanks))
