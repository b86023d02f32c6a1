"""Overlaps within charts: found, and cut out."""

import numpy as np
import pytest

from radiosity_addon.lightmap.charts.cut_charts import unwrap
from radiosity_addon.lightmap.charts.growers import grow_charts
from radiosity_addon.lightmap.charts.overlap import overlapping_triangles
from radiosity_addon.lightmap.texels.rasterization import coverage_sum

from .lightmap_meshes import quads, uv_sphere

pytest.importorskip("xatlas")


def test_overlaps_within_a_chart_are_found_and_cut_out():
    # A strip that winds around more than once: flat, front side up, and over itself.
    angle = np.linspace(0, 3 * np.pi, 40)
    inner = np.stack((np.cos(angle), np.sin(angle), 0.02 * angle), axis=-1)
    outer = np.stack((2 * np.cos(angle), 2 * np.sin(angle), 0.02 * angle), axis=-1)
    triangles, polygon = quads(np.stack((inner[:-1], outer[:-1], outer[1:], inner[1:]), axis=1))

    def from_above(vertices, faces, _):
        return vertices[faces][..., :2], np.zeros(len(faces), dtype=np.int64)

    wound = triangles[..., :2]
    assert coverage_sum((wound * 0.2 + 0.5).astype(np.float32), 128).max() > 1.9
    assert len(overlapping_triangles(wound, np.zeros(len(wound), dtype=np.int64))) > 30
    charts = unwrap(triangles, polygon, from_above)
    for chart in range(charts.count):
        part = charts.uv[charts.chart == chart]
        part = (part - part.min(axis=(0, 1))) / np.ptp(part, axis=(0, 1)).max()
        assert coverage_sum(part.astype(np.float32), 256).max() < 1.01


def test_what_does_not_overlap_is_left_alone():
    triangles, polygon = uv_sphere(12, 16)
    charts = unwrap(triangles, polygon, grow_charts)
    assert len(overlapping_triangles(charts.uv, charts.chart)) == 0
