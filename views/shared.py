"""What the views have in common: the folder of a run, its flanks beside each other, colours, pictures."""

import json
import os
from pathlib import Path

import numpy as np
from paraview import simple as pv
from paraview.servermanager import Fetch
from vtkmodules.util.numpy_support import vtk_to_numpy

INK = [0.13, 0.13, 0.13]
STEEL = [0.82, 0.84, 0.87]
# Places from 0 to 1 and their colours.
HEAT = [(0, 0.93, 0.94, 0.96), (0.25, 0.45, 0.66, 0.83), (0.55, 0.98, 0.80, 0.40),
        (1, 0.70, 0.10, 0.10)]
POWER = [(0, 1.0, 0.97, 0.88), (0.33, 0.99, 0.75, 0.35), (0.67, 0.85, 0.25, 0.15),
         (1, 0.30, 0.02, 0.15)]
# What a pair does: number, word, colour.
STATUS = [(0, "stuck", (0.12, 0.48, 0.27)), (1, "slipping", (0.04, 0.39, 0.71)),
          (2, "opening", (0.90, 0.55, 0.13)), (3, "closing", (0.60, 0.35, 0.62)),
          (4, "open", (0.60, 0.63, 0.66))]
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

    def contact(self, number):
        static = self.summary.get("static") or {}
        contacts = static.get("contacts") or []
        return contacts[number]["name"] if number < len(contacts) else f"contact {number}"


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


def words(view, text):
    source = pv.Text(registrationName=f"text {text}", Text=text)
    style(pv.Show(source, view), "Upper Left Corner")


def times(view, source, text):
    """The time of the animation as a text, such as `frequency: {time:.2f} Hz`."""
    annotation = pv.AnnotateTimeFilter(registrationName=text.split(":")[0], Input=source)
    annotation.Format = text
    style(pv.Show(annotation, view), "Upper Right Corner")


def style(display, where):
    display.WindowLocation = where
    display.Color = INK
    display.FontSize = 15


def scaled(source, array, factor, name):
    """The array of the points in another unit."""
    made = pv.Calculator(registrationName=name, Input=source)
    made.Function = f'"{array}"*{factor}'
    made.ResultArrayName = name
    return made


def plain(source, view, before):
    """As steel with its sharp edges, which are moved by `before`, so that they are not hidden."""
    surface = pv.ExtractSurface(registrationName="surface", Input=source)
    display = pv.Show(surface, view)
    display.ColorArrayName = ["POINTS", ""]
    display.AmbientColor = display.DiffuseColor = STEEL
    display.Ambient, display.Diffuse = 0.35, 0.65
    edges(surface, view).Position = before


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


def colour(display, view, array, stops, most, title, where=None):
    """Colours by an array of the points, from 0 to `most`, with a bar; `where` is its place."""
    pv.ColorBy(display, ("POINTS", array))
    table = pv.GetColorTransferFunction(array)
    table.AutomaticRescaleRangeMode = "Never"
    table.ColorSpace = "Lab"
    most = most if most > 0 else 1
    table.RGBPoints = [number for place, *colours in stops for number in (most * place, *colours)]
    bar(table, view, title, where)


def colour_by_status(display, view, title):
    pv.ColorBy(display, ("CELLS", "status"))
    table = pv.GetColorTransferFunction("status")
    table.InterpretValuesAsCategories = 1
    table.AnnotationsInitialized = 1
    table.Annotations = [text for number, word, _ in STATUS for text in (str(number), word)]
    table.IndexedColors = [part for _, _, colours in STATUS for part in colours]
    bar(table, view, title, None)


def bar(table, view, title, where):
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
    if where:
        shown.Orientation, shown.WindowLocation = where
    shown.Visibility = 1


class Flanks:
    """Views of each flank, seen from the second flank with the body of the first one behind it: a row for each
    contact, a column for each of `fields`, which are functions of a source, a display and a view."""

    def __init__(self, name, folder, columns):
        self.folder = folder
        rest = folder.open("flank_static.vtu")
        body = folder.open("static.vtu")
        first = threshold(body, "body", 0)
        data = Fetch(rest)
        last = int(data.GetCellData().GetArray("contact").GetRange()[1])
        self.contacts = list(range(min(last + 1, MOST_ROWS)))
        self.layout = layout = empty_layout(name)
        frames = []
        hints = split(0, len(self.contacts), layout.SplitVertical)
        for contact, hint in zip(self.contacts, hints):
            frame = Frame(Fetch(threshold(rest, "contact", contact)))
            places = split(hint, len(columns), layout.SplitHorizontal)
            for column, place in zip(columns, places):
                view = render_view()
                layout.AssignView(place, view)
                plain(first, view, frame.before)
                column(self, contact, frame, view)
                words(view, folder.contact(contact))
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
    """Where a flank is, and from where it is looked at."""

    def __init__(self, flank):
        points = vtk_to_numpy(flank.GetPoints().GetData())
        normal = vtk_to_numpy(flank.GetPointData().GetArray("normal")).mean(axis=0)
        # `normal` leads from the second flank into the body of the first.
        self.towards = -normal / np.linalg.norm(normal)
        self.centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        up = np.array([0, 0, 1.0]) if abs(self.towards[2]) < 0.95 else np.array([0, 1.0, 0])
        self.right = np.cross(up, self.towards)
        self.right /= np.linalg.norm(self.right)
        self.up = np.cross(self.towards, self.right)
        off = points - self.centre
        self.width, self.height = (np.ptp(off @ axis) for axis in (self.right, self.up))
        self.before = [float(x) for x in 2e-3 * max(self.width, self.height) * self.towards]

    def look(self, view):
        away = max(self.width, self.height)
        at = self.towards + 0.25 * self.right
        view.CameraFocalPoint = [float(x) for x in self.centre]
        view.CameraPosition = [float(x) for x in self.centre + 10 * away * at]
        view.CameraViewUp = [float(x) for x in self.up]
        # Half of the height that is seen: a view is about twice as wide as high.
        view.CameraParallelScale = float(max(0.33 * self.width, 0.9 * self.height))


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
    centre, away = ends.mean(axis=1), np.linalg.norm(sides)
    view.CameraFocalPoint = [float(x) for x in centre]
    view.CameraPosition = [float(x) for x in centre + 10 * away * towards]
    view.CameraViewUp = [float(x) for x in up]
    view.CameraParallelScale = 0.55 * max(height, width / shape)


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
