"""Exports as engines draw them: pixels of three.js and Babylon.js in Chromium against Cycles' render.

Pixels count where a surface goes on around them and hardly changes, for filters and rasterizers place edges
differently. Scenes are small: what is compared is how lightmaps are shown, not how good they are.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from build_tools import viewer_bundle
from radiosity_addon.blender.command_line.main import main
from tests.browser.browser import ROOT, bundled, chromium, drawn, viewer
from tests.browser.reference import inner_pixels, rendered
from tests.browser.textured_room import build
from tests.trees import build_trees

pytestmark = pytest.mark.one_blender

SIZE, SQUARE = (320, 240), (240, 240)
"""Of pictures: the exported camera is that of the scene's own format, which is square in the Cornell box."""

MAX_CONTRAST = 0.25
"""Between a pixel's neighbors, relative to their mean."""

OF_RGBM = 2.0 / (255.0 * 12**0.5)
"""RMS of rounding to 255 steps, of colors whose largest channel is at least half of them."""

DRAFT = ("--resolution", "256", "--quality", "draft", "--no-preview", "--quiet", "--export", "web,rgbm")


@dataclass(frozen=True, eq=False)
class Exported:
    """An export, and what Cycles shows: with colors, and of the lightmap alone."""

    folder: Path
    cycles: np.ndarray
    cycles_lightmap: np.ndarray
    inner: np.ndarray
    programs: dict[str, Path]
    size: tuple[int, int] = SIZE


