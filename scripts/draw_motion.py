#!/usr/bin/env python3
"""Draws the motion at the peak of a run as a moving picture: that of the README.

    target/venv/bin/python scripts/draw_motion.py output/paper docs/images/motion.gif

Left: the bodies. Right: the joint from the end where the axis of rotation comes from, its displacements
exaggerated much more. No window is opened.
Needs python3 with pyvista and pillow (`make test` installs both), and the run's VTK files.
"""

import sys
from pathlib import Path

import numpy as np
import pyvista
from PIL import Image

FRAMES, SIZE = 24, (720, 450)
COLOURS, INK = ["#e3e6ea", "#7f95b2"], "#222222"
# How much larger than they are displacements are drawn, left and right.
BODIES, JOINT = 2.0, 150.0


def harmonics(grid):
    """Mean and complex amplitudes of the harmonics on the nodes of the bodies."""
    count = sum(name.endswith("_cos_m") for name in grid.point_data)
    return grid["mean_m"], [grid[f"h{k}_cos_m"] - 1j * grid[f"h{k}_sin_m"] for k in range(1, count + 1)]


def displacement(mean, amplitudes, phase):
    return mean + sum((a * np.exp(1j * (k + 1) * phase)).real for k, a in enumerate(amplitudes))


def same_place(points, nodes, places):
    """For each place the one of these nodes that is nearest."""
    own = pyvista.PolyData(np.asarray(points)[nodes])
    return nodes[[own.find_closest_point(place) for place in places]]


class Part:
    """A surface that follows nodes of the bodies."""

    def __init__(self, surface, of_node):
        self.surface, self.of_node, self.rest = surface, of_node, np.array(surface.points)

    def move(self, u, factor):
        self.surface.points = self.rest + factor * u[self.of_node]


def parts(grid):
    """The outer surface of each body."""
    found = []
    for body in np.unique(grid.cell_data["body"]):
        one = grid.extract_cells(np.flatnonzero(grid.cell_data["body"] == body))
        nodes = np.array(one.point_data["vtkOriginalPointIds"])
        one.clear_data()
        surface = one.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)
        found.append(Part(surface, same_place(grid.points, nodes, surface.points)))
    return found


def main():
    run, target = Path(sys.argv[1]), Path(sys.argv[2])
    grid = pyvista.read(run / "peak.vtu")
    flanks = pyvista.read(run / "flank_peak.vtu")
    mean, amplitudes = harmonics(grid)
    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=SIZE, border=False)
    plotter.set_background("white")
    scenes = []
    for column, factor in enumerate([BODIES, JOINT]):
        plotter.subplot(0, column)
        bodies = parts(grid)
        for i, part in enumerate(bodies):
            plotter.add_mesh(part.surface, color=COLOURS[min(i, 1)], ambient=0.25)
        scenes.append((factor, bodies))
        plotter.add_text(f"displacements x {factor:g}", position=(0.04, 0.02), viewport=True, font_size=9, color=INK)
    joint, size = np.array(flanks.center), flanks.length
    plotter.subplot(0, 0)
    plotter.camera_position = [grid.center + np.array([-2.2, -2.6, 0.5]) * 0.6 * grid.length, grid.center, (0, 0, 1)]
    plotter.subplot(0, 1)
    plotter.camera_position = [joint + np.array([-2.3, 0.0, 0.35]) * size, joint, (0, 0, 1)]
    pictures = []
    for frame in range(FRAMES):
        u = displacement(mean, amplitudes, 2 * np.pi * frame / FRAMES)
        for factor, moved in scenes:
            for part in moved:
                part.move(u, factor)
        plotter.render()
        pictures.append(Image.fromarray(plotter.screenshot(None, return_img=True)))
    plotter.close()
    palette = pictures[0].quantize(64)
    drawn = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    drawn[0].save(target, save_all=True, append_images=drawn[1:], duration=80, loop=0, optimize=True)
    print(f"{target}: {target.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
