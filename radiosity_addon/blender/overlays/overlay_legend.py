"""The legend of an overlay in a viewport's corner: a bar of colors with numbers, or colors with words."""

from __future__ import annotations

from typing import Any

import blf
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from .overlay_pictures import Legend

FONT = 0
TEXT = 12.0
BAR_WIDTH, BAR_HEIGHT = 18.0, 240.0
LEFT, BOTTOM, GAP = 24.0, 60.0, 8.0
"""In pixels at a scale of the interface of 1."""

_WHITE = (0.95, 0.95, 0.95, 1.0)
_SHADE = (0.08, 0.08, 0.08, 0.75)
_STRIPS = 64


def draw_legend(legend: Legend, ui_scale: float) -> None:
    """Draw it into the viewport whose turn it is; in pixels from its lower left corner."""
    blend = gpu.state.blend_get()
    gpu.state.blend_set("ALPHA")
    try:
        if legend.scale is not None:
            _draw_scale(legend, ui_scale)
        else:
            _draw_entries(legend, ui_scale)
    finally:
        gpu.state.blend_set(blend)


def _draw_scale(legend: Legend, size: float) -> None:
    scale = legend.scale
    assert scale is not None
    left, bottom, width, height = (size * value for value in (LEFT, BOTTOM, BAR_WIDTH, BAR_HEIGHT))
    gap, line = size * GAP, size * TEXT
    title = f"{legend.title} [{legend.unit}]"
    labels = scale.ticks()
    wide = max([_width(title, size), *(width + 2 * gap + _width(text, size) for _, text in labels)])
    _rectangles([(left - gap, bottom - 2 * gap, wide + 2 * gap, height + 5 * gap + line)], [_SHADE])
    values = scale.low + (np.arange(_STRIPS) + 0.5) / _STRIPS * (scale.high - scale.low)
    strips = [(left, bottom + height * row / _STRIPS, width, height / _STRIPS + 1) for row in range(_STRIPS)]
    _rectangles(strips, [(*map(float, color), 1.0) for color in scale(values)])
    for value, text in labels:
        y = bottom + height * (value - scale.low) / (scale.high - scale.low)
        _rectangles([(left + width, y, 0.5 * gap, size)], [_WHITE])
        _write(text, left + width + gap, y - 0.35 * line, size)
    _write(title, left, bottom + height + 1.5 * gap, size)


def _draw_entries(legend: Legend, size: float) -> None:
    left, bottom, width, gap, line = (size * value for value in (LEFT, BOTTOM, BAR_WIDTH, GAP, 1.6 * TEXT))
    wide = max(
        [_width(legend.title, size), *(width + gap + _width(text, size) for _, text in legend.entries)]
    )
    high = line * (len(legend.entries) + 1)
    _rectangles([(left - gap, bottom - gap, wide + 2 * gap, high + 2 * gap)], [_SHADE])
    for row, (color, text) in enumerate(reversed(legend.entries)):
        y = bottom + row * line
        _rectangles([(left, y, width, 0.7 * line)], [(*color, 1.0)])
        _write(text, left + width + gap, y + 0.1 * line, size)
    _write(legend.title, left, bottom + line * len(legend.entries) + 0.1 * line, size)


def _rectangles(places: list[tuple[float, float, float, float]], colors: list[tuple[float, ...]]) -> None:
    """Fill rectangles, given as (left, bottom, width, height)."""
    shader: Any = gpu.shader.from_builtin("FLAT_COLOR")
    corners, vertex_colors = [], []
    for (left, bottom, width, height), color in zip(places, colors, strict=True):
        right, top = left + width, bottom + height
        corners += [(left, bottom), (right, bottom), (right, top), (left, bottom), (right, top), (left, top)]
        vertex_colors += [color] * 6
    batch_for_shader(shader, "TRIS", {"pos": [(*at, 0.0) for at in corners], "color": vertex_colors}).draw(
        shader
    )


def _write(text: str, x: float, y: float, size: float) -> None:
    blf.size(FONT, size * TEXT)
    blf.color(FONT, *_WHITE)
    blf.position(FONT, x, y, 0)
    blf.draw(FONT, text)


def _width(text: str, size: float) -> float:
    blf.size(FONT, size * TEXT)
    return float(blf.dimensions(FONT, text)[0])
