"""Sidecars: a stored bake gives the same lightmaps, for the same scene and no other."""

from __future__ import annotations

import json
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake_and_keep
from radiosity_addon.bake.relight.kept_bake import KeptBake, relight_pages
from radiosity_addon.bake.relight.responses import Responses
from radiosity_addon.bake.relight.source_strengths import strengths_in
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.bake.scene_diff import RELIGHTABLE, aligned, compare, dark, scene_record
from radiosity_addon.bake.sidecar.plain_objects import restore, stored_names
from radiosity_addon.bake.sidecar.sidecar import (
    FORMAT,
    MAGIC,
    STORED_CLASSES,
    check_belongs,
    read_sidecar,
    sidecar_entry,
    write_sidecar,
)
from radiosity_addon.base.errors import BakeError, SceneError
from radiosity_addon.lights.environment import EnvironmentImage
from radiosity_addon.numerics.array_file import read_arrays, write_arrays
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.scene.textures import SurfaceImages
from radiosity_addon.solver import PointLight, Scene
from tests.relit_rooms import BAKED, CHANGED, NAMES, lit_bake
from tests.rooms import gray_scene
from tests.textured_rooms import furnace
from tests.unit.texel_scenes import bake_scene

SETTINGS = BakeSettings(resolution=32, quality="draft")


@pytest.fixture(scope="module")
def room() -> tuple[BakeResult, KeptBake]:
    return bake_and_keep(lit_bake(), SETTINGS)


@pytest.fixture
def path(room: tuple[BakeResult, KeptBake], tmp_path: Path) -> Path:
    result, kept = room
    file = tmp_path / "lightmap.relight"
    assert write_sidecar(file, kept, result, "mark") == file.stat().st_size
    return file


def all_pixels(kept: KeptBake, strengths: np.ndarray) -> bytes:
    return b"".join(page.pixels.tobytes() for page in relight_pages(kept, strengths))


def fresh(kept: KeptBake) -> KeptBake:
    """A kept bake that has not been lit anew yet."""
    return replace(kept, lit=replace(kept.lit, warm_start=kept.lit.warm_start.first()))


def test_a_stored_bake_gives_the_same_lightmaps_to_the_last_bit(
    room: tuple[BakeResult, KeptBake], path: Path
) -> None:
    _, kept = room
    stored = read_sidecar(path)
    assert (stored.bake_id, stored.settings) == ("mark", SETTINGS)
    # The scene that it is tied to is lit otherwise by now.
    again = stored.kept(lit_bake(CHANGED))
    assert again.names == NAMES
    np.testing.assert_array_equal(again.strengths, BAKED)
    np.testing.assert_array_equal(strengths_in(again, lit_bake(CHANGED)), CHANGED)
    assert all_pixels(again, CHANGED) == all_pixels(fresh(kept), CHANGED)


def test_the_layout_of_the_bake_is_stored_with_it(room: tuple[BakeResult, KeptBake], path: Path) -> None:
    result, _ = room
    stored = read_sidecar(path).result(lit_bake(CHANGED), result.pages, error=0.25)
    for found, expected in zip(stored.objects, result.objects, strict=True):
        assert (found.object.name, found.page) == (expected.object.name, expected.page)
        np.testing.assert_array_equal(found.uv, expected.uv)
        assert (found.density, found.share) == (pytest.approx(expected.density), expected.share)
    assert stored.solver["elements"] == result.solver["elements"]
    assert stored.solver["estimated_error"] == 0.25
    assert json.dumps(stored.atlas) == json.dumps(result.atlas)


def test_relit_bakes_still_warn_of_shapes(room: tuple[BakeResult, KeptBake], path: Path) -> None:
    """The box turned inside out: that has nothing to do with light."""
    triangles = lit_bake().scene.triangles.copy()
    triangles[-12:] = triangles[-12:, ::-1]
    turned = bake_scene(gray_scene(triangles), ("Room", 10), ("Panel", 2), ("Sign", 2), ("Box", 12))
    warnings = read_sidecar(path).result(turned, room[0].pages, error=0.25).warnings
    assert [warning.name for warning in warnings if "is inside out on 100%" in warning.message] == ["Box"]


def test_textures_and_darkness_are_stored_too(tmp_path: Path) -> None:
    """A textured room, once lit and once baked without any light."""
    path = tmp_path / "lightmap.relight"
    triangles, gray = lit_bake().scene.triangles[:10], np.full((10, 3), 0.5)
    lamp = PointLight((1.0, 1.0, 1.0), 0.0, radius=0.05, name="Lamp")
    unlit = bake_scene(Scene(triangles, gray, 0.0 * gray, lights=[lamp]), ("Room", 10))
    for scene, strength in ((bake_scene(furnace(3.0), ("Room", 12)), None), (unlit, np.full((1, 3), 9.0))):
        wanted = BakeSettings(resolution=12, quality="draft", quantity="radiosity")
        result, kept = bake_and_keep(scene, wanted)
        write_sidecar(path, kept, result, "mark")
        strengths = 2.0 * kept.strengths if strength is None else strength
        found = all_pixels(read_sidecar(path).kept(scene), strengths)
        assert found == all_pixels(fresh(kept), strengths)
        assert np.frombuffer(found, dtype=np.float32).any()


