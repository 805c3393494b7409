#!/usr/bin/env python3
"""Draws the blade, its root and the jaw from a run's VTK files: the picture of docs/geometry.md.

    python3 scripts/draw_blade.py output/paper docs/images/blade.png

Left: both bodies in the static state, von Mises stress. Right: the root of the blade from both sides,
with the energy that friction takes in a period of the peak, per area, on its flanks. No window is
opened.
Needs python3 with vtk (pip install vtk).
"""

import sys
from pathlib import Path

import vtk

sys.path.insert(0, str(Path(__file__).parents[1] / "views"))
import colours

WIDTH, HEIGHT = 1280, 800
INK, STEEL = colours.unit(colours.INK), colours.unit(colours.STEEL)


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader


def surface_of_body(grid, body):
    """The outer surface of body 0 or 1."""
    one = vtk.vtkThreshold()
    one.SetInputConnection(grid.GetOutputPort())
    one.SetInputArrayToProcess(0, 0, 0, vtk.vtkDataObject.FIELD_ASSOCIATION_CELLS, "body")
    one.SetLowerThreshold(body - 0.5)
    one.SetUpperThreshold(body + 0.5)
    surface = vtk.vtkGeometryFilter()
    surface.SetInputConnection(one.GetOutputPort())
    return surface


def table_to(most, ramp):
    """A table from 0 to the first round number from `most` on, and its round numbers."""
    numbers = colours.ticks(most)
    scale = vtk.vtkColorTransferFunction()
    for i, stop in enumerate(ramp):
        scale.AddRGBPoint(i / (len(ramp) - 1), *colours.unit(stop))
    table = vtk.vtkLookupTable()
    table.SetNumberOfTableValues(256)
    table.SetRange(0, numbers[-1])
    for i in range(256):
        table.SetTableValue(i, *scale.GetColor(i / 255), 1)
    return table, numbers


def actor(surface, colour=None, table=None):
    """In one colour, or in those of the array `shown`."""
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputConnection(surface.GetOutputPort())
    normals.SetFeatureAngle(30)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    if table:
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("shown")
        mapper.SetLookupTable(table)
        mapper.UseLookupTableScalarRangeOn()
        mapper.InterpolateScalarsBeforeMappingOn()
    else:
        mapper.ScalarVisibilityOff()
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    made = vtk.vtkActor()
    made.SetMapper(mapper)
    look = made.GetProperty()
    look.SetInterpolationToPhong()
    look.SetAmbient(0.25)
    look.SetDiffuse(0.75)
    if colour:
        look.SetColor(*colour)
    return made


def edges(surface):
    """The sharp edges, as lines."""
    found = vtk.vtkFeatureEdges()
    found.SetInputConnection(surface.GetOutputPort())
    found.SetFeatureAngle(30)
    found.BoundaryEdgesOff()
    found.NonManifoldEdgesOff()
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(found.GetOutputPort())
    mapper.ScalarVisibilityOff()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-1, -4)
    drawn = vtk.vtkActor()
    drawn.SetMapper(mapper)
    drawn.GetProperty().SetColor(*INK)
    drawn.GetProperty().SetLineWidth(1.3)
    drawn.GetProperty().LightingOff()
    return drawn


def words(text, place):
    drawn = vtk.vtkTextActor()
    drawn.SetInput(text)
    drawn.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
    drawn.SetPosition(*place)
    drawn.GetTextProperty().SetColor(*INK)
    drawn.GetTextProperty().SetFontSize(20)
    return drawn


def scale_bar(shown, place, width, height):
    table, numbers = shown
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(table)
    bar.SetNumberOfLabels(len(numbers))
    bar.SetLabelFormat("{:.3g}" if vtk.vtkVersion().GetVTKMajorVersion() * 100
                       + vtk.vtkVersion().GetVTKMinorVersion() >= 906 else "%.3g")
    bar.SetPosition(*place)
    bar.SetWidth(width)
    bar.SetHeight(height)
    bar.UnconstrainedFontSizeOn()
    text = bar.GetLabelTextProperty()
    text.SetColor(*INK)
    text.SetFontSize(18)
    text.ItalicOff()
    text.BoldOff()
    text.ShadowOff()
    return bar


