"""What a bake saw of a scene except its light, as digests: shows what has changed since.

Relighting holds for the same surfaces in the same places that reflect the same; each object has digests of
its own, so that a message can name what has changed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...base import SceneError
from ...numerics import Array
from ...scene import BakeObject, BakeScene, Glow, Scene, glow_pattern, same_glow, texture_digest


class ObjectPrint(NamedTuple):
    """What is compared of one object.

    Attributes
    ----------
    shape : str
        Digest of its triangles, their place and its part in the light.
    surface : str
        Digest of the means of reflectance and opacity over its triangles.
    texture : str
        See `texture_digest`.
    glow : Glow
        See `glow_pattern`.
    """

    shape: str
    surface: str
    texture: str = ""
    glow: Glow = ()


Fingerprint = Mapping[str, ObjectPrint]
"""By object."""

_SHAPE = ("triangles", "normals", "two_sided", "in_bounces", "in_shadows")
_SURFACE = ("reflectance", "opacity")


def scene_digests(bake_scene: BakeScene) -> dict[str, ObjectPrint]:
    """Return what is compared of a scene's objects, in their order."""
    return {item.name: _print_of(bake_scene.scene, item) for item in bake_scene.objects}


def as_scene_digests(stored: Any) -> dict[str, ObjectPrint]:
    """Return a fingerprint that was read from a file.

    Raises
    ------
    ValueError
        If it is none.
    """
    if not isinstance(stored, dict):
        raise ValueError("no fingerprint")
    found = {}
    for name, entry in stored.items():
        shape, surface, texture, glow = entry
        sums = np.array(glow or [[]], dtype=np.float64)
        if not all(isinstance(text, str) for text in (name, shape, surface, texture)) or sums.ndim != 2:
            raise ValueError("no fingerprint")
        found[name] = ObjectPrint(shape, surface, texture, glow)
    return found


def check_same(before: Fingerprint, bake_scene: BakeScene) -> None:
    """Refuse a scene that differs in more than its light, naming the first object that does.

    Raises
    ------
    SceneError
    """
    now = scene_digests(bake_scene)
    for name in before:
        if name not in now:
            raise SceneError(f"object '{name}' is not there any more, or hidden from renders: bake again")
    for name in now:
        if name not in before:
            raise SceneError(f"object '{name}' was not there when the lightmaps were baked: bake again")
    for name, found in now.items():
        known = before[name]
        if found.shape != known.shape:
            raise SceneError(f"object '{name}' has moved, or changed its shape or its role: bake again")
        if found.surface != known.surface:
            raise SceneError(f"object '{name}' reflects otherwise than it did when baked: bake again")
        if found.texture != known.texture:
            raise SceneError(f"a texture of object '{name}', or its UV map, has changed: bake again")
        if not same_glow(known.glow, found.glow):
            raise SceneError(f"the pattern that object '{name}' emits has changed, or its UV map: bake again")
    if list(now) != list(before):
        raise SceneError("the objects have another order than when the lightmaps were baked: bake again")


def _print_of(scene: Scene, item: BakeObject) -> ObjectPrint:
    shape, surface = _digest(scene, _SHAPE, item, item.bake), _digest(scene, _SURFACE, item)
    if scene.images is None:
        return ObjectPrint(shape, surface)
    rows = np.arange(item.first, item.first + item.count)
    return ObjectPrint(shape, surface, texture_digest(scene.images, rows), glow_pattern(scene.images, rows))


def _digest(scene: Scene, names: tuple[str, ...], item: BakeObject, *also: object) -> str:
    digest = hashlib.blake2b(repr((item.count, *also)).encode(), digest_size=16)
    for name in names:
        digest.update(_bytes(getattr(scene, name)[item.rows]))
    return digest.hexdigest()


def _bytes(values: Array) -> bytes:
    """Return what an array holds; 0 and −0 are the same."""
    return np.ascontiguousarray(values + 0.0 if values.dtype.kind == "f" else values).tobytes()
