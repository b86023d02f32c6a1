"""The materials of light groups: sliders, keyframes, what becomes of them when baking again, and Restore."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import made_datablocks
from radiosity_addon.blender.images.group_images import shown_images, update_images
from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
from radiosity_addon.blender.material_copies.light_shares import MANY_IMAGES, LightShares, crowded_materials
from radiosity_addon.blender.material_copies.lightmap_materials import LightmapMaterials, show_lightmaps
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.group_bake import (
    EMISSION,
    GLOW,
    GROUPS,
    LAMP,
    bake_groups,
    light_groups,
    lit_plane,
    page,
    slide,
)
from tests.blender.hand_bake import BASE, add_plane, bake_by_hand, principled_material, seen_from_above


@pytest.fixture(autouse=True)
def plane(registered: None) -> bpy.types.Object:
    return lit_plane()


def seen(folder: Path) -> np.ndarray:
    return seen_from_above(folder)[0, 0]


def expected(lamp: float, glow: float | np.ndarray) -> np.ndarray:
    return np.multiply(BASE, lamp * np.array(LAMP) + glow * np.array(GLOW)) + glow * EMISSION


@pytest.mark.parametrize("file_format", ["exr", "png16"])
def test_at_one_and_white_they_show_what_one_lightmap_shows(tmp_path: Path, file_format: str) -> None:
    bake_groups(folder=tmp_path, format=file_format)
    found = seen(tmp_path)
    restore(bpy.context)
    bake_by_hand((tuple(np.add(LAMP, GLOW)),), folder=tmp_path, format=file_format)
    rounding = 1e-6 if file_format == "exr" else 1e-4
    np.testing.assert_allclose(found, seen(tmp_path), rtol=rounding)
    np.testing.assert_allclose(found, expected(1, 1), rtol=1e-4)


def test_sliders_change_a_group_s_light_and_what_glows_with_it(tmp_path: Path) -> None:
    bake_groups()
    slide("Lamps", 3.0)
    slide("Glow", 2.0, (1.0, 0.5, 0.0))
    np.testing.assert_allclose(seen(tmp_path), expected(3, np.array([2.0, 1.0, 0.0])), rtol=1e-4)


def test_radiosity_has_its_emission_in_its_groups(tmp_path: Path) -> None:
    bake_groups(quantity="radiosity")
    slide("Lamps", 0.0)
    slide("Glow", 2.0)
    np.testing.assert_allclose(seen(tmp_path), 2 * np.array(GLOW) / math.pi, rtol=1e-4, atol=1e-6)


def test_what_shines_follows_sliders_and_glows_once(plane: bpy.types.Object, tmp_path: Path) -> None:
    """Emission is in the lightmap's node alone, not in the shader, too."""
    plane.data.materials[0].node_tree.nodes["Principled BSDF"].inputs[
        "Specular IOR Level"
    ].default_value = 0.0
    bake_groups()
    show_lightmaps("shine")
    slide("Glow", 3.0, (1.0, 0.5, 0.0))
    np.testing.assert_allclose(seen(tmp_path), expected(1, np.array([3.0, 1.5, 0.0])), rtol=1e-4)


def test_keyframes_change_what_is_rendered_and_outlive_saving(tmp_path: Path) -> None:
    bake_groups()
    (mixer,) = mixers()
    strength = sliders_of(mixer)[0].strength
    for frame, value in ((1, 0.0), (11, 4.0)):
        strength.default_value = value
        strength.keyframe_insert("default_value", frame=frame)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    for frame, value in ((1, 0.0), (11, 4.0)):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(seen(tmp_path), expected(value, 1), rtol=1e-4)


def test_baking_again_keeps_sliders_and_keyframes(tmp_path: Path) -> None:
    bake_groups()
    slide("Glow", 0.5, (0.0, 1.0, 0.0))
    (mixer,) = mixers()
    for frame, value in ((1, 0.0), (11, 4.0)):
        strength = sliders_of(mixer)[0].strength
        strength.default_value = value
        strength.keyframe_insert("default_value", frame=frame)
    bake_groups({"Sky": (1.0, 1.0, 1.0), **GROUPS})
    (mixer,) = mixers()
    assert [(sliders.name, sliders.strength.default_value) for sliders in sliders_of(mixer)][::2] == [
        ("Sky", 1.0),
        ("Glow", 0.5),
    ]
    slide("Sky", 0.0)
    bpy.context.scene.frame_set(11)
    np.testing.assert_allclose(seen(tmp_path), expected(4, np.array([0.0, 0.5, 0.0])), rtol=1e-4)
    restore(bpy.context)
    assert list(bpy.data.actions) == []