def scaled(surface, array, factor):
    """The array times `factor`, under the name `shown`."""
    calculator = vtk.vtkArrayCalculator()
    calculator.SetInputConnection(surface.GetOutputPort())
    calculator.AddScalarArrayName(array)
    calculator.SetFunction(f"{array}*{factor}")
    calculator.SetResultArrayName("shown")
    calculator.Update()
    return calculator


def largest(surface):
    return surface.GetOutput().GetPointData().GetArray("shown").GetRange()[1]


def view(renderer, focus, direction, height):
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*focus)
    camera.SetPosition(*(f + d for f, d in zip(focus, direction)))
    camera.SetViewUp(0, 0, 1)
    camera.SetParallelScale(height / 2)
    renderer.ResetCameraClippingRange()


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    run, picture = Path(sys.argv[1]), Path(sys.argv[2])
    both = read(run / "static.vtu")
    blade, jaw = surface_of_body(both, 0), surface_of_body(both, 1)

    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(WIDTH, HEIGHT)
    window.SetMultiSamples(8)

    def panel(*corners):
        renderer = vtk.vtkRenderer()
        renderer.SetViewport(*corners)
        renderer.SetBackground(1, 1, 1)
        lights = vtk.vtkLightKit()
        lights.SetKeyLightIntensity(0.85)
        lights.AddLightsToRenderer(renderer)
        window.AddRenderer(renderer)
        return renderer

    assembly = panel(0, 0, 0.46, 1)
    stresses = [scaled(body, "von_mises_pa", 1e-6) for body in (blade, jaw)]
    heat = table_to(max(largest(s) for s in stresses), colours.BODIES)
    for surface in stresses:
        assembly.AddActor(actor(surface, table=heat[0]))
        assembly.AddActor(edges(surface))
    assembly.AddViewProp(scale_bar(heat, (0.03, 0.38), 0.13, 0.5))
    assembly.AddViewProp(words("static von Mises stress, MPa", (0.03, 0.93)))
    view(assembly, (0, 0, 0.479), (-0.80, 0.52, 0.36), 0.146)

    lost = read(run / "flank_peak.vtu")
    flanks = vtk.vtkGeometryFilter()
    flanks.SetInputConnection(lost.GetOutputPort())
    spent = scaled(flanks, "friction_energy_j_m2", 1)
    energy = table_to(largest(spent), colours.VIRIDIS)
    # From the left side of the slot, and from its right side.
    for row, (name, side) in enumerate((("right flank, its rear end at the right", -1),
                                        ("left flank, its front end at the right", 1))):
        root = panel(0.46, 0.46 * row, 0.92, 0.46 * (row + 1))
        root.AddActor(actor(blade, colour=STEEL))
        root.AddActor(edges(blade))
        shown = actor(spent, table=energy[0])
        shown.GetMapper().SetRelativeCoincidentTopologyPolygonOffsetParameters(-1, -8)
        root.AddActor(shown)
        root.AddViewProp(words(name, (0.03, 0.03)))
        view(root, (-0.42 * side * 0.01, 0.91 * side * 0.01, 0.4405),
             (-0.42 * side - 0.25, 0.91 * side, 0.25), 0.031)

    legend = panel(0.46, 0.92, 1, 1)
    legend.AddViewProp(words("energy taken by friction in a period of the peak, J/m2", (0.03, 0.2)))
    legend = panel(0.92, 0, 1, 0.92)
    legend.AddViewProp(scale_bar(energy, (0.05, 0.1), 0.8, 0.8))
    window.Render()

    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    picture.parent.mkdir(parents=True, exist_ok=True)
    writer = vtk.vtkPNGWriter()
    writer.SetCompressionLevel(9)
    writer.SetFileName(str(picture))
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()
    print(f"{picture}: {picture.stat().st_size // 1024} KiB")


if __name__ == "__main__":
    main()
