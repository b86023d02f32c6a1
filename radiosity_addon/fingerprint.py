"""What a bake saw of a scene but its light, as digests: tells whether it is still so, and what is not.

Relighting holds for the same surfaces in the same places that reflect the same; each object has digests of
its own, so that a message can name what has changed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import numpy as np

from .bake_scene import BakeObject, BakeScene
from .errors import SceneError
from .solver.arrays import Array
from .solver.scene import Scene

Fingerprint = Mapping[str, tuple[str, str]]
"""By object: digests of its shape and place, and of how it reflects."""

_SHAPE = ("triangles", "normals", "two_sided", "in_bounces", "in_shadows")
_SURFACE = ("reflectance", "opacity")


def fingerprint(bake_scene: BakeScene) -> dict[str, tuple[str, str]]:
    """Return the digests of a scene's objects, in their order."""
    return {
        item.name: (
            _digest(bake_scene.scene, _SHAPE, item, item.bake),
            _digest(bake_scene.scene, _SURFACE, item),
        )
        for item in bake_scene.objects
    }


def check_same(before: Fingerprint, bake_scene: BakeScene) -> None:
    """Refuse a scene that differs in more than its light, naming the first object that does.

    Raises
    ------
    SceneError
    """
    now = fingerprint(bake_scene)
    for name in before:
        if name not in now:
            raise SceneError(f"object '{name}' is not there any more, or hidden from renders: bake again")
    for name in now:
        if name not in before:
            raise SceneError(f"object '{name}' was not there when the lightmaps were baked: bake again")
    for name, (shape, surface) in now.items():
        if shape != before[name][0]:
            raise SceneError(f"object '{name}' has moved, or changed its shape or its role: bake again")
        if surface != before[name][1]:
            raise SceneError(f"object '{name}' reflects otherwise than it did when baked: bake again")
    if list(now) != list(before):
        raise SceneError("the objects have another order than when the lightmaps were baked: bake again")


def _digest(scene: Scene, names: tuple[str, ...], item: BakeObject, *also: object) -> str:
    digest = hashlib.blake2b(repr((item.count, *also)).encode(), digest_size=16)
    for name in names:
        digest.update(_bytes(getattr(scene, name)[item.rows]))
    return digest.hexdigest()


def _bytes(values: Array) -> bytes:
    """Return what an array holds; 0 and −0 are the same."""
    return np.ascontiguousarray(values + 0.0 if values.dtype.kind == "f" else values).tobytes()
