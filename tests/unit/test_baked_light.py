"""Images of the light that surfaces send out: each surface reads one whose white is not much brighter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from radiosity_addon.exports import ExportedNames, Glb, emission_images, srgb_of_linear
from radiosity_addon.exports.baked_light import MOST_IMAGES

SIZE = 64
NAMES = ExportedNames(materials={"paint": ("Paint", 0), "other": ("Other", 1), "glass": ("Glass", None)})


def quads(*corners: Sequence[float], mode: int = 4, indices: str = "<u2", material: str = "paint") -> Glb:
    """A file of rectangles, each a mesh, whose lightmap UVs go from (x0, y0) to (x1, y1) in texels, v up."""
    views, accessors, meshes = [], [], []
    for x0, y0, x1, y1 in corners:
        uv = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype="<f4") / SIZE
        uv[:, 1] = 1.0 - uv[:, 1]
        numbers = np.array([0, 1, 2, 0, 2, 3], dtype=indices)
        kind = {"u1": 5121, "<u2": 5123, "<u4": 5125}[indices]
        first = len(accessors)
        accessors += [
            {"bufferView": first, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": first + 1, "componentType": kind, "count": 6, "type": "SCALAR"},
        ]
        views += [uv.tobytes(), numbers.tobytes()]
        primitive: dict[str, Any] = {"attributes": {"TEXCOORD_1": first}, "indices": first + 1, "material": 0}
        meshes.append({"primitives": [primitive | ({"mode": mode} if mode != 4 else {})]})
    return Glb(
        {
            "meshes": meshes,
            "accessors": accessors,
            "materials": [{"name": material}],
            "bufferViews": [{"buffer": 0, "byteLength": len(view)} for view in views],
        },
        views,
    )


def page(*values: tuple[slice, slice, float]) -> np.ndarray:
    """Radiance at twice the size of the lightmap."""
    made = np.zeros((2 * SIZE, 2 * SIZE, 3), dtype=np.float32)
    for rows, columns, value in values:
        made[rows, columns] = (value, 0.8 * value, 0.5 * value)
    return made


def decoded(image: Any) -> np.ndarray:
    """What a viewer reads of an image."""
    code = np.rint(255.0 * srgb_of_linear(np.clip(image.colors, 0.0, 1.0))) / 255.0
    return image.white * np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def filtered(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """What a bilinear filter reads at points (n, 2), clamped to the edge."""
    height, width = image.shape[:2]
    x, y = np.clip(uv * (width, height) - 0.5, 0.0, (width - 1.0, height - 1.0)).T
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    right, above = np.minimum(column + 1, width - 1), np.minimum(row + 1, height - 1)
    u, v = (x - column)[:, None], (y - row)[:, None]
    low = image[row, column] * (1 - u) + image[row, right] * u
    return low * (1 - v) + (image[above, column] * (1 - u) + image[above, right] * u) * v


def test_dark_surfaces_have_a_darker_white() -> None:
    """A lamp of 100, a sunlit floor of 5, a dim wall of 0.02: one white would round the wall to 2 %."""
    light = page(
        (slice(0, 128), slice(0, 44), 100.0),
        (slice(0, 128), slice(44, 88), 5.0),
        (slice(0, 128), slice(88, 128), 0.02),
    )
    glb = quads((1, 1, 21, 63), (23, 1, 43, 63), (45, 1, 63, 63))
    images, read_by = emission_images(glb, NAMES, {0: light}, {0: 2})
    assert [image.white for image in images] == pytest.approx([0.02, 5.0, 100.0])
    assert read_by == {(0, 0): 2, (1, 0): 1, (2, 0): 0}
    for number, (columns, value) in enumerate(
        ((slice(2, 42), 100.0), (slice(46, 86), 5.0), (slice(90, 126), 0.02))
    ):
        shown = decoded(images[read_by[number, 0]])[2:126, columns]
        np.testing.assert_allclose(
            shown, np.broadcast_to((value, 0.8 * value, 0.5 * value), shown.shape), rtol=0.006
        )


def test_even_light_takes_one_image() -> None:
    images, read_by = emission_images(
        quads((1, 1, 31, 63), (33, 1, 63, 63)), NAMES, {0: page((slice(0, 128), slice(0, 128), 2.0))}, {0: 2}
    )
    (image,) = images
    assert image.white == 2.0
    assert set(read_by.values()) == {0}


@pytest.mark.parametrize("indices", ["u1", "<u2", "<u4"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_filters_read_what_is_there(seed: int, indices: str) -> None:
    """Whatever lies next to a surface on the page: also surfaces that share texels."""
    random = np.random.default_rng(seed)
    corner = random.uniform(0, SIZE - 6, (40, 2))
    corners = np.concatenate([corner, corner + random.uniform(0.05, 6, (40, 2))], axis=1)
    stops = np.linspace(-3, 2, 2 * SIZE)[:, None, None] + random.uniform(-0.2, 0.2, (2 * SIZE, 2 * SIZE, 1))
    light = (10.0**stops * random.uniform(0.1, 1, 3)).astype(np.float32)
    images, read_by = emission_images(quads(*corners, indices=indices), NAMES, {0: light}, {0: 2})
    assert 1 < len(images) <= MOST_IMAGES
    for number, (x0, y0, x1, y1) in enumerate(corners):
        points = random.uniform((x0, y0), (x1, y1), (100, 2)) / SIZE
        image = images[read_by[number, 0]]
        np.testing.assert_allclose(
            image.white * filtered(image.colors, points), filtered(light, points), rtol=1e-4, atol=1e-6
        )
        assert filtered(image.colors, points).max() <= 1.0 + 1e-6


def test_surfaces_that_cannot_be_read_see_all_of_the_page() -> None:
    light = page((slice(0, 64), slice(0, 128), 100.0), (slice(64, 128), slice(0, 128), 0.1))
    images, read_by = emission_images(quads((40, 40, 60, 60), mode=5), NAMES, {0: light}, {0: 2})
    np.testing.assert_allclose(images[read_by[0, 0]].colors, light / 100.0, rtol=1e-6)


def test_every_page_has_images_of_its_own() -> None:
    light = page((slice(0, 128), slice(0, 128), 2.0))
    glb = quads((1, 1, 31, 63), (33, 1, 63, 63))
    glb.json["materials"] += [{"name": "other"}, {"name": "glass"}]
    glb.json["meshes"][1]["primitives"][0]["material"] = 1
    glb.json["meshes"].append({"primitives": [{"attributes": {}, "material": 2}, {"attributes": {}}]})
    images, read_by = emission_images(glb, NAMES, {0: light, 1: 3.0 * light}, {0: 2, 1: 1})
    assert [(image.page, image.white) for image in images] == [(0, 2.0), (1, 6.0)]
    assert read_by == {(0, 0): 0, (1, 0): 1}
    assert emission_images(quads(), NAMES, {0: light}, {0: 2}) == ([], {})
