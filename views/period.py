"""ParaView: the motion at the peak through its period, from the harmonics of peak.vtu.

    DOVETAIL_OUT=output/paper paraview --script=views/period.py

The time of the animation goes through one period, in degrees. The bodies are moved by `oscillation_m`,
the motion without its mean, so that it can be seen; the lines are the bodies at their mean. It begins
where the motion is largest.
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(globals().get("__file__", "views/flanks.py"))))
import colours
import numpy as np
import shared
from paraview import simple as pv

STEPS = 48
# The largest motion that is drawn, of the size of the bodies.
DRAWN = 0.08
DISTANCE = "distance from the mean, mm"

folder = shared.Folder()
peak = folder.open("peak.vtu")
surface = pv.ExtractSurface(registrationName="surface", Input=peak)
times = [360 * step / STEPS for step in range(STEPS)]

motion = pv.ProgrammableFilter(registrationName="motion", Input=surface)
motion.OutputDataSetType = "Same as Input"
motion.CopyArrays = 0
motion.RequestInformationScript = f"""
from paraview.vtk import vtkStreamingDemandDrivenPipeline as pipeline
information = self.GetOutputInformation(0)
times = {times}
information.Set(pipeline.TIME_STEPS(), times, len(times))
information.Set(pipeline.TIME_RANGE(), [0.0, 360.0], 2)
"""
motion.Script = f"""
import numpy as np
from paraview.vtk import vtkStreamingDemandDrivenPipeline as pipeline
information = self.GetOutputInformation(0)
key = pipeline.UPDATE_TIME_STEP()
phase = np.radians(information.Get(key) if information.Has(key) else 0.0)
arrays = inputs[0].PointData
moving, k = 0 * arrays["mean_m"], 1
while f"h{{k}}_cos_m" in arrays.keys():
    moving = (moving + np.cos(k * phase) * arrays[f"h{{k}}_cos_m"]
              + np.sin(k * phase) * arrays[f"h{{k}}_sin_m"])
    k += 1
output.PointData.append(moving, "oscillation_m")
output.PointData.append(arrays["mean_m"] + moving, "displacement_m")
output.PointData.append(1e3 * np.linalg.norm(moving, axis=1), "{DISTANCE}")
"""


distances = shared.at_each(motion, DISTANCE, times)
most = np.max(distances)
ends = np.array(shared.Fetch(surface).GetBounds()).reshape(3, 2)
size = np.linalg.norm(np.ptp(ends, axis=1))
factor = float(f"{DRAWN * size / (1e-3 * most):.1g}") if most > 0 else 1.0

layout = shared.empty_layout("period")
view = shared.render_view()
layout.AssignView(0, view)
shared.outline(surface, view)
moved = pv.WarpByVector(registrationName="moved", Input=motion)
moved.Vectors = ["POINTS", "oscillation_m"]
moved.ScaleFactor = factor
display = pv.Show(moved, view)
display.Ambient, display.Diffuse = 0.35, 0.65
shared.edges(moved, view)
shared.colour(display, view, DISTANCE, most, DISTANCE, colours.BODIES)
size = "in its own size" if factor == 1 else (
    f"drawn {factor:,.0f} times as large" if factor > 1 else f"drawn {factor:g} times as large")
response = folder.summary["response"]
shared.words(view, f"motion at {folder.peak_hz:.2f} Hz, {size}\n"
             f"at most {most:.2g} mm in any direction; {response['observation']}: "
             f"{1e3 * response['peak_amplitude_m']:.2g} mm along its direction")
shared.times(view, motion, "{time:.0f} degrees of the period")
# What is shown first moves a camera.
pv.RenderAllViews()
shared.look_at(view, ends, 1.25)
shared.animate(times, times[int(np.argmax(distances))])
shared.finish(layout, 1000, 800)