def test_damaged_and_missing_sidecars_are_refused_in_one_line(path: Path) -> None:
    content = path.read_bytes()
    for wrong, why in (
        (content[:-20], "damaged"),
        (content[:30], "incomplete"),
        (content[:-1] + bytes([content[-1] ^ 1]), "damaged"),
        (b"PK" + content[2:], "not a sidecar"),
        (b"my notes", "not a sidecar"),
        (content[:20], "incomplete"),
        (content[:16] + bytes([FORMAT + 1]) + content[17:], f"format {FORMAT + 1}"),
    ):
        path.write_bytes(wrong)
        with pytest.raises(BakeError, match=f"'{path}'.* {why}") as caught:
            read_sidecar(path)
        assert "\n" not in str(caught.value)
    path.unlink()
    with pytest.raises(BakeError, match="there is no"):
        read_sidecar(path)


def moved(scene: BakeScene, name: str, amount: float = 1e-6) -> BakeScene:
    item = next(item for item in scene.objects if item.name == name)
    scene.scene.triangles[item.rows] += amount
    return scene


def painted(scene: BakeScene, name: str) -> BakeScene:
    item = next(item for item in scene.objects if item.name == name)
    scene.scene.reflectance[item.rows] *= 0.999
    return scene


def renamed(scene: BakeScene, name: str) -> BakeScene:
    objects = [replace(item, name="Other" if item.name == name else item.name) for item in scene.objects]
    return replace(scene, objects=tuple(objects))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (moved, "'Box'.* moved"),
        (painted, "'Box'.* material"),
        (renamed, "'Box'.* missing"),
    ],
)
def test_another_scene_is_refused_by_name(path: Path, change: object, message: str) -> None:
    stored = read_sidecar(path)
    with pytest.raises(SceneError, match=message):
        stored.kept(change(lit_bake(CHANGED), "Box"))  # type: ignore[operator]


def refuse_unless_relightable(before: BakeScene, now: BakeScene) -> None:
    compare(scene_record(before), scene_record(now)).refuse_all_but(RELIGHTABLE)


def test_an_object_that_was_not_there_is_named() -> None:
    with pytest.raises(SceneError, match="'Other'"):
        refuse_unless_relightable(lit_bake(), added())


def added() -> BakeScene:
    scene = lit_bake()
    return replace(scene, objects=(*scene.objects, replace(scene.objects[-1], name="Other", count=0)))


def test_signs_of_zero_do_not_count() -> None:
    other = lit_bake()
    other.scene.triangles[other.scene.triangles == 0.0] = -0.0
    refuse_unless_relightable(lit_bake(), other)


def test_lamps_that_are_gone_are_dark_and_new_ones_refused() -> None:
    before = lit_bake().scene.lights
    found = aligned(before, before[2:])
    assert [light.name for light in found] == [light.name for light in before]
    np.testing.assert_array_equal([light.strength for light in found[:2]], np.zeros((2, 3)))
    assert found[2:] == before[2:]
    for lights, message in (
        ((*before, PointLight((0, 0, 0), 1.0, name="Moon")), "'Moon' is new"),
        (before[:3], "number of lights 'World'"),
    ):
        other = lit_bake()
        other.scene.lights = lights
        with pytest.raises(SceneError, match=message):
            refuse_unless_relightable(lit_bake(), other)
    assert not dark(EnvironmentImage(2.0, np.ones((4, 8)), name="Sky")).strength.any()


def test_only_known_classes_come_back_and_nothing_of_theirs_is_called(tmp_path: Path) -> None:
    class Loud:
        STORED = ("kept",)

        def __init__(self) -> None:
            raise AssertionError("was called")

        __setattr__ = __reduce__ = __init__  # type: ignore[assignment]

    loud = {"object": ["Loud", {"kept": 3}]}
    assert restore(loud, [], [Loud]).kept == 3
    for has in ({"kept": 3, "other": 4}, {}):
        with pytest.raises(ValueError, match="other attributes"):
            restore({"object": ["Loud", has]}, [], [Loud])
    write_arrays(tmp_path / "forged", MAGIC, FORMAT, loud, [])
    assert read_arrays(tmp_path / "forged", MAGIC, FORMAT)[0] == loud
    with pytest.raises(BakeError, match="damaged"):
        read_sidecar(tmp_path / "forged")