@pytest.fixture(scope="module", params=["room", pytest.param("cornell", marks=pytest.mark.full)])
def exported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Exported]:
    """Bake, export, and render with Cycles."""
    chromium()
    folder = tmp_path_factory.mktemp(request.param)
    scene = []
    if request.param == "room":
        build(folder / "room.blend")
        scene = [str(folder / "room.blend")]
    radiosity_addon.register()
    assert main(["bake", *scene, "--output", str(folder / "out"), *DRAFT]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out" / "baked.blend"))
    size = SIZE if request.param == "room" else SQUARE
    inner = inner_pixels(*size)
    images = [rendered(folder, *size, lightmap_only=only) for only in (False, True)]
    programs = {name: bundled(f"{name}_page", folder) for name in ("three", "babylon")}
    yield Exported(folder / "out" / "export", *images, inner, programs, size)
    radiosity_addon.unregister()


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """Nine trees that are one mesh, and what Cycles shows."""
    chromium()
    folder = tmp_path_factory.mktemp("trees")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    build_trees(9)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "trees.blend"))
    radiosity_addon.register()
    words = [str(folder / "trees.blend"), "--output", str(folder / "out"), "--pack", "rectangles"]
    assert main(["bake", *words, *DRAFT]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out" / "baked.blend"))
    inner = inner_pixels(*SIZE)
    images = [rendered(folder, *SIZE, lightmap_only=only) for only in (False, True)]
    programs = {"three": bundled("three_page", folder)}
    radiosity_addon.unregister()
    return Exported(folder / "out" / "export", *images, inner, programs)


def is_even(values: np.ndarray, contrast: float) -> np.ndarray:
    """Return (height, width) where values hardly change around a pixel."""
    around = np.stack([np.roll(values, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)])
    even: np.ndarray = np.ptp(around, axis=0) < contrast * around.mean(axis=0)
    return even


def errors(
    found: np.ndarray, expected: np.ndarray, inner: np.ndarray, least: float = 0.4
) -> tuple[float, float]:
    """Return the relative RMS error, and the median of relative errors.

    least: The share of pixels that must count.
    """
    flat = is_even(expected[..., :3].sum(axis=-1), MAX_CONTRAST)
    counted = inner & flat & (expected[..., 3] > 0.999)
    assert counted.mean() > least
    wanted, difference = expected[counted, :3], (found - expected)[counted, :3]
    relative = np.abs(difference).sum(axis=-1) / wanted.sum(axis=-1)
    return float(np.sqrt((difference**2).sum() / (wanted**2).sum())), float(np.median(relative))


@pytest.mark.parametrize(
    ("engine", "form", "largest", "median"),
    [
        ("three", "exr", 0.003, 0.001),
        ("three", "ktx2", 0.006, 0.002),
        ("three", "rgbm", 0.003 + OF_RGBM, 0.001 + OF_RGBM),
        ("three", "baked", 0.01, 0.03),
        ("babylon", "ktx2", 0.006, 0.002),
        ("babylon", "baked", 0.01, 0.03),
    ],
)
def test_engines_show_what_cycles_shows(
    exported: Exported, engine: str, form: str, largest: float, median: float
) -> None:
    pixels = drawn(exported.folder, exported.programs[engine], *exported.size, form=form)
    found = errors(pixels, exported.cycles, exported.inner)
    assert found[0] < largest
    assert found[1] < median


@pytest.mark.parametrize(("form", "largest"), [("exr", 0.003), ("ktx2", 0.006)])
def test_instances_of_one_mesh_show_their_own_part_of_the_lightmap(
    trees: Exported, form: str, largest: float
) -> None:
    index = json.loads((trees.folder / "lightmaps.json").read_text(encoding="utf-8"))
    assert len({tuple(entry["offset"]) for entry in index["nodes"]}) == 10
    pixels = drawn(trees.folder, trees.programs["three"], *trees.size, form=form)
    found = errors(pixels, trees.cycles, trees.inner)
    assert found[0] < largest


@pytest.mark.full  # the same lightmap as with colors
def test_the_lightmap_alone(exported: Exported) -> None:
    pixels = drawn(exported.folder, exported.programs["three"], *exported.size, form="exr", only="1")
    white = pixels[..., 1] > 0.0
    found = errors(pixels, exported.cycles_lightmap, exported.inner & white & ~_leaves(exported))
    assert found[0] < 0.003
    assert found[1] < 0.001


def _leaves(exported: Exported) -> np.ndarray:
    """Return where cut-outs are: their page shows their color, which is in the image of their alpha."""
    color = exported.cycles[..., :3] / np.maximum(exported.cycles_lightmap[..., :3], 1e-6)
    return color[..., 1] > 3.0 * color[..., [0, 2]].max(axis=-1)  # they alone are green


def test_the_validator_finds_no_error(exported: Exported) -> None:
    check_validity(exported.folder)


def test_the_validator_finds_no_error_in_shared_meshes(trees: Exported) -> None:
    check_validity(trees.folder)


def check_validity(folder: Path) -> None:
    """Have Khronos' validator look at both files of an export."""
    program = (
        "const v=require('gltf-validator'),fs=require('fs'),{dirname,join}=require('path');"
        "const read=(f)=>new Uint8Array(fs.readFileSync(f));"
        "const next=(f)=>({externalResourceFunction:async(u)=>read(join(dirname(f),u))});"
        "Promise.all(process.argv.slice(1).map(f=>v.validateBytes(read(f),next(f))))"
        ".then(r=>console.log(JSON.stringify(r.map(x=>x.issues))))"
    )
    files = [str(folder / name) for name in ("scene.glb", "scene_baked.glb")]
    environment = {
        "NODE_PATH": str(viewer_bundle.node_packages(ROOT)),
        "PATH": "/usr/local/bin:/usr/bin:/bin",
    }
    done = subprocess.run(
        ["node", "-e", program, *files], env=environment, capture_output=True, text=True, check=True
    )
    for issues in json.loads(done.stdout):
        assert issues["numErrors"] == 0, issues["messages"]
        warned = {message["code"] for message in issues["messages"] if message["severity"] == 1}
        assert warned <= {"IMAGE_UNRECOGNIZED_FORMAT"}, "the standard has no format for lightmaps"


def test_the_viewer_opens_from_the_disk(exported: Exported, tmp_path: Path) -> None:
    picture = tmp_path / "viewer.png"
    with viewer(exported.folder / "viewer.html") as shown:
        picture.write_bytes(shown.picture())
    image = bpy.data.images.load(str(picture))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    colors = pixels.reshape(-1, 4)[:, :3]
    background = np.array([0x20, 0x22, 0x24]) / 255
    lit = (np.abs(colors - background).max(axis=1) > 0.02) & (colors.max(axis=1) > 0.1)
    assert lit.mean() > 0.4, "the scene fills most of the window"


def test_the_viewer_mixes_light_groups_and_measures_light(tmp_path: Path) -> None:
    chromium()
    radiosity_addon.register()
    words = ["bake", "--output", str(tmp_path), "--resolution", "32", "--light-group", "Day=Lamp", *DRAFT[2:]]
    assert main(words) == 0
    radiosity_addon.unregister()
    with viewer(tmp_path / "export" / "viewer.html", 500, 500) as shown:
        before = shown.evaluated("viewer.shiny.irradiance(0, 0.5, 0.5)")
        shown.evaluated("viewer.shiny.mix({ Day: [2, 2, 3] }); viewer.draw()")
        after = shown.evaluated("viewer.shiny.irradiance(0, 0.5, 0.5)")
        np.testing.assert_allclose(after, np.array(before) * (2, 2, 3), rtol=0.01)
        assert min(before) > 0
        shown.point_at(250, 200)
        text = shown.evaluated("document.getElementById('lux').textContent")
        assert "lx" in text
        assert "Wall" in text


def test_surfaces_that_glow_follow_their_light_group(tmp_path: Path) -> None:
    chromium()
    build(tmp_path / "room.blend")
    radiosity_addon.register()
    words = ["bake", str(tmp_path / "room.blend"), "--output", str(tmp_path / "out"), *DRAFT[2:]]
    assert main([*words, "--resolution", "32", "--light-group", "Day=Panel"]) == 0
    radiosity_addon.unregister()
    find = "[...viewer.shiny.materials.values()].find(m => m.userData.lightmap.light_group)"
    with viewer(tmp_path / "out" / "export" / "viewer.html", 300, 300) as shown:
        assert shown.evaluated(f"{find}.userData.lightmap.light_group") == "Day"
        before = shown.evaluated(f"{find}.emissive.toArray()")
        assert min(before) > 0
        shown.evaluated("viewer.shiny.mix({ Day: [2, 0.5, 0] }); viewer.draw()")
        after = shown.evaluated(f"{find}.emissive.toArray()")
        np.testing.assert_allclose(after, np.array(before) * (2, 0.5, 0), rtol=1e-6)


def test_the_bundled_program_is_of_its_sources(tmp_path: Path) -> None:
    chromium()
    viewer_bundle.bundle(ROOT, tmp_path / "viewer.js")
    assert (tmp_path / "viewer.js").read_bytes() == (ROOT / viewer_bundle.ASSETS / "viewer.js").read_bytes()
