"""What is compared of an exported scene: digests of its objects, and its lights.

Digests of an object's parts are exact, so that relighting and incremental bakes can rely on them. The one
digest of all of it that a .blend keeps is rounded: textures get other resolutions when objects come and go.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from ...lights import Light
from ...numerics import WHOLE_TRIANGLE, Array
from ...options import BakeSettings
from ...scene import BakeObject, BakeScene, Glow, Scene, glow_pattern, texture_digest

DIGEST_STEP = 1.0 / 256.0
"""Smallest change of reflectance or opacity that a rounded digest shows."""

_POINTS = np.array([[1, 1], [4, 1], [1, 4], [2, 2]]) / 6.0
"""Where a rounded digest samples a textured triangle: weights of its second and third corner."""

OF_NO_CONSEQUENCE = frozenset({"objects", "threads", "memory_limit", "unwrap_seconds"})
"""Settings that change no texel of a lightmap that is kept."""


class ObjectRecord(NamedTuple):
    """Digests of one object's parts.

    mesh: How triangles belong to polygons and loops, how these go around, which have no area, and the texel
        scale.
    role: Whether it gets a lightmap, bounces light, casts shadows and has two sides.
    place: Triangles and shading normals.
    surface: Means of reflectance and opacity over its triangles.
    emission: Means of emission over its triangles, and the materials that emit it.
    uv: Lightmap coordinates that it brings to be kept; "" if it brings none.
    laid_out: Lightmap coordinates that the bake gave it; "" if they are not known.
    texture: See `texture_digest`.
    glow: See `glow_pattern`.
    """

    mesh: str
    role: str
    place: str
    surface: str
    emission: str
    uv: str = ""
    laid_out: str = ""
    texture: str = ""
    glow: Glow = ()


@dataclass(frozen=True, eq=False)
class SceneRecord:
    """What is compared of a scene.

    objects mapping of str to ObjectRecord: By name, in their order.
    settings: None is not compared.
    """

    objects: Mapping[str, ObjectRecord]
    lights: tuple[Light, ...]
    settings: BakeSettings | None = None


def scene_record(
    bake_scene: BakeScene, settings: BakeSettings | None = None, laid_out: Array | None = None
) -> SceneRecord:
    """Return what is compared of a scene.

    laid_out (t, 3, 2) float32: Lightmap coordinates that a bake gave to the scene's triangles.
    """
    objects = {item.name: _record_of(bake_scene, item, laid_out) for item in bake_scene.objects}
    return SceneRecord(objects, tuple(bake_scene.scene.lights), settings)


def as_object_records(stored: Any) -> dict[str, ObjectRecord]:
    """Return digests that were read from a file.

    Raises ValueError, TypeError if they are none.
    """
    if not isinstance(stored, dict):
        raise ValueError("no digests of objects")
    found = {name: ObjectRecord(*entry) for name, entry in stored.items()}
    for name, record in found.items():
        sums = np.array(record.glow or [[]], dtype=np.float64)
        if not all(isinstance(text, str) for text in (name, *record[:-1])) or sums.ndim != 2:
            raise ValueError("no digests of objects")
    return found


def rounded_digest(bake_scene: BakeScene, item: BakeObject) -> str:
    """Return a digest of an object's place, role, surface and texel scale, each rounded."""
    scene, rows = bake_scene.scene, item.rows
    digest = hashlib.sha256(f"{item.texel_scale:.6g}".encode())
    digest.update(f"page {item.page}".encode() if item.page else b"")
    levels = () if item.level is None else (item.level.triangles,)
    shape = (scene.triangles[rows], scene.normals[rows], *levels)
    for values in (*shape, scene.reflectance[rows] / DIGEST_STEP, scene.opacity[rows] / DIGEST_STEP):
        digest.update(np.round(values, 4 if values.ndim == 3 else 0).astype(np.float32).tobytes())
    for values in (scene.in_bounces[rows], scene.in_shadows[rows]):
        digest.update(np.ascontiguousarray(values).tobytes())
    if scene.images is not None:
        triangle = item.first + np.flatnonzero(scene.images.textured[rows])
        for point in _POINTS:
            seen = scene.images.at(triangle, np.broadcast_to(point, (len(triangle), 2)))
            weighed = np.concatenate([seen[:, :3], seen[:, 6:]], axis=1)
            if scene.images.tinting[triangle].any():
                passes = scene.images.passes_at(triangle, np.broadcast_to(point, (len(triangle), 2)))
                weighed = np.concatenate([weighed, passes], axis=1)
            digest.update(np.round(weighed / DIGEST_STEP).astype(np.int16).tobytes())
    return digest.hexdigest()