def test_what_is_stored_of_a_class_is_public() -> None:
    """A private attribute may be renamed without a thought for files."""
    for kind in STORED_CLASSES:
        assert not [name for name in stored_names(kind) if name.startswith("_")]


def test_pages_are_sums_of_what_sources_add(room: tuple[BakeResult, KeptBake]) -> None:
    result, kept = room
    responses = Responses(kept, BAKED, result.pages)
    assert responses.missing(BAKED) == []
    np.testing.assert_array_equal(responses.pages(BAKED)[0], result.pages[0].pixels)
    assert responses.missing(CHANGED) == [0, 1, 2, 3, 4, 5]
    for source in responses.missing(CHANGED):
        responses.find(source)
    (exact,) = relight_pages(kept, CHANGED)
    found = responses.pages(CHANGED)[0]
    assert np.sqrt(((found - exact.pixels) ** 2).mean()) < 2e-3 * exact.pixels.mean()
    assert (found >= 0).all()


def textured(change: str = "") -> BakeScene:
    """A closed room of textured walls, its texture changed in a way that keeps every mean."""
    scene = furnace(3.0)
    images = scene.images
    assert images is not None
    values, uv = images.values.copy(), images.image_uv.copy()
    if change == "texture":  # two texels of one triangle change places
        values[4, 20], values[5, 22] = images.values[5, 22], images.values[4, 20]
    elif change == "uv":
        uv[:] = uv[:, [0, 2, 1]]
    elif change == "brighter":
        values[..., 3:6] *= np.float32(1.7)
    elif change == "pattern":
        values[4, 20, 3:6], values[5, 22, 3:6] = images.values[5, 22, 3:6], images.values[4, 20, 3:6]
    elif change == "moved":  # the same texels, elsewhere in the image
        values = np.concatenate([images.values, np.zeros_like(images.values)])
        uv[..., 1] *= 0.5
    changed = copy(scene)
    changed.images = SurfaceImages(values, uv, images.textured)
    if change == "brighter":
        changed.emission = scene.emission * np.float32(1.7)
    return bake_scene(changed, ("Room", 12))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("texture", "a texture of object 'Room', or its UV map, has changed"),
        ("uv", "a texture of object 'Room', or its UV map, has changed"),
        ("pattern", "the pattern that object 'Room' emits has changed"),
    ],
)
def test_textures_with_the_same_means_are_distinguished(tmp_path: Path, change: str, message: str) -> None:
    """From the sidecar as well as from memory."""
    wanted = BakeSettings(resolution=12, quality="draft", quantity="radiosity")
    result, kept = bake_and_keep(textured(), wanted)
    write_sidecar(tmp_path / "lightmap.relight", kept, result, "mark")
    stored = read_sidecar(tmp_path / "lightmap.relight")
    for same in ("", "brighter", "moved"):
        stored.kept(textured(same))
    with pytest.raises(SceneError, match=message):
        stored.kept(textured(change))
    with pytest.raises(SceneError, match=message):
        strengths_in(kept, textured(change))


def test_only_the_sidecar_that_the_report_names_is_used(
    room: tuple[BakeResult, KeptBake], path: Path, tmp_path: Path
) -> None:
    """A bake that is not kept leaves the file of an earlier one."""
    result, kept = room
    stored, report = read_sidecar(path), tmp_path / "report.json"
    with pytest.raises(BakeError, match=r"report\.json' cannot be read"):
        check_belongs(stored, report)
    report.write_text(json.dumps({"kept": sidecar_entry(path, "mark")}))
    check_belongs(stored, report)
    for wrong in ("{}", "[]", '{"kept": 1}', json.dumps({"kept": sidecar_entry(path, "other")})):
        report.write_text(wrong)
        with pytest.raises(BakeError, match="bake again") as caught:
            check_belongs(stored, report)
        assert str(path) in str(caught.value) or str(report) in str(caught.value)
    # The same bake written a second time is another file.
    report.write_text(json.dumps({"kept": sidecar_entry(path, "mark")}))
    write_sidecar(path, replace(kept, rings=kept.rings + 1), result, "mark")
    with pytest.raises(BakeError, match="belongs to another bake"):
        check_belongs(read_sidecar(path), report)


def test_what_takes_more_memory_than_is_allowed_is_refused(path: Path) -> None:
    with pytest.raises(BakeError, match="memory limit") as caught:
        read_sidecar(path, memory_limit=1e-4)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("earlier", range(1, FORMAT))
def test_sidecars_of_earlier_formats_are_refused_by_name(path: Path, earlier: int) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:16] + earlier.to_bytes(4, "little") + content[20:])
    with pytest.raises(BakeError, match=f"'{path}' is not used: it has format {earlier}.*; bake again"):
        read_sidecar(path)
