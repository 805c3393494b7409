"""What the views have in common: the folder of a run, its flanks beside each other, colours, pictures."""

import json
import os
from pathlib import Path

import colours
import numpy as np
from paraview import simple as pv
from paraview.servermanager import Fetch
from vtkmodules.util.numpy_support import vtk_to_numpy

INK, STEEL = colours.unit(colours.INK), colours.unit(colours.STEEL)
# Flanks that fit below each other.
MOST_ROWS = 4


class Folder:
    """A folder of `dovetail run`: the one that DOVETAIL_OUT names, else the current one."""

    def __init__(self):
        self.path = Path(os.environ.get("DOVETAIL_OUT") or ".").absolute()
        summary = self.path / "summary.json"
        if not summary.exists():
            raise RuntimeError(
                f"{self.path} holds no run of dovetail (no summary.json). Name its folder: "
                "DOVETAIL_OUT=output/paper paraview --script=views/flanks.py")
        self.summary = json.loads(summary.read_text(encoding="utf-8"))
        self.peak_hz = (self.summary.get("response") or {}).get("peak_frequency_hz")

    def open(self, name):
        path = self.path / name
        if not path.exists():
            raise RuntimeError(
                f"{path} is missing: `dovetail run`, without --no-fields, writes it where the scene "
                "has contacts that slip and frequencies that converged")
        reader = {".vtu": pv.XMLUnstructuredGridReader, ".pvd": pv.PVDReader}[path.suffix]
        opened = reader(registrationName=name, FileName=str(path))
        opened.UpdatePipeline()
        return opened

    def flanks(self):
        """Each flank as the maps show it: `mesh.flanks` of summary.json."""
        found = (self.summary.get("mesh") or {}).get("flanks")
        if not found:
            raise RuntimeError(f"{self.path}/summary.json names no flanks: run the scene again")
        return found


def empty_layout(name):
    """A tab of its own; what ParaView begins with goes."""
    for view in pv.GetRenderViews():
        pv.Delete(view)
    for layout in list(pv.GetLayouts().values()):
        pv.RemoveLayout(layout)
    return pv.CreateLayout(name)


