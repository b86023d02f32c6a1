"""The picture of a bake's history, drawn by Blender itself in a scene that is then removed.

Curves and texts with emission materials lie flat below an orthographic camera, one
hundredth of a unit a pixel.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import bpy

from ...base import BakeError
from ...options import METHODS
from ..datablocks.png import render_png
from ..overlays.plot_layout import Colour, Dot, Drawing, Line, Point, Text, draw_history

UNIT = 0.01
"""Length of a pixel in the scene."""

SAMPLES = 16
_CORNERS_OF_A_DOT = 16
_PAPER: Colour = (1.0, 1.0, 1.0)

# Heights above the paper: texts on top.
_LINES, _DOTS, _TEXTS, _CAMERA = 0.1, 0.3, 0.4, 1.0


def render_plot(report: dict[str, Any], path: Path) -> None:
    """Draw a report's history of residual, elements and links to a PNG file.

    The open file stays as it is.

    Parameters
    ----------
    report : dict
        As it is written to report.json.
    path : Path

    Raises
    ------
    BakeError
        If it could not be rendered or written.
    """
    solver = report["solver"]
    title, subtitle = _titles(solver)
    render_drawing(draw_history(title, subtitle, solver.get("history", ())), path)


def render_drawing(drawing: Drawing, path: Path) -> None:
    """Draw lines, dots and words to a PNG file; see `render_plot`."""
    with _only_for_now():
        scene = bpy.data.scenes.new("Radiosity Plot")
        _Paper(scene, drawing).draw()
        scene.render.resolution_x, scene.render.resolution_y = drawing.width, drawing.height
        scene.cycles.max_bounces = 0
        # A colour comes out as it went in.
        scene.render.dither_intensity = 0.0
        scene.display_settings.display_device = "sRGB"
        scene.view_settings.view_transform = "Standard"
        aside = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            render_png(scene, aside, SAMPLES)
            # Blender may fail to write without a word.
            aside.replace(path)
        except (RuntimeError, OSError) as error:
            with suppress(OSError):
                aside.unlink(missing_ok=True)
            raise BakeError(f"cannot write the plot '{path}': {' '.join(str(error).split())}") from error


def _titles(solver: dict[str, Any]) -> tuple[str, str]:
    """Return what stands above the plot: the method, and where it ended."""
    parts = [f"{solver[key]:,} {key}" for key in ("elements", "links", "iterations") if solver.get(key)]
    if solver.get("residual") is not None:
        parts.append(f"residual {solver['residual']:.1e}")
    return f"{METHODS[solver['method']].label}: how it was solved", ", ".join(parts)


class _Paper:
    """A scene to draw into."""

    def __init__(self, scene: bpy.types.Scene, drawing: Drawing) -> None:
        self._scene = scene
        self._drawing = drawing
        self._materials: dict[Colour, bpy.types.Material] = {}

    def draw(self) -> None:
        """Put everything into the scene."""
        drawing = self._drawing
        self._camera()
        width, height = drawing.width, drawing.height
        # A little larger than the picture, lest its edges be blended with the dark.
        self._areas(
            "Paper", [[(-9, -9), (width + 9, -9), (width + 9, height + 9), (-9, height + 9)]], _PAPER, 0
        )
        for (colour, width), lines in groupby(drawing.lines, lambda line: (line.colour, line.width)):
            self._lines(list(lines), colour, width)
        for colour, dots in groupby(drawing.dots, lambda dot: dot.colour):
            self._areas("Dots", [_outline(dot) for dot in dots], colour, _DOTS)
        for text in drawing.texts:
            self._text(text)

    def _camera(self) -> None:
        """Look straight down on the whole picture."""
        data = bpy.data.cameras.new("Plot Camera")
        data.type = "ORTHO"
        data.ortho_scale = UNIT * max(self._drawing.width, self._drawing.height)
        data.clip_start, data.clip_end = 0.1, 2 * _CAMERA
        camera = self._add("Plot Camera", data, _CAMERA)
        camera.location.xy = (UNIT * self._drawing.width / 2, UNIT * self._drawing.height / 2)
        self._scene.camera = camera

    def _lines(self, lines: list[Line], colour: Colour, width: float) -> None:
        """Draw lines of one kind: tubes, seen from above."""
        curve = bpy.data.curves.new("Lines", "CURVE")
        curve.dimensions = "3D"
        curve.bevel_depth = UNIT * width / 2
        curve.use_fill_caps = True
        for line in lines:
            for ends in pairwise(line.points):
                # One spline for all would get thin at sharp turns.
                spline = curve.splines.new("POLY")
                spline.points.add(1)
                for point, (x, y) in zip(spline.points, ends, strict=True):
                    point.co = (UNIT * x, UNIT * y, 0.0, 1.0)
        curve.materials.append(self._material(colour))
        # Curves lie over the grid.
        height = _LINES + UNIT * width
        self._add("Lines", curve, height)
        turns = [Dot(point, colour, width / 2) for line in lines for point in line.points[1:-1]]
        self._areas("Turns", [_outline(turn) for turn in turns], colour, height)

    def _areas(self, name: str, outlines: list[list[Point]], colour: Colour, height: float) -> None:
        """Draw filled polygons of one colour."""
        mesh = bpy.data.meshes.new(name)
        corners = [(UNIT * x, UNIT * y, 0.0) for outline in outlines for x, y in outline]
        faces, first = [], 0
        for outline in outlines:
            faces.append(range(first, first + len(outline)))
            first += len(outline)
        mesh.from_pydata(corners, [], faces)
        mesh.materials.append(self._material(colour))
        self._add(name, mesh, height)

    def _text(self, text: Text) -> None:
        """Write a line of words."""
        curve = bpy.data.curves.new("Text", "FONT")
        curve.body = text.words
        curve.size = UNIT * text.size
        curve.align_x, curve.align_y = text.align, "CENTER"
        curve.materials.append(self._material(text.colour))
        written = self._add("Text", curve, _TEXTS)
        written.location.xy = (UNIT * text.at[0], UNIT * text.at[1])

    def _material(self, colour: Colour) -> bpy.types.Material:
        """Return the material that shines in a colour, whatever the light."""
        if colour not in self._materials:
            material = bpy.data.materials.new("Plot")
            if bpy.app.version < (5, 0):
                material.use_nodes = True
            tree = material.node_tree
            tree.nodes.clear()
            emission = tree.nodes.new("ShaderNodeEmission")
            emission.inputs["Color"].default_value = (*map(_linear, colour), 1.0)
            output = tree.nodes.new("ShaderNodeOutputMaterial")
            tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
            self._materials[colour] = material
        return self._materials[colour]

    def _add(self, name: str, data: bpy.types.ID, height: float) -> bpy.types.Object:
        """Put an object into the scene at a height above the paper."""
        obj = bpy.data.objects.new(name, data)
        obj.location.z = height
        self._scene.collection.objects.link(obj)
        return obj


def _outline(dot: Dot) -> list[Point]:
    """Corners of a dot, counter-clockwise."""
    angles = [2 * math.pi * corner / _CORNERS_OF_A_DOT for corner in range(_CORNERS_OF_A_DOT)]
    (x, y), radius = dot.centre, dot.radius
    return [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]


def _linear(value: float) -> float:
    """Decode a value of sRGB (IEC 61966-2-1)."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


@contextmanager
def _only_for_now() -> Iterator[None]:
    """Remove whatever datablock the block makes, the font and the render result included."""
    kinds = ("scenes", "objects", "curves", "meshes", "cameras", "materials", "fonts", "images")
    before = {kind: set(getattr(bpy.data, kind)) for kind in kinds}
    try:
        yield
    finally:
        made = [block for kind in kinds for block in getattr(bpy.data, kind) if block not in before[kind]]
        bpy.data.batch_remove(made)
