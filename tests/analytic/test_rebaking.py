"""Kept bakes after something moved: what full bakes give, for a part of their rays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.plan import moved_objects, plan_bake
from radiosity_addon.bake.rebaking import bake_moved
from radiosity_addon.bake.relight.kept_bake import KeptBake, relight_pages
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.bake.sidecar.sidecar import read_sidecar, write_sidecar
from radiosity_addon.base.errors import SceneError
from radiosity_addon.lightmap.transport.sub_cells import RAYS_OF_MET
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import PointLight, Scene
from tests.moved_rooms import ELSEWHERE, PLACE, laid_out_as, room
from tests.rooms import box_room, gray, gray_scene, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene, in_cell

SETTINGS = BakeSettings(resolution=64, quality="draft", threads=1)


def pixels(result: BakeResult) -> np.ndarray:
    """The (n, 3) covered texels of the first page."""
    return np.asarray(result.pages[0].pixels[result.pages[0].coverage], dtype=np.float64)


def full(scene: BakeScene, kept: KeptBake, **settings: int) -> np.ndarray:
    """What a whole bake gives, by the same lightmap coordinates."""
    return pixels(bake(laid_out_as(scene, kept.geometry.uv), replace(SETTINGS, **settings)))


def relative(found: np.ndarray, expected: np.ndarray, where: np.ndarray | slice = slice(None)) -> float:
    """Root mean square of the difference, relative to the mean of the whole."""
    return float(np.sqrt(((found - expected)[where] ** 2).mean()) / expected.mean())


@pytest.fixture(scope="module")
def kept() -> KeptBake:
    _, kept = bake_and_keep(room(), SETTINGS)
    return kept


@pytest.fixture(scope="module")
def moved(kept: KeptBake) -> tuple[BakeResult, KeptBake]:
    result, after = bake_moved(kept, room(ELSEWHERE, 30.0))
    return result, after


@pytest.fixture(scope="module")
def fresh(kept: KeptBake) -> tuple[BakeResult, KeptBake]:
    """A full bake of the box at its new place."""
    result, after = bake_and_keep(laid_out_as(room(ELSEWHERE, 30.0), kept.geometry.uv), SETTINGS)
    return result, after


@pytest.fixture(scope="module")
def expected(fresh: tuple[BakeResult, KeptBake]) -> np.ndarray:
    return pixels(fresh[0])


def test_a_bake_that_followed_a_move_is_relit_from_its_sidecar(
    moved: tuple[BakeResult, KeptBake], tmp_path: Path
) -> None:
    result, after = moved
    path = tmp_path / "lightmap.relight"
    write_sidecar(path, after, result, "bake")
    stored = read_sidecar(path).kept(laid_out_as(room(ELSEWHERE, 30.0), after.geometry.uv))
    wanted = 2.0 * after.strengths
    fresh = replace(after, lit=replace(after.lit, warm_start=after.lit.warm_start.first()))
    pages = [relight_pages(bake, wanted)[0].pixels for bake in (stored, fresh)]
    np.testing.assert_array_equal(*pages)


def test_a_moved_box_gives_what_a_full_bake_gives(
    kept: KeptBake, moved: tuple[BakeResult, KeptBake], expected: np.ndarray
) -> None:
    """Everywhere, and on the floor where it stood and stands: no shadow is left, and none is missing."""
    found, position = pixels(moved[0]), moved[1].geometry.position
    assert relative(found, expected) < 0.01
    for place in (PLACE, ELSEWHERE):
        around = (np.abs(position[:, :2] - place) < 0.35).all(axis=1) & (position[:, 2] < 0.01)
        assert around.sum() > 20
        assert relative(found, expected, around) < 0.01
        assert found[around].mean() == pytest.approx(expected[around].mean(), rel=0.005)
    # So much had to change.
    before = full(room(), kept)
    assert relative(before, expected) > 0.1


def test_a_bake_to_an_error_follows_a_move() -> None:
    """What stays has taken rays in several goes; new points take as many as those in the mean."""
    settings = replace(SETTINGS, quality="medium", relative_error=0.015)
    result, before = bake_and_keep(room(), settings)
    found, after = bake_moved(before, room(ELSEWHERE, 30.0))
    times = before.moves.traced.settings.times_rays
    runs = [kept.moves.traced.points.runs(times) for kept in (before, after)]
    assert runs[0] > 2.5
    assert runs[1] == pytest.approx(runs[0], rel=0.05)
    expected = pixels(bake(laid_out_as(room(ELSEWHERE, 30.0), before.geometry.uv), settings))
    assert relative(pixels(found), expected) < 0.015
    back, _ = bake_moved(after, room())
    assert relative(pixels(back), pixels(result)) < 0.015


def test_it_takes_a_part_of_the_rays(kept: KeptBake, moved: tuple[BakeResult, KeptBake]) -> None:
    assert moved[1].solved.local.caster.rays < 0.4 * kept.solved.local.caster.rays
    assert moved[0].solver["moved"] == ["Box"]


def test_what_moved_can_move_back(
    kept: KeptBake, moved: tuple[BakeResult, KeptBake], expected: np.ndarray
) -> None:
    """On from what was baked anew: errors do not pile up, nor do points."""
    result, back = bake_moved(moved[1], room())
    before = full(room(), kept)
    assert result.solver["moved"] == ["Box"]
    assert relative(pixels(result), before) < 0.01
    again, after = bake_moved(back, room(ELSEWHERE, 30.0))
    assert relative(pixels(again), expected) < 0.01
    points = [len(some.lit.transport.links.sources) for some in (kept, after)]
    assert points[1] < 1.2 * points[0]


def test_it_can_be_relit(moved: tuple[BakeResult, KeptBake], fresh: tuple[BakeResult, KeptBake]) -> None:
    """As a full bake of the moved scene can."""
    strengths = moved[1].strengths
    same = pixels(replace(moved[0], pages=relight_pages(moved[1], strengths)))
    assert relative(same, pixels(moved[0])) < moved[1].lit.tolerance
    strengths = strengths * np.array([2.0, 0.5, 0.0, 1.0, 1.5])[:, None]
    found, expected = (pixels(replace(of[0], pages=relight_pages(of[1], strengths))) for of in (moved, fresh))
    assert relative(found, expected) < 0.01


def test_what_glows_may_move(kept: KeptBake) -> None:
    found, _ = bake_moved(kept, room(panel=-0.6))
    assert found.solver["moved"] == ["Panel"]
    assert relative(pixels(found), full(room(panel=-0.6), kept)) < 0.01


def test_another_size_keeps_its_texels_and_is_reported(kept: KeptBake) -> None:
    found, _ = bake_moved(kept, room(size=1.3))
    assert any("another size" in warning.message for warning in found.warnings)
    assert relative(pixels(found), full(room(size=1.3), kept)) < 0.01


def sealed(at: float) -> BakeScene:
    """A lit room with a sealed box in it, and a block that may stand inside that one."""
    walls, _ = box_room((3.0, 2.0, 1.6))
    hollow = np.concatenate(
        [walls * 0.3 + (0.2, 0.2, 0.2), solid_box((0.19, 0.19, 0.19), (1.11, 0.81, 0.69))]
    )
    block = solid_box((at, 0.4, 0.3), (at + 0.2, 0.6, 0.5))
    triangles = np.concatenate([walls, hollow, block])
    lamp = PointLight((2.0, 1.0, 1.2), 20.0, radius=0.05)
    dark = gray(len(triangles), 0.0)
    scene = gray_scene(triangles, 0.6, dark, lights=(lamp,))
    return bake_scene(scene, ("Room", 12), ("Inside", 12), ("Outside", 12), ("Block", 12))


def test_no_light_comes_along_into_a_sealed_box() -> None:
    """A lit block that is put into it is black then, as all in it is."""
    _, kept = bake_and_keep(sealed(1.9), SETTINGS)
    result, after = bake_moved(kept, sealed(0.5))
    triangle = after.geometry.triangle
    inside = ((triangle >= 12) & (triangle < 24)) | (triangle >= 36)
    found = pixels(result)
    assert inside.sum() > 100
    assert not found[inside].any()
    assert found[~inside].mean() > 0.1


def shelves(at: float) -> BakeScene:
    """A room, red shelves without a lightmap that cut their back, and a block before them."""
    walls, _ = box_room((3.0, 2.0, 1.6))
    boards = [solid_box((0.0, 0.2, z), (0.25, 1.8, z + 0.02)) for z in (0.3, 0.6, 0.9, 1.2)]
    case = np.concatenate([solid_box((0.02, 0.1, 0.1), (0.06, 1.9, 1.5)), *boards])
    block = solid_box((at, 0.7, 0.4), (at + 0.3, 1.2, 1.0))
    triangles = np.concatenate([walls, case, block])
    reflectance = gray(len(triangles), 0.6)
    reflectance[12 : 12 + len(case)] = (0.8, 0.2, 0.1)
    lamp = PointLight((1.5, 1.0, 1.2), 20.0, radius=0.05)
    scene = Scene(triangles, reflectance, gray(len(triangles), 0.0), lights=(lamp,))
    return bake_scene(scene, ("Room", 12), ("Shelves", len(case), None, False), ("Block", 12))


def test_parts_that_nothing_meets_any_more_are_left_out() -> None:
    """Else they wrote what they reflect to the row that stands for nothing, and a second move failed."""
    first, kept = bake_and_keep(shelves(1.9), SETTINGS)
    _, after = bake_moved(kept, shelves(0.8))
    rows = np.concatenate([links.rows for links in after.lit.transport.cells.links])
    assert rows.min() >= len(after.geometry)
    before = np.concatenate([links.rows for links in kept.lit.transport.cells.links])
    old, new = (some.moves.traced.rows.numbers(of) for some, of in ((kept, before), (after, rows)))
    assert np.setdiff1d(old, new).size > 0
    back, _ = bake_moved(after, shelves(1.9))
    assert relative(pixels(back), pixels(first)) < 0.01


def test_what_moved_is_named(kept: KeptBake) -> None:
    assert moved_objects(kept, room()) == ()
    assert moved_objects(kept, room(turn=1.0)) == ("Box",)
    assert moved_objects(kept, room(turn=1.0, panel=0.1)) == ("Box", "Panel")
    with pytest.raises(SceneError, match="nothing has moved"):
        bake_moved(kept, room())


def test_a_kept_bake_is_updated_if_objects_have_moved_and_nothing_else(kept: KeptBake) -> None:
    def kind(scene: BakeScene, settings: BakeSettings = SETTINGS, kept: KeptBake = kept) -> str:
        return plan_bake(scene, settings, None, kept).kind

    assert kind(room(ELSEWHERE)) == "moved"
    assert kind(room()) == "full"
    assert kind(room(ELSEWHERE), replace(SETTINGS, resolution=128)) == "full"
    assert kind(altered(lights=())) == "full"
    assert kind(room(ELSEWHERE), kept=replace(kept, moves=None)) == "full"


def altered(**changes: np.ndarray | tuple) -> BakeScene:
    """The room with other materials or lamps."""
    plain = room(ELSEWHERE)
    scene = plain.scene
    given = {"reflectance": scene.reflectance, "emission": scene.emission, "lights": scene.lights, **changes}
    return replace(plain, scene=Scene(scene.triangles, **given))


def test_other_changes_are_refused(kept: KeptBake) -> None:
    plain = room(ELSEWHERE)
    painted = plain.scene.reflectance.copy()
    painted[12] = 0.1
    with pytest.raises(SceneError, match=r"'Box'.* material"):
        moved_objects(kept, altered(reflectance=painted))
    with pytest.raises(SceneError, match=f"'{plain.scene.lights[-1].name}' is missing"):
        moved_objects(kept, altered(lights=plain.scene.lights[:-1]))
    brighter = (replace(plain.scene.lights[0], power=1.0), *plain.scene.lights[1:])
    with pytest.raises(SceneError, match=r"'Bulb'.* strength"):
        moved_objects(kept, altered(lights=brighter))
    named = replace(plain, objects=(replace(plain.objects[0], name="Hall"), *plain.objects[1:]))
    with pytest.raises(SceneError, match="'Room' is missing"):
        moved_objects(kept, named)
    uv = kept.geometry.uv
    laid_out = laid_out_as(plain, uv)
    assert moved_objects(kept, laid_out) == ("Box",)
    with pytest.raises(SceneError, match=r"'Room'.*coordinates"):
        moved_objects(kept, laid_out_as(plain, 0.5 * uv))
    with pytest.raises(SceneError, match=r"'Room'.*coordinates"):
        moved_objects(replace(kept, bake_scene=laid_out), plain)
    mesh = replace(plain.objects[1], polygon=plain.objects[1].polygon[::-1])
    with pytest.raises(SceneError, match=r"'Box'.* mesh"):
        moved_objects(kept, replace(plain, objects=(plain.objects[0], mesh, plain.objects[2])))
    with pytest.raises(SceneError, match="nothing in it moved"):
        moved_objects(replace(kept, moves=None), plain)


def hovering(height: float) -> BakeScene:
    """A box so far above a floor with eight texels a side, and a lamp beside it."""
    floor = rectangle((0, 0, 0), (3, 0, 0), (0, 3, 0))
    box = solid_box((1, 1, height), (2, 2, height + 0.5))
    of_floor = in_cell((0, 0), (8 / 64, 8 / 64))
    corners = [(0.2 + 0.25 * (side % 3), 0.5 * (side // 3)) for side in range(6)]
    of_box = np.concatenate([in_cell((u, v), (u + 0.2, v + 0.4)) for u, v in corners])
    triangles = np.concatenate([floor, box])
    lamp = PointLight((0.3, 0.3, 1.0), 50.0, name="Bulb")
    scene = gray_scene(triangles, 0.7, lights=[lamp])
    return bake_scene(scene, ("Floor", 2, of_floor), ("Box", 12, of_box))


def test_cells_that_more_rays_meet_after_a_move_gather_with_more() -> None:
    """Each with as many as the rays of texels that meet it ask for, as in a full bake."""
    _, kept = bake_and_keep(hovering(1.5), replace(SETTINGS, keep_uvs=True))
    _, after = bake_moved(kept, hovering(0.05))
    transport = after.lit.transport
    met = np.bincount(transport.links.sources[transport.links.sources >= 0])
    checked = 0
    for links in transport.cells.links:
        often = np.append(met, np.zeros(links.rows.max() + 1, dtype=np.int64))[links.rows]
        asked = np.zeros(len(often), dtype=np.int64)
        for least, rays in RAYS_OF_MET:
            asked[often >= least] = rays
        assert (links.sources.shape[1] >= asked).all()
        checked += int((asked == RAYS_OF_MET[-1][1]).sum())
    assert checked > 10