def render_view():
    view = pv.CreateView("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.OrientationAxesVisibility = 0
    view.CenterAxesVisibility = 0
    view.CameraParallelProjection = 1
    return view


def words(view, text, where="Upper Left Corner"):
    source = pv.Text(registrationName=f"text {text}", Text=text)
    style(pv.Show(source, view), where)


def times(view, source, text, where="Upper Right Corner"):
    """The time of the animation as a text, such as `frequency: {time:.2f} Hz`."""
    annotation = pv.AnnotateTimeFilter(registrationName=text.split(":")[0], Input=source)
    annotation.Format = text
    style(pv.Show(annotation, view), where)


def style(display, where):
    display.WindowLocation = where
    display.Color = INK
    display.FontSize = 15
    display.Justification = "Left"


def scaled(source, array, factor, name):
    """The array of the points in another unit."""
    made = pv.Calculator(registrationName=name, Input=source)
    made.Function = f'"{array}"*{factor}'
    made.ResultArrayName = name
    return made


def plain(source, view, frame):
    """As steel with its sharp edges, which stand a little before it, so that they are not hidden. What hides
    the flank, or lies far beside it, is cut off."""
    half = cut(source, frame, frame.before_flank())
    surface = pv.ExtractSurface(registrationName="surface", Input=half)
    # The other planes lie along the line of sight: what they cut off leaves no hole that is seen.
    for plane in frame.beside_flank():
        surface = cut(surface, frame, plane)
    surface = pv.ExtractSurface(registrationName="surface", Input=surface)
    display = pv.Show(surface, view)
    display.ColorArrayName = ["POINTS", ""]
    display.AmbientColor = display.DiffuseColor = STEEL
    display.Ambient, display.Diffuse = 0.35, 0.65
    edges(surface, view).Position = frame.before


def cut(source, frame, plane):
    """Without what lies beyond a plane: its distance from the centre of the flank, and its normal."""
    distance, normal = plane
    made = pv.Clip(registrationName="cut", Input=source)
    made.ClipType = "Plane"
    made.ClipType.Origin = [float(x) for x in frame.centre + distance * normal]
    made.ClipType.Normal = [float(x) for x in normal]
    made.Invert = 1
    return made


def outline(surface, view):
    """The sharp edges alone."""
    edges(surface, view).Opacity = 0.35


def edges(surface, view):
    found = pv.FeatureEdges(registrationName="edges", Input=surface)
    found.BoundaryEdges = 0
    found.NonManifoldEdges = 0
    lines = pv.Show(found, view)
    lines.ColorArrayName = ["POINTS", ""]
    lines.AmbientColor = lines.DiffuseColor = INK
    lines.LineWidth = 1.2
    return lines


def at_each(source, array, times_):
    """The largest value of an array of the points at each time."""
    found = []
    for time in times_:
        source.UpdatePipeline(time)
        found.append(source.PointData[array].GetRange()[1])
    return found


def colour(display, view, array, most, title, ramp=colours.VIRIDIS):
    """Colours by an array of the points, from 0 to the first round number from `most` on, with a bar."""
    pv.ColorBy(display, ("POINTS", array))
    table = pv.GetColorTransferFunction(array)
    table.AutomaticRescaleRangeMode = "Never"
    table.ColorSpace = "RGB"
    numbers = colours.ticks(most)
    stops = zip(np.linspace(0, numbers[-1], len(ramp)), ramp)
    table.RGBPoints = [number for at, stop in stops for number in (at, *colours.unit(stop))]
    shown = bar(table, view, title)
    shown.UseCustomLabels = 1
    shown.CustomLabels = numbers
    shown.AddRangeLabels = 0


def colour_by_status(display, view, title):
    pv.ColorBy(display, ("CELLS", "status"))
    table = pv.GetColorTransferFunction("status")
    table.InterpretValuesAsCategories = 1
    table.AnnotationsInitialized = 1
    words_of = [words for words, _ in colours.STATES]
    table.Annotations = [text for code, many in enumerate(words_of) for text in (str(code), many)]
    table.IndexedColors = [part for _, shown in colours.STATES for part in colours.unit(shown)]
    bar(table, view, title)


def bar(table, view, title):
    shown = pv.GetScalarBar(table, view)
    shown.Title = title
    shown.ComponentTitle = ""
    shown.TitleColor = shown.LabelColor = INK
    shown.TitleFontSize = shown.LabelFontSize = 14
    shown.ScalarBarThickness = 12
    shown.ScalarBarLength = 0.5
    shown.AutomaticLabelFormat = 0
    shown.LabelFormat = shown.RangeLabelFormat = "%.3g"
    shown.Orientation = "Horizontal"
    shown.WindowLocation = "Lower Center"
    shown.Visibility = 1
    return shown


class Flanks:
    """Views of each flank as the maps show it, with the body that lies behind it: a row for each
    contact, a column for each of `columns`, which are functions of a source, a display and a view."""

    def __init__(self, name, folder, columns):
        rest = folder.open("flank_static.vtu")
        bodies = folder.open("static.vtu")
        self.flanks = folder.flanks()[:MOST_ROWS]
        self.layout = layout = empty_layout(name)
        frames = []
        hints = split(0, len(self.flanks), layout.SplitVertical)
        for flank, hint in zip(self.flanks, hints):
            frame = Frame(Fetch(threshold(rest, "contact", flank["contact"])), flank)
            places = split(hint, len(columns), layout.SplitHorizontal)
            for column, place in zip(columns, places):
                view = render_view()
                layout.AssignView(place, view)
                if frame.behind is not None:
                    plain(threshold(bodies, "body", frame.behind), view, frame)
                column(self, flank["contact"], frame, view)
                left, right, below, above = flank["edges"]
                words(view, flank["name"])
                words(view, above, "Upper Center")
                words(view, left, "Lower Left Corner")
                words(view, right, "Lower Right Corner")
                frames.append((frame, view))
        # What is shown first moves a camera.
        pv.RenderAllViews()
        for frame, view in frames:
            frame.look(view)

    def show(self, source, contact, frame, view):
        """The flank of a contact, a little before the body."""
        display = pv.Show(threshold(source, "contact", contact), view)
        display.Position = frame.before
        display.Ambient, display.Diffuse = 0.6, 0.4
        return display


def split(cell, count, divide):
    """Cells of equal size in the place of one."""
    cells = []
    for left in range(count, 1, -1):
        children = divide(cell, 1 / left)
        cells.append(children)
        cell = children + 1
    return cells + [cell]


def threshold(source, array, value):
    found = pv.Threshold(registrationName=f"{array} {value}", Input=source)
    found.Scalars = ["CELLS", array]
    found.ThresholdMethod = "Between"
    found.LowerThreshold, found.UpperThreshold = value - 0.5, value + 0.5
    found.UpdatePipeline()
    return found


class Frame:
    """Where a flank is, and from where it is looked at: with the directions to the right and up that it
    has in the maps. That is from the side of the second body, or from that of the first."""

    def __init__(self, points, flank):
        points, normals = (vtk_to_numpy(array) for array in (
            points.GetPoints().GetData(), points.GetPointData().GetArray("normal")))
        self.right, self.up = np.array(flank["right"]), np.array(flank["up"])
        self.towards = np.cross(self.right, self.up)
        # `normal` leads from the second flank into the body of the first.
        first_is_behind = self.towards @ normals.mean(axis=0) < 0
        self.behind = flank["bodies"][0 if first_is_behind else 1]
        self.centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        off = points - self.centre
        self.width, self.height = (np.ptp(off @ axis) for axis in (self.right, self.up))
        self.before = [float(x) for x in 2e-3 * max(self.width, self.height) * self.towards]

    def before_flank(self):
        """A plane that nothing is shown before: its distance from the centre, and its normal."""
        return self.height, self.towards

    def beside_flank(self):
        """Planes that nothing is shown beyond."""
        above, beside = 1.3 * self.height, 0.5 * self.width + self.height
        return [(above, self.up), (above, -self.up), (beside, self.right), (beside, -self.right)]

    def look(self, view):
        away = max(self.width, self.height)
        view.CameraFocalPoint = [float(x) for x in self.centre]
        view.CameraPosition = [float(x) for x in self.centre + 10 * away * self.towards]
        view.CameraViewUp = [float(x) for x in self.up]
        # Half of the height that is seen: a view is about twice as wide as high.
        view.CameraParallelScale = float(max(0.36 * self.width, 2.2 * self.height))


def look_at(view, ends, shape):
    """All of a box, of which `ends` has the least and the largest of each coordinate, in a picture with
    this ratio of width to height."""
    towards, up = np.array([-0.80, 0.52, 0.36]), np.array([0, 0, 1.0])
    towards /= np.linalg.norm(towards)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    sides = np.ptp(ends, axis=1)
    width, height = (float(np.abs(axis) @ sides) for axis in (right, up))
    # A little lower than the middle: there is a bar of colours below.
    centre, away = ends.mean(axis=1) - 0.05 * height * up, np.linalg.norm(sides)
    view.CameraFocalPoint = [float(x) for x in centre]
    view.CameraPosition = [float(x) for x in centre + 10 * away * towards]
    view.CameraViewUp = [float(x) for x in up]
    view.CameraParallelScale = 0.58 * max(height, width / shape)


def animate(times_, start=None):
    """The animation goes through these times, and begins at the one next to `start`."""
    scene = pv.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.PlayMode = "Snap To TimeSteps"
    if start is not None and len(times_):
        scene.AnimationTime = min(times_, key=lambda t: abs(t - start))


def finish(layout, width, height):
    """Draws; where DOVETAIL_PICTURE names a file, as a picture of this size in it."""
    picture = os.environ.get("DOVETAIL_PICTURE")
    pv.RenderAllViews()
    if picture:
        layout.SetSize(width, height)
        pv.SaveScreenshot(picture, layout, ImageResolution=[width, height],
                          SeparatorWidth=2, SeparatorColor=[0.85, 0.85, 0.85],
                          CompressionLevel="9")
        print(f"{picture}: {Path(picture).stat().st_size // 1024} KiB")