def light_digest(bake_scene: BakeScene, settings: BakeSettings) -> str:
    """Return a digest of everything that emits light, and of the settings, each rounded."""
    digest = hashlib.sha256()
    for light in bake_scene.scene.lights:
        if not light.strength.any():
            continue  # a kept bake knows dark lamps too
        digest.update(type(light).__name__.encode())
        for entry in fields(light):
            digest.update(_rounded(getattr(light, entry.name)))
    emits = bake_scene.scene.emission.any(axis=1)
    digest.update(_rounded(bake_scene.scene.triangles[emits]))
    digest.update(_rounded(bake_scene.scene.emission[emits]))
    for option in fields(settings):
        if option.name not in OF_NO_CONSEQUENCE:
            digest.update(f"{option.name}={getattr(settings, option.name)!r};".encode())
    return digest.hexdigest()


def _record_of(bake_scene: BakeScene, item: BakeObject, laid_out: Array | None) -> ObjectRecord:
    scene, rows, images = bake_scene.scene, item.rows, bake_scene.scene.images
    emits = scene.emission[rows].any(axis=1)
    emitter = () if bake_scene.emitter is None or not emits.any() else (bake_scene.emitter[rows][emits],)
    triangle = np.arange(item.first, item.first + item.count)
    page = (np.array(item.page),) if item.page else ()
    winding = (np.frombuffer(item.winding.encode(), dtype=np.uint8),) if item.winding else ()
    level = item.level
    faces = (item.polygon, item.loops) if level is None else (level.polygon, level.loops)
    return ObjectRecord(
        mesh=_digest(*faces, scene.areas[rows] > 0, np.array(item.texel_scale), *page, *winding),
        role=_digest(
            np.array(item.bake), scene.two_sided[rows], scene.in_bounces[rows], scene.in_shadows[rows]
        ),
        place=_digest(
            scene.triangles[rows], scene.normals[rows], *(() if level is None else (level.triangles,))
        ),
        surface=_digest(scene.reflectance[rows], scene.opacity[rows], *_glass_of(scene, triangle)),
        emission=_digest(scene.emission[rows], *emitter),
        uv="" if item.uv is None or not item.bake else _digest(item.uv.astype(np.float32)),
        laid_out="" if laid_out is None else _digest(laid_out[rows].astype(np.float32)),
        texture="" if images is None else texture_digest(images, triangle),
        glow=() if images is None else glow_pattern(images, triangle),
    )


def _glass_of(scene: Scene, triangle: Array) -> tuple[Array, ...]:
    """Return which of an object's triangles are glass, and what passes them; nothing if none are."""
    images = scene.images
    if images is None or not (images.glass | images.tinting)[triangle].any():
        return ()
    rows = triangle[images.textured[triangle]]
    return images.glass[triangle], images.mean_passes(
        rows, np.broadcast_to(WHOLE_TRIANGLE, (len(rows), 3, 2))
    )


def _digest(*arrays: Array) -> str:
    """Return a digest of arrays' values; 0 and −0 are the same."""
    digest = hashlib.blake2b(digest_size=16)
    for values in arrays:
        digest.update(repr(values.shape).encode())
        digest.update(np.ascontiguousarray(values + 0.0 if values.dtype.kind == "f" else values).tobytes())
    return digest.hexdigest()


def _rounded(value: Any) -> bytes:
    if isinstance(value, str):
        return value.encode()
    return np.round(np.asarray(value, dtype=np.float64), 5).astype(np.float32).tobytes()
