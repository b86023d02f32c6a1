"""Whole bakes of hand-made scenes, without Blender."""

from __future__ import annotations

import gc
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.quality import QUALITY_SETTINGS, quality_of
from radiosity_addon.bake.result.pictures import Picture
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.errors import SceneError
from radiosity_addon.base.progress import Cancelled, Progress, Status
from radiosity_addon.options import METHODS, BakeSettings, options_of_method
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import EnvironmentLight, PointLight, Scene, solve
from radiosity_addon.solver.links import initial
from tests.rooms import FLOOR, box_room, gray, gray_scene, rectangle, solid_box, sphere
from tests.seam_steps import seam_steps
from tests.unit.texel_scenes import QUAD_UV, bake_object, bake_scene, in_cell
from tests.watched import noting
from tests.wording import says


def run(scene: BakeScene, **settings: Any) -> BakeResult:
    fractions: list[float] = []
    progress = Progress(lambda status: fractions.append(status.fraction))
    result = bake(scene, BakeSettings(**{"quality": "draft", "resolution": 32, **settings}), progress)
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] < fractions[-1] <= 1
    return result


def texels(result: BakeResult, page: int = 0) -> np.ndarray:
    """The (n, 3) covered texels of a page."""
    return result.pages[page].pixels[result.pages[page].coverage]


def lit_room(reflectance: float = 0.5, emission: float = 0.0, **changed: Any) -> BakeScene:
    triangles, _ = box_room()
    scene = gray_scene(triangles, reflectance, emission, **changed)
    return bake_scene(scene, ("Room", 12))


LAMP = PointLight((0.5, 0.4, 0.6), (10.0, 5.0, 2.0), radius=0.05)


def test_uniform_enclosure_is_constant() -> None:
    """Walls that emit E = 1 and reflect a half: H = 2, so H/π = 2/π in every texel."""
    result = run(lit_room(emission=1.0))
    np.testing.assert_allclose(texels(result), 2 / np.pi, rtol=0.01)
    # Dilation carries the constant on.
    np.testing.assert_allclose(result.pages[0].pixels, 2 / np.pi, rtol=0.01)
    assert set(result.seconds) == {"unwrap", "rasterise", "solve", "light", "encode"}
    assert result.warnings == ()


def test_open_floor_under_a_sky_and_what_a_box_covers() -> None:
    """L = 1: the open floor sees H = π, the floor under the closed box nothing at all."""
    floor = rectangle((-4, -4, 0), (8, 0, 0), (0, 8, 0))
    triangles = np.concatenate([floor, solid_box((-1, -1, 0), (1, 1, 1))])
    scene = gray_scene(triangles, 0.0, two_sided=True, lights=[EnvironmentLight(1.0)])
    result = run(bake_scene(scene, ("Floor", 2, QUAD_UV), ("Box", 12, None, False)), resolution=64)
    pixels = np.pi * result.pages[0].pixels
    center = (np.arange(64) + 0.5) / 8 - 4
    reach = np.maximum(np.abs(center)[:, None], np.abs(center)[None, :])
    assert not pixels[reach < 0.9].any()
    np.testing.assert_allclose(pixels[reach > 3.9], np.pi, rtol=0.04)
    assert (pixels[reach > 1.1] > 1.4).all()
    # Texels away from the box see all of the sky but what the box hides; from the corner 0.5 %.
    corners = pixels[[0, 0, -1, -1], [0, -1, 0, -1]]
    np.testing.assert_allclose(corners, np.pi, rtol=0.02)


@pytest.fixture(scope="module")
def lamp_lit() -> BakeResult:
    """The room with the lamp and the default settings."""
    return run(lit_room(lights=[LAMP]))


