"""Which parts of a scene differ, and which bake that makes necessary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.plan import SHORT, BakeDigests, RememberedLightmap, ShownBake, plan_bake
from radiosity_addon.bake.scene_diff import Part, compare, scene_record
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from tests.relit_rooms import CHANGED, lit_bake

SETTINGS = BakeSettings(resolution=64)


def with_box(**changes: object) -> BakeScene:
    """The room, whose box differs."""
    scene = lit_bake()
    objects = [replace(item, **changes) if item.name == "Box" else item for item in scene.objects]  # type: ignore[arg-type]
    return replace(scene, objects=tuple(objects))


def with_arrays(**changes: Callable[[np.ndarray], np.ndarray]) -> BakeScene:
    """The room, the arrays of whose box differ."""
    scene = lit_bake()
    (box,) = [item for item in scene.objects if item.name == "Box"]
    for name, change in changes.items():
        values = getattr(scene.scene, name).copy()
        values[box.rows] = change(values[box.rows])
        setattr(scene.scene, name, values)
    return scene


def with_lights(*lights: object) -> BakeScene:
    scene = lit_bake()
    scene.scene.lights = lights
    return scene


LIGHTS = lit_bake().scene.lights

DIFFERENT = {
    "same": (lit_bake, set()),
    "moved": (lambda: with_arrays(triangles=lambda old: old + 0.1), {Part.PLACE}),
    "normals": (lambda: with_arrays(normals=lambda old: -old), {Part.PLACE}),
    "painted": (lambda: with_arrays(reflectance=lambda old: 0.9 * old), {Part.SURFACE}),
    "glows": (lambda: with_arrays(emission=lambda old: old + 1.0), {Part.EMISSION}),
    "no shadow": (lambda: with_arrays(in_shadows=np.logical_not), {Part.ROLE}),
    "not baked": (lambda: with_box(bake=False), {Part.ROLE}),
    "sharper": (lambda: with_box(texel_scale=2.0), {Part.MESH}),
    "on page 2": (lambda: with_box(page=2), {Part.MESH}),
    "other way around": (lambda: with_box(winding="other"), {Part.MESH}),
    "strengths": (lambda: lit_bake(CHANGED), {Part.STRENGTH, Part.EMISSION}),
    "lamp gone": (lambda: with_lights(*LIGHTS[1:]), {Part.LIGHT_REMOVED, Part.LIGHT_ORDER}),
    "lamps swapped": (lambda: with_lights(LIGHTS[1], LIGHTS[0], *LIGHTS[2:]), {Part.LIGHT_ORDER}),
    "lamp moved": (
        lambda: with_lights(replace(LIGHTS[0], position=(0.5, 0.5, 0.5)), *LIGHTS[1:]),
        {Part.LIGHT},
    ),
    "order": (lambda: replace(lit_bake(), objects=lit_bake().objects[::-1]), {Part.ORDER}),
}


@pytest.mark.parametrize("change", DIFFERENT)
def test_a_change_differs_in_its_part_alone(change: str) -> None:
    make, parts = DIFFERENT[change]
    assert compare(scene_record(lit_bake()), scene_record(make())).parts == parts


def test_settings_differ_where_both_are_known() -> None:
    one, other = (scene_record(lit_bake(), replace(SETTINGS, seed=seed)) for seed in (0, 1))
    assert compare(one, other).parts == {Part.SETTINGS}
    assert compare(one, scene_record(lit_bake())).parts == set()


def shown(has_groups: bool = False) -> ShownBake:
    """What is remembered of a bake of the room, at 10 texels per meter."""
    digests = BakeDigests.of(lit_bake(), SETTINGS)
    lightmaps = {
        item.name: RememberedLightmap(digests.objects[item.name], digests.light, 10.0, has_groups)
        for item in lit_bake().objects
        if item.bake
    }
    return ShownBake(lightmaps, {name: digest[:SHORT] for name, digest in digests.objects.items()})


def moved() -> BakeScene:
    return with_arrays(triangles=lambda old: old + 0.1)


def test_only_what_changed_is_baked_and_as_sharp_as_before() -> None:
    plan = plan_bake(moved(), SETTINGS, shown(), None)
    assert plan.kind == "changed"
    assert [item.name for item in plan.bake_scene.objects if item.bake] == ["Box"]
    assert set(plan.unchanged) == {item.name for item in lit_bake().objects if item.bake} - {"Box"}
    assert (plan.settings.texel_density, plan.settings.pages) == (10.0, 1)
    assert len(plan.warnings) == 1


def test_nothing_is_planned_where_nothing_changed() -> None:
    plan = plan_bake(lit_bake(), replace(SETTINGS, threads=2), shown(), None)
    assert (plan.kind, plan.gone) == ("nothing", [])
    remembered = shown()
    remembered = remembered._replace(objects={**remembered.objects, "Shelf": "another"})
    plan = plan_bake(lit_bake(), SETTINGS, remembered, None)
    assert (plan.kind, plan.gone) == ("nothing", ["Shelf"])
    assert "'Shelf'" in plan.reason


def test_changes_of_what_has_no_lightmap_are_named() -> None:
    remembered = shown()
    del remembered.lightmaps["Box"]  # type: ignore[attr-defined]
    painted = with_arrays(reflectance=lambda old: 0.5 * old)
    for scene, altered in ((lit_bake(), []), (painted, ["Box"])):
        objects = [replace(item, bake=item.name != "Box") for item in scene.objects]
        plan = plan_bake(replace(scene, objects=tuple(objects)), SETTINGS, remembered, None)
        assert (plan.kind, plan.altered) == ("nothing", altered)
        assert ("'Box'" in plan.reason) == bool(altered)


@pytest.mark.parametrize("is_new", [False, True])
def test_what_a_bake_leaves_out_is_named_again_until_all_is_baked(is_new: bool) -> None:
    """An object that was removed, and one without a lightmap that was painted, or is new."""
    first = shown()
    objects = {name: digest for name, digest in first.objects.items() if not is_new or name != "Box"}
    lightmaps = {name: old for name, old in first.lightmaps.items() if name != "Box"}
    lightmaps["Room"] = lightmaps["Room"]._replace(digest="another")
    first = ShownBake(lightmaps, {**objects, "Shelf": "gone"})
    painted = with_arrays(reflectance=lambda old: 0.5 * old)
    scene = replace(painted, objects=tuple(replace(o, bake=o.name != "Box") for o in painted.objects))
    plan = plan_bake(scene, SETTINGS, first, None)
    assert (plan.kind, plan.gone, plan.altered) == ("changed", ["Shelf"], ["Box"])

    for name in lightmaps:
        lightmaps[name] = lightmaps[name]._replace(digest=plan.digests.objects[name])
    second = ShownBake(lightmaps, {name: digest[:SHORT] for name, digest in plan.digests.objects.items()})
    plan = plan_bake(scene, SETTINGS, second, None)
    assert (plan.kind, plan.gone, plan.altered) == ("nothing", ["Shelf"], ["Box"])
    assert plan_bake(scene, SETTINGS, None, None).digests == BakeDigests.of(scene, SETTINGS)


@pytest.mark.parametrize(
    ("scene", "settings", "remembered"),
    [
        (moved(), SETTINGS, None),
        (lit_bake(CHANGED), SETTINGS, shown()),
        (moved(), replace(SETTINGS, seed=1), shown()),
        (moved(), SETTINGS, shown(has_groups=True)),
        (moved(), SETTINGS, ShownBake({}, {})),
    ],
    ids=["all is wanted", "light", "settings", "light groups", "first bake"],
)
def test_all_is_baked(scene: BakeScene, settings: BakeSettings, remembered: ShownBake | None) -> None:
    plan = plan_bake(scene, settings, remembered, None)
    assert (plan.kind, plan.warnings) == ("full", ())
    assert (plan.bake_scene, plan.settings) == (scene, settings)