def test_a_failed_bake_leaves_the_earlier_sliders() -> None:
    bake_groups()
    slide("Glow", 0.5)
    before = sorted(block.name for block in made_datablocks())
    with pytest.raises(ZeroDivisionError):
        bake_groups({"Sky": (1.0, 1.0, 1.0)}, failing=ZeroDivisionError())
    assert sorted(block.name for block in made_datablocks()) == before
    (mixer,) = mixers()
    assert [sliders.strength.default_value for sliders in sliders_of(mixer)] == [1.0, 0.5]


def test_restore_takes_everything_away(tmp_path: Path) -> None:
    bpy.context.view_layer.update()
    dump_file()
    before = dump_file()
    bake_groups(folder=tmp_path)
    (mixer,) = mixers()
    sliders_of(mixer)[0].strength.keyframe_insert("default_value", frame=1)
    restore(bpy.context)
    bpy.context.view_layer.update()
    assert differences_since(before) == []


def test_undo_takes_back_a_slider() -> None:
    bake_groups()
    bpy.ops.ed.undo_push(message="baked")
    slide("Lamps", 3.0)
    bpy.ops.ed.undo_push(message="slid")
    bpy.ops.ed.undo()
    assert sliders_of(mixers()[0])[0].strength.default_value == 1.0


def test_an_appended_object_brings_its_sliders(tmp_path: Path) -> None:
    bake_groups()
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path) as (_, wanted):
        wanted.objects = ["Plane"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Plane"])
    assert len(bpy.data.scenes) == 1
    bpy.context.scene.radiosity.show = "matte"  # as the bake was; else it is shown as new files show theirs
    slide("Lamps", 2.0)
    np.testing.assert_allclose(seen(tmp_path), expected(2, 1), rtol=1e-4)


@pytest.mark.parametrize("file_format", ["exr", "png16"])
def test_new_light_can_be_put_into_the_images(tmp_path: Path, file_format: str) -> None:
    """After saving and opening again, and brighter than what the PNG's scale was for."""
    bake_groups(format=file_format)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    images, groups = shown_images()
    new = {"Lamps": (8.0, 4.0, 2.0), "Glow": (0.0, 0.0, 0.25)}
    whole = tuple(sum(channel) for channel in zip(*new.values(), strict=True))
    update_images(images, (page(whole),), groups, light_groups(new))
    light = np.add(*new.values())
    np.testing.assert_allclose(seen(tmp_path), np.multiply(BASE, light) + EMISSION, rtol=1e-4)


def test_a_single_lightmap_takes_new_light_too(tmp_path: Path) -> None:
    bake_by_hand(format="png16")
    images, groups = shown_images()
    update_images(images, (page((4.0, 8.0, 1.0)),), groups)
    np.testing.assert_allclose(seen(tmp_path), np.multiply(BASE, (4, 8, 1)) + EMISSION, rtol=1e-4)


def test_light_that_does_not_fit_the_images_is_refused() -> None:
    bake_groups()
    images, groups = shown_images()
    with pytest.raises(BakeError, match="other light groups"):
        update_images(images, (page(LAMP),), groups)
    images[0].scale(4, 4)
    with pytest.raises(BakeError, match="8 × 4 pixels"):
        update_images(images, (page(LAMP),), groups, light_groups())


def test_materials_that_read_many_images_are_warned_of() -> None:
    bake_groups({f"group {number}": LAMP for number in range(MANY_IMAGES)})
    assert crowded_materials() == []
    restore(bpy.context)
    bake_groups({f"group {number}": LAMP for number in range(MANY_IMAGES + 1)})
    (warning,) = crowded_materials()
    assert warning.name == "Paint (Lightmap)"
    assert f"{MANY_IMAGES + 1} images" in warning.message


def test_materials_can_be_made_again_from_what_is_shown(tmp_path: Path, plane: bpy.types.Object) -> None:
    paint = plane.active_material
    bake_groups()
    slide("Glow", 2.0)
    shares = LightShares.shown(bpy.context.scene, BakeSettings(light_groups=True))
    (image,), _ = shown_images()
    anew = LightmapMaterials("irradiance_over_pi", shares).copy_of(paint, image, True, "Glow")
    plane.data.materials[0] = anew
    assert len(mixers()) == 1
    np.testing.assert_allclose(seen(tmp_path), expected(1, 2), rtol=1e-4)
    restore(bpy.context)
    assert LightShares.shown(bpy.context.scene, BakeSettings(light_groups=True)) is None


def test_one_copy_of_a_material_that_does_not_glow_serves_all_groups(plane: bpy.types.Object) -> None:
    plain = principled_material(name="Plain")
    for name in ("a", "b"):
        add_plane(name, plain).radiosity_light_group = name
    bake_groups({"a": LAMP, "b": LAMP, **GROUPS})
    copies = [material.name for material in bpy.data.materials if material.name.startswith("Plain (")]
    assert copies == ["Plain (Lightmap)"]