def test_direct_and_indirect_are_parts_of_all(lamp_lit: BakeResult) -> None:
    every = lamp_lit
    direct, indirect = (run(lit_room(lights=[LAMP]), light=light) for light in ("direct", "indirect"))
    total = texels(direct).astype(float) + texels(indirect)
    np.testing.assert_allclose(total, texels(every), rtol=1e-6, atol=1e-7)
    assert texels(direct).max() > 0
    assert (texels(indirect) > 0).all()


@pytest.mark.parametrize("light", ["all", "indirect"])
def test_quantities_relate_exactly(light: str) -> None:
    """irradiance = π × irradiance_over_pi, radiosity = E + ρ × irradiance (E is no indirect light)."""
    triangles, surface = box_room()
    reflectance = np.tile([0.2, 0.5, 0.8], (12, 1))
    emission = gray(12, 0.0)
    emission[surface == FLOOR] = (1.0, 2.0, 3.0)
    uv = np.tile(QUAD_UV, (6, 1, 1)) / 3 + np.stack([surface % 3, surface // 3], axis=1)[:, None] / 3
    scene = bake_scene(
        Scene(triangles, reflectance, emission, lights=[LAMP]), ("Room", 12, uv.astype(np.float32))
    )
    over_pi, irradiance, radiosity = (
        run(scene, light=light, quantity=quantity, resolution=24).pages[0].pixels.astype(float)
        for quantity in ("irradiance_over_pi", "irradiance", "radiosity")
    )
    np.testing.assert_allclose(irradiance, np.pi * over_pi, rtol=1e-6)
    inner = np.zeros((24, 24), dtype=bool)
    inner[:16] = True  # the six cells fill the lower two thirds: no dilated texel there
    emitted = np.zeros((24, 24, 3))
    emitted[:8, :8] = (1.0, 2.0, 3.0) if light != "indirect" else 0.0
    expected = emitted + irradiance * [0.2, 0.5, 0.8]
    np.testing.assert_allclose(radiosity[inner], expected[inner], rtol=1e-6, atol=1e-7)


def test_no_seam_between_coplanar_charts() -> None:
    """Two halves of one wall in charts of their own: across the joint they differ no more than inside."""
    room, _ = box_room((2, 1, 1))
    halves = [rectangle((x, 0, 0), (1, 0, 0), (0, 1, 0)) for x in (0, 1)]
    triangles = np.concatenate([*halves, room[2:]])
    lamp = PointLight((0.9, 0.5, 0.5), 10.0, radius=0.05)
    scene = gray_scene(triangles, 0.7, lights=[lamp])
    uv = [in_cell((0, 0), (0.5, 0.5)), in_cell((0.5, 0.5), (1, 1))]
    parts = (("Left", 2, uv[0]), ("Right", 2, uv[1]), ("Rest", 10, None, False))
    settings = BakeSettings(quality="draft", resolution=64)
    result, kept = bake_and_keep(bake_scene(scene, *parts), settings)
    pixels = result.pages[0].pixels
    left, right = pixels[:32, :32], pixels[32:, 32:]
    step = np.maximum(np.abs(left[:, -1] - left[:, -2]), np.abs(right[:, 1] - right[:, 0])).mean()
    joint = np.abs(right[:, 0] - left[:, -1]).mean()
    assert joint < 1.5 * step
    assert joint < 0.05 * pixels[:32].mean()
    # Look-ups on both sides of the joint agree: the page is stitched.
    assert kept.seams is not None
    across, inside, _ = seam_steps(kept.geometry, kept.seams, [pixels]).medians()
    assert across < 0.5 * inside


def test_a_sealed_room_inside_a_lit_one_stays_black() -> None:
    """Walls of a single plane, two-sided: no texel inside gets more than a thousandth of the mean outside."""
    outer, _ = box_room((3, 3, 3))
    inner, _ = box_room((1, 1, 1))
    inner = inner + np.array([1.0, 1.0, 0.0])  # it stands on the floor, which runs on inside
    triangles = np.concatenate([outer, inner[2:]])
    count = len(triangles)
    lamp = PointLight((0.5, 0.5, 2.5), 100.0, radius=0.1)
    scene = gray_scene(triangles, 0.8, two_sided=True, lights=[lamp])
    floor = in_cell((0, 0), (0.75, 0.75))
    uv = np.concatenate([floor, np.zeros((count - 2, 3, 2), np.float32)])
    sides = count - 12
    # The inner room's fronts look inwards, so its lightmap is that of the dark side.
    parts = (("Floor", 2, uv[:2]), ("Outer", 10, None, False), ("Inner", sides))
    result = run(bake_scene(scene, *parts), resolution=64, atlas="per-object")
    floor_page, inner_page = result.pages
    mean = texels(result).mean()
    assert mean > 0.1
    assert inner_page.pixels[inner_page.coverage].max() < 1e-3 * mean
    # Texels of the floor that lie wholly inside the walls.
    center = (np.arange(64) + 0.5) / 64 / 0.75 * 3
    inside = (np.abs(center - 1.5) < 0.5 - 2 * 3 / 48) & (center < 3)
    covered = floor_page.pixels[np.ix_(inside, inside)]
    assert covered.size > 0
    assert covered.max() < 1e-3 * mean


@pytest.mark.parametrize("wall", [0.0, 0.01])
@pytest.mark.parametrize("height", [0.0, 0.4])
def test_no_texel_in_a_sealed_box_is_lit(wall: float, height: float) -> None:
    """Askew on the floor, which its own then lies in, or above it; of a single plane, or 1 cm thick."""
    room, _ = box_room((4, 3, 2.5))
    inner, _ = box_room((1, 1, 1))
    shells = [inner] + ([solid_box((-wall,) * 3, (1 + wall,) * 3)] if wall else [])
    cosine, sine = np.cos(0.5), np.sin(0.5)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    boxes = [shell @ turn + np.array([1.7, 0.8, height + wall]) for shell in shells]
    triangles = np.concatenate([room, *boxes])
    lamp = PointLight((0.5, 1.5, 2.0), 100.0, radius=0.05)
    scene = gray_scene(triangles, 0.8, two_sided=True, lights=[lamp, EnvironmentLight(0.2)])
    parts = (("Room", 12), ("Inner", 12), ("Outer", 12, None, False))
    pages = run(bake_scene(scene, *parts[: 1 + len(shells)]), atlas="per-object").pages
    assert pages[0].pixels[pages[0].coverage].mean() > 1
    assert not pages[1].pixels.any()


def test_light_takes_many_short_steps() -> None:
    """A window stays alive, and a bar moves, while texels are lit."""
    noted: list[Status] = []
    bake(lit_room(lights=[LAMP]), BakeSettings(resolution=256, quality="draft"), noting(noted))
    assert [status.stage for status in noted].count("light") > 40


def test_threads_change_no_byte_and_the_seed_does() -> None:
    scene = lit_room(lights=[LAMP, EnvironmentLight(0.1)])
    one, two, other = (run(scene, threads=threads, seed=seed) for threads, seed in ((1, 0), (2, 0), (2, 1)))
    assert one.pages[0].pixels.tobytes() == two.pages[0].pixels.tobytes()
    assert without_seconds(one.solver) == without_seconds(two.solver)
    assert one.objects[0].uv.tobytes() == two.objects[0].uv.tobytes()
    assert one.pages[0].pixels.tobytes() != other.pages[0].pixels.tobytes()


def test_the_work_of_the_processor_is_reported() -> None:
    result = run(lit_room(lights=[LAMP]), threads=1)
    work = result.performance
    assert set(work["processor_seconds"]) == set(result.seconds)
    assert work["rays"] >= result.solver["rays"] > 0
    assert 0.0 < work["embree_seconds"] < sum(work["processor_seconds"].values())
    assert work["rays_per_texel"] > 1.0
    assert work["microseconds_per_ray"] * work["rays"] > 1e6 * work["embree_seconds"] * 0.5


def without_seconds(solver: dict[str, Any]) -> dict[str, Any]:
    """What the solver tells, but for how long it took."""
    history = [{**entry, "seconds": None} for entry in solver["history"]]
    assert history
    return {**solver, "history": history}


def three_objects() -> BakeScene:
    room, _ = box_room((3, 3, 3))
    boxes = [solid_box((x, 1, 0.5), (x + 0.5, 1.5, 1)) for x in (0.5, 2.0)]
    triangles = np.concatenate([room, *boxes])
    scene = gray_scene(triangles, lights=[PointLight((1.5, 1.5, 2.5), 50.0)])
    return bake_scene(scene, ("Room", 12), ("Idle", 12, None, False), ("Box", 12))


def test_a_page_an_object_or_one_for_all() -> None:
    apart, shared = run(three_objects(), atlas="per-object"), run(three_objects(), atlas="shared")
    assert [(item.object.name, item.page) for item in apart.objects] == [("Room", 0), ("Box", 1)]
    assert [(item.object.name, item.page) for item in shared.objects] == [("Room", 0), ("Box", 0)]
    assert len(apart.pages) == 2
    assert len(shared.pages) == 1
    for result in (apart, shared):
        for page in result.pages:
            assert page.pixels.shape == (32, 32, 3)
            assert page.pixels.dtype == np.float32
            assert np.isfinite(page.pixels).all()
            assert page.coverage.any()
        for item in result.objects:
            assert item.uv.shape == (item.object.count, 3, 2)
            assert item.uv.min() >= 0
            assert item.uv.max() <= 1
    # The same light on the same surfaces, whatever the page.
    assert texels(apart, 0).mean() == pytest.approx(texels(shared).mean(), rel=0.15)


def test_kept_uvs_come_back_bit_for_bit() -> None:
    uv = in_cell((0.1, 0.2), (0.7, 0.9))
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    scene = gray_scene(floor, lights=[EnvironmentLight(1.0)])
    result = run(bake_scene(scene, ("Floor", 2, uv)), resolution=20)
    np.testing.assert_array_equal(result.objects[0].uv, uv)
    rows, columns = np.nonzero(result.pages[0].coverage)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (4, 17, 2, 13)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_pictures_tile_the_room_and_the_last_one_is_the_solution(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("radiosity_addon.bake.pipeline.PICTURE_SECONDS", 0.0)
    room = lit_room(lights=[LAMP], two_sided=True)
    given = {"elements": 60} if "elements" in options_of_method(method) else {}
    settings = BakeSettings(quality="draft", resolution=16, method=method, **given)
    noted: list[Status] = []
    bake(room, settings, noting(noted))
    pictures = [status.picture for status in noted if isinstance(status.picture, Picture)]
    assert len(pictures) >= 2
    scene = room.scene
    for picture in pictures:
        edges = picture.corners[:, 1:] - picture.corners[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1]).astype(np.float64) / 2
        area = np.linalg.norm(normals, axis=1)
        for side, sign in ((picture.front, 1), (~picture.front, -1)):
            tiled = np.bincount(picture.triangle[side], area[side], minlength=len(scene))
            np.testing.assert_allclose(tiled, scene.areas, rtol=1e-5)
            facing = (normals[side] * scene.face_normals[picture.triangle[side]]).sum(axis=1)
            np.testing.assert_allclose(sign * facing, area[side], rtol=1e-4)
    solution = solve(scene, quality_of(settings).solver)
    for side, radiosity in (
        (picture.front, solution.triangle_radiosity),
        (~picture.front, solution.back_radiosity),
    ):
        power = (area[:, None] * picture.radiosity)[side]
        mean = np.stack(
            [np.bincount(picture.triangle[side], column, len(scene)) for column in power.T], axis=1
        )
        np.testing.assert_allclose(mean / scene.areas[:, None], radiosity, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("steps", [1, 3, 6, 12])
def test_canceled_it_leaves_nothing_running(steps: int) -> None:
    before = {thread.ident for thread in threading.enumerate()}
    stages: list[str] = []

    def listen(status: Status) -> None:
        stages.append(status.stage)
        if len(stages) == steps:
            raise Cancelled

    with pytest.raises(Cancelled):
        bake(lit_room(lights=[LAMP]), BakeSettings(quality="draft", resolution=32), Progress(listen))
    assert stages[0] == "unwrap"
    assert len(stages) == steps
    gc.collect()
    assert {thread.ident for thread in threading.enumerate()} <= before


def test_without_light_it_is_black_and_says_so() -> None:
    seen_from_within = replace(lit_room(), cameras=((0.5, 0.5, 0.5),))
    result = run(seen_from_within)
    assert not result.pages[0].pixels.any()
    assert [warning.name for warning in result.warnings] == ["scene"]
    assert "black" in result.warnings[0].message


@pytest.mark.parametrize("method", ["jacobi", "gauss-seidel", "shooting", "multi-level", "hierarchical"])
def test_a_solution_short_of_its_tolerance_says_so(method: str) -> None:
    scene = lit_room(lights=[LAMP], reflectance=0.9)
    few = {"elements": 48} if "elements" in options_of_method(method) else {}
    short = run(scene, method=method, resolution=16, max_iterations=1, **few)
    assert [warning.name for warning in short.warnings] == ["scene"]
    assert f"{method} method stopped after 1 iteration" in short.warnings[0].message
    assert short.solver["residual"] > short.solver["settings"]["tolerance"]
    done = run(scene, method=method, resolution=16, **few)
    assert done.warnings == ()
    assert done.solver["residual"] <= done.solver["settings"]["tolerance"]


def test_nothing_to_bake_is_an_error() -> None:
    triangles, _ = box_room()
    scene = gray_scene(triangles)
    empty = bake_object("Empty", 12, 0)
    for objects in (
        (),
        (bake_object("Room", 0, 12, bake=False),),
        (bake_object("Room", 0, 12, bake=False), empty),
    ):
        with pytest.raises(SceneError, match="nothing to bake"):
            run(BakeScene(scene, objects))


def test_triangles_without_area_do_no_harm(lamp_lit: BakeResult) -> None:
    triangles, _ = box_room()
    flat = np.concatenate([triangles, np.zeros((2, 3, 3)), triangles[:1, [0, 0, 1]]])
    scene = gray_scene(flat, lights=[LAMP])
    result = run(bake_scene(scene, ("Room", 15)))
    assert np.isfinite(result.pages[0].pixels).all()
    assert texels(result).mean() == pytest.approx(texels(lamp_lit).mean(), rel=0.02)


def test_links_that_had_to_begin_coarse_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many small curved things, and a budget that does not do for the links they ask for."""
    chance = np.random.default_rng(5)
    balls = [0.06 * sphere(1)[:, ::-1] + chance.uniform(0.1, 0.9, 3) for _ in range(10)]
    triangles = np.concatenate([box_room()[0], *balls])
    count = len(triangles)
    scene = gray_scene(triangles, lights=[LAMP])
    clutter = bake_scene(scene, ("Room", 12), ("Balls", count - 12))
    monkeypatch.setattr(initial, "MIN_LINKS", 1)

    def told(**settings: Any) -> list[str]:
        warnings = run(clutter, resolution=16, **settings).warnings
        return [warning.message for warning in warnings if "links begin coarse" in warning.message]

    assert told() == []
    (message,) = told(max_links=2_000)
    share = float(message.split("up to ")[1].split("%")[0])
    assert 100 * initial.COARSEST_FAINT * QUALITY_SETTINGS["draft"].solver.error < share < 100
    assert says(message, "Max Links", "memory limit")
