"""Whether a scene to bake, and a bake's result, that were read from files are some: types, shapes and ranges.

As with sidecars, a digest proves only that a file is whole. Errors are those of `sidecar_checks.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...base import BakeWarning
from ...lightmap.images import LightmapPage
from ...numerics import Array
from ...options import MAX_PAGES, MAX_RESOLUTION, OTHERS, BakeSettings
from ...scene import CHANNELS, BakeObject, BakeScene, LevelOfDetail, Scene, SurfaceImages
from ..relight import are_wanted
from ..result import BakedObject, BakeResult, LightGroup
from .sidecar_checks import check_light, check_plain
from .value_checks import LARGE, array_of, instance, integers, number, numbers, require, whole

MOST_INDEX = (1 << 31) - 1


def check_bake_scene(bake_scene: Any) -> None:
    """Refuse what no export has made.

    Raises ValueError, KeyError, TypeError, IndexError, AttributeError, RadiosityError if anything is not as
        it must be.
    """
    scene = instance(instance(bake_scene, BakeScene).scene, Scene)
    _check_scene(scene)
    count, first = len(scene), 0
    for item in instance(bake_scene.objects, tuple):
        _check_object(instance(item, BakeObject), first)
        first += item.count
    require(first == count, "triangles of no object")
    require(len({item.name for item in bake_scene.objects}) == len(bake_scene.objects), "two of one name")
    _check_warnings(bake_scene.warnings)
    if bake_scene.emitter is not None:
        integers(bake_scene.emitter, (count,), -MOST_INDEX, MOST_INDEX)
    for names in (bake_scene.emitter_names, bake_scene.light_groups, bake_scene.emitter_groups):
        _check_texts(names)
    for camera in instance(bake_scene.cameras, tuple):
        require(len(camera) == 3, "a camera")
        for coordinate in camera:
            number(float(coordinate), -LARGE)


def check_result(result: BakeResult, bake_scene: BakeScene, settings: BakeSettings) -> None:
    """Refuse what no bake of this scene has found; errors as of `check_bake_scene`."""
    _check_number_of_files(result, bake_scene, settings)
    for page in instance(result.pages, tuple):
        _check_page(page, None)
    for baked in instance(result.objects, tuple):
        _check_baked(instance(baked, BakedObject), len(result.pages))
    _check_solver(result.solver)
    _check_warnings(result.warnings)
    for seconds in result.seconds.values():
        number(seconds, 0.0)
    for facts, most in ((result.atlas, len(result.pages)), (result.light, len(result.objects))):
        require(len(instance(facts, tuple)) in (0, most), "facts of others")
        for entry in facts:
            check_plain(instance(entry, dict))
    for group in instance(result.groups, tuple):
        _check_texts((instance(group, LightGroup).name,))
        _check_texts(group.sources)
        require(len(instance(group.pages, tuple)) == len(result.pages), "pages of a group")
        for page, like in zip(group.pages, result.pages, strict=True):
            _check_page(page, like)
    for name, triangles in instance(result.coincident, dict).items():
        instance(name, str)
        whole(triangles, 0, MOST_INDEX)
    check_plain(instance(result.performance, dict))


def _check_number_of_files(result: BakeResult, bake_scene: BakeScene, settings: BakeSettings) -> None:
    """Refuse more pages and groups than were foreseen when it was seen which files may be written."""
    baked = sum(item.bake and item.count > 0 for item in bake_scene.objects)
    most = settings.pages if settings.atlas == "shared" else baked
    if settings.atlas == "shared" and settings.texel_density is not None:
        most = max(MAX_PAGES, baked)  # what density they need is known when they are unwrapped
    require(1 <= len(instance(result.pages, tuple)) <= most, "too many pages")
    of_scene = (*bake_scene.light_groups, *bake_scene.emitter_groups)
    names = {OTHERS, *(name for name, _ in settings.groups), *of_scene} - {""}
    wanted = names if are_wanted(bake_scene, settings) else set()
    found = [group.name for group in instance(result.groups, tuple)]
    require(len(set(found)) == len(found) and wanted.issuperset(found), "other groups")


def _check_scene(scene: Scene) -> None:
    count = len(scene.triangles)
    for corners, most in ((scene.triangles, LARGE), (scene.normals, 2.0)):
        numbers(corners, (count, 3, 3), -most, most)
    numbers(scene.face_normals, (count, 3), -2.0, 2.0)
    numbers(scene.areas, (count,), 0.0, LARGE**2)
    numbers(scene.reflectance, (count, 3), 0.0, 1.0)
    numbers(scene.emission, (count, 3), 0.0)
    numbers(scene.opacity, (count,), 0.0, 1.0 + 1e-6)
    for flags in (scene.two_sided, scene.in_bounces, scene.in_shadows):
        array_of(flags, "b", (count,))
    for light in instance(scene.lights, tuple):
        check_light(light)
    if scene.images is not None:
        _check_images(instance(scene.images, SurfaceImages), count)


def _check_images(images: SurfaceImages, count: int) -> None:
    height, width = np.shape(images.values)[:2]
    require(height > 0 and width > 0, "no texels")
    for values in (images.values, images._weighed):
        numbers(values, (height, width, CHANNELS), 0.0)
    numbers(images._opacity, (height, width, 1), 0.0, 1.0)
    numbers(images.image_uv, (count, 3, 2), 0.0, 1.0)
    for flags in (images.textured, images.glass):
        array_of(flags, "b", (count,))
    if images.passes is not None:
        numbers(images.passes, (height, width, 3), 0.0, 1.0)


def _check_object(item: BakeObject, first: int) -> None:
    _check_texts((item.name, item.winding))
    whole(item.count, 0, MOST_INDEX)
    require(item.first == first, "triangles in no order")
    instance(item.bake, bool)
    _check_faces(item.polygon, item.loops, item.count)
    if item.uv is not None:
        array_of(item.uv, "f", (item.count, 3, 2))  # what is odd in it is told by name
    number(float(item.texel_scale), 0.0)
    number(float(item.thinning), 0.0)
    if item.glass is not None:
        array_of(item.glass, "b", (item.count,))
    whole(item.page, 0, MOST_INDEX)
    if item.level is not None:
        level = instance(item.level, LevelOfDetail)
        _check_texts((level.base,))
        triangles = len(level.triangles)
        numbers(level.triangles, (triangles, 3, 3), -LARGE)
        numbers(level.to_base, (4, 4), -LARGE)
        _check_faces(level.polygon, level.loops, triangles)


def _check_faces(polygon: Array, loops: Array, count: int) -> None:
    integers(polygon, (count,), 0, MOST_INDEX)
    integers(loops, (count, 3), 0, MOST_INDEX)


def _check_page(page: Any, like: LightmapPage | None) -> None:
    height, width = np.shape(instance(page, LightmapPage).pixels)[:2]
    whole(height, 1, MAX_RESOLUTION)
    whole(width, 1, MAX_RESOLUTION)
    array_of(page.pixels, "f", (height, width, 3))
    array_of(page.coverage, "b", (height, width))
    require(like is None or like.pixels.shape == page.pixels.shape, "pages of several sizes")


def _check_baked(baked: BakedObject, pages: int) -> None:
    array_of(baked.uv, "f", (*np.shape(baked.loops), 2))
    whole(baked.page, 0, pages - 1)
    for known in (baked.density, baked.share):
        if known is not None:
            number(float(known), 0.0)


def _check_solver(solver: Mapping[str, Any]) -> None:
    instance(instance(solver, dict)["method"], str)
    for name in ("elements", "links", "rays"):
        whole(int(solver[name]), 0, 1 << 62)
    check_plain(solver)


def _check_warnings(warnings: Any) -> None:
    for warning in instance(warnings, tuple):
        _check_texts((instance(warning, BakeWarning).name, warning.message))
        instance(warning.is_note, bool)
        for polygon in instance(warning.turned, tuple):
            whole(int(polygon), 0, MOST_INDEX)


def _check_texts(texts: Any) -> None:
    for text in instance(texts, tuple):
        instance(text, str)
