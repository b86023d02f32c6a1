"""The pictures and figures of docs/rooms.md: six rooms baked by two versions, next to path tracing.

    python -m docs.pictures.rooms FOLDER scenes
    python -m docs.pictures.rooms FOLDER flip
    python -m docs.pictures.rooms FOLDER bake before CHECKOUT
    python -m docs.pictures.rooms FOLDER bake after .
    python -m docs.pictures.rooms FOLDER render
    python -m docs.pictures.rooms FOLDER join
    python -m docs.pictures.rooms FOLDER table

FOLDER keeps everything; each step leaves alone what is there already. CHECKOUT is a checkout of the version
before the work on layouts. `--room NAME` restricts a step to one room. Needs bpy, and the shared scenes next
to this checkout for all rooms but the office.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER

from .rooms_table import AFTER, BEFORE, COSTS, costs_of, write_table

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT.parent / "shared" / "scenes"
IMAGES = ROOT / "docs" / "images" / "rooms"

RESOLUTION, QUALITY, THREADS = 1024, "draft", 2
WIDTH = 960
BAKED_SAMPLES, TRACED_SAMPLES = 24, 128
TRACED = "traced"

GAP = 8
LARGEST_BYTES = 480_000
"""Of a joined picture."""

MISSING_COLOR = (0.8, 0.8, 0.8, 1.0)
"""Of images whose file is missing, as in bakes. Cycles shows them in pink."""

CLOCK = """
import os, runpy, sys, time, types
from radiosity_addon.bake import stages
busy = lambda: sum(os.times()[:4])
stages.time = types.SimpleNamespace(perf_counter=busy, process_time=busy)
sys.argv[0] = "radiosity_addon"
runpy.run_module("radiosity_addon", run_name="__main__", alter_sys=True)
"""
"""Runs a checkout's command line with stages timed by the processor time of its process and their children:
old versions measure wall-clock time, which other work on the machine disturbs."""


@dataclass(frozen=True)
class Room:
    """A scene and where it is seen from.

    Parameters
    ----------
    name : str
    path : str or None
        Below the shared scenes; None for the office.
    view : ((3,), (3,), float) or None
        Place and target of the camera, and its lens [mm]; None for the scene's own.
    size : (int, int)
        Of the picture.
    detail : (int, int)
        Left and top of what is shown in detail.
    exposure : float or None
        Stops; None for the scene's own.
    sky : float or None
        Radiance that lights a scene without lamps [W/m²/sr].
    flipped : bool
        Whether walls whose normals point out of the room are flipped first, with the add-on's Flip Faces.
    """

    name: str
    path: str | None
    view: tuple[tuple[float, float, float], tuple[float, float, float], float] | None = None
    size: tuple[int, int] = (WIDTH, 540)
    detail: tuple[int, int] = (0, 0)
    exposure: float | None = None
    sky: float | None = None
    flipped: bool = False


ROOMS = (
    Room("classroom", "classroom/classroom-matte.blend", detail=(300, 30)),
    Room("staircase", "staircase/staircase.blend", size=(540, 960), detail=(110, 330), flipped=True),
    Room(
        "sponza",
        "sponza/sponza.blend",
        ((9.0, -5.3, 1.7), (-4.0, -3.0, 2.8), 20.0),
        detail=(40, 20),
        exposure=1.0,
    ),
    Room(
        "platformer",
        "platformer/platformer.blend",
        ((3.0, -6.0, 1.6), (-3.0, 4.0, 1.0), 22.0),
        detail=(130, 200),
        exposure=-2.0,
    ),
    Room(
        "game-map",
        "game-map/zdm2.obj",
        ((-222.0, -95.0, 82.0), (-100.0, -140.0, 95.0), 18.0),
        detail=(320, 190),
        exposure=0.2,
        sky=1.0,
    ),
    Room("office", None, size=(WIDTH, 600), detail=(60, 20)),
)


def make_scene(room: Room, target: Path) -> None:
    """Write a room's scene with its camera."""
    import bpy

    from bench.interior.blender_parts import even_sky
    from bench.interior.office import build_office
    from radiosity_addon.blender.files.files import empty_scene, open_scene

    if room.path is None:
        empty_scene()
        build_office()
    else:
        open_scene(SCENES / room.path)
    scene = bpy.context.scene
    if room.sky is not None:
        even_sky(scene, (room.sky,) * 3)
    for material in bpy.data.materials:
        if material.node_tree is not None:
            _replace_missing_images(material.node_tree)
    _aim(scene, room)
    scene.render.resolution_x, scene.render.resolution_y = room.size
    scene.render.resolution_percentage = 100
    if room.exposure is not None:
        scene.view_settings.exposure = room.exposure
    bpy.context.preferences.filepaths.save_version = 0
    target.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(target), compress=True)


def _replace_missing_images(tree: Any) -> None:
    import bpy

    for node in [node for node in tree.nodes if node.type == "TEX_IMAGE"]:
        image = node.image
        if image is not None and (image.packed_file or Path(bpy.path.abspath(image.filepath)).is_file()):
            continue
        for link in list(node.outputs["Color"].links):
            socket = link.to_socket
            tree.links.remove(link)
            if socket.type == "RGBA":
                socket.default_value = MISSING_COLOR


def _aim(scene: Any, room: Room) -> None:
    import bpy

    if room.view is None:
        return
    place, target, lens = room.view
    camera = bpy.data.objects.new("View", bpy.data.cameras.new("View"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    along = [each - other for each, other in zip(target, place, strict=True)]
    camera.location, camera.data.lens = place, lens
    camera.data.clip_end = 10_000.0
    camera.rotation_euler = (
        math.atan2(math.hypot(*along[:2]), -along[2]),
        0.0,
        math.atan2(-along[0], along[1]),
    )


def flip(folder: Path, scene: Path) -> None:
    """Flip a scene's faces that a bake finds lit from behind, as its user would."""
    import bpy

    import radiosity_addon

    output = folder / "unflipped" / scene.stem
    if not (output / "baked.blend").is_file():
        words = ["bake", str(scene), "--output", str(output), "--quality", QUALITY]
        words += ["--resolution", str(RESOLUTION), "--no-preview", "--quiet"]
        subprocess.run([sys.executable, "-m", "radiosity_addon", *words], cwd=ROOT, check=True)
    radiosity_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(output / "baked.blend"))
    bpy.ops.radiosity.flip_turned_faces()
    bpy.ops.radiosity.restore()
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(scene), compress=True)


def bake(folder: Path, room: Room, when: str, checkout: Path) -> None:
    """Bake a room's scene with a checkout's command line; keep what it cost."""
    output = folder / when / room.name
    words = ["bake", str(folder / "scenes" / f"{room.name}.blend"), "--output", str(output)]
    words += ["--quality", QUALITY, "--resolution", str(RESOLUTION), "--threads", str(THREADS)]
    started = time.perf_counter()
    running = subprocess.Popen([sys.executable, "-c", CLOCK, *words, "--no-preview", "--quiet"], cwd=checkout)
    _, status, usage = os.wait4(running.pid, 0)
    running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise SystemExit(f"{room.name}: the bake failed with {running.returncode}")
    cost = {
        "wall_seconds": round(time.perf_counter() - started, 1),
        "processor_seconds": round(usage.ru_utime + usage.ru_stime, 1),
        "peak_MB": round(usage.ru_maxrss * 1024 / 1e6),
        "commit": subprocess.run(
            ["git", "rev-parse", "--short=10", "HEAD"],
            cwd=checkout,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip(),
    }
    (output / "cost.json").write_text(json.dumps(cost, indent=1) + "\n", encoding="utf-8")


def count_texels(output: Path) -> dict[str, float]:
    """Return the shares of texels whose center is on a surface, without and with shared ones.

    Reports of old versions also count texels of which a surface touches only a corner.
    """
    import bpy
    import numpy as np

    from radiosity_addon.lightmap.texels import rasterize

    bpy.ops.wm.open_mainfile(filepath=str(output / "baked.blend"))
    parts = []
    for obj in bpy.context.scene.objects:
        if obj.type == "MESH" and LIGHTMAP_UV_LAYER in obj.data.uv_layers and not obj.hide_render:
            mesh = obj.data
            mesh.calc_loop_triangles()
            corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
            mesh.loop_triangles.foreach_get("loops", corners)
            uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
            mesh.uv_layers[LIGHTMAP_UV_LAYER].uv.foreach_get("vector", uv)
            parts.append(uv.reshape(-1, 2)[corners].reshape(-1, 3, 2))
    texels = rasterize(np.concatenate(parts), RESOLUTION)
    report = json.loads((output / "report.json").read_text(encoding="utf-8"))
    touched = len(np.unique(RESOLUTION * texels.row.astype(np.int64) + texels.column)) / RESOLUTION**2
    own = int(texels.center_inside.sum()) / RESOLUTION**2
    shared = max(report["pages"][0]["utilisation"] - touched, 0.0)
    return {"own_texels": round(own, 4), "used_texels": round(own + shared, 4)}


def render(blend: Path, picture: Path, samples: int) -> None:
    """Render a file with Cycles, denoised."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling = "CPU", samples, False
    cycles.use_denoising, cycles.denoiser = True, "OPENIMAGEDENOISE"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 32
    cycles.transparent_max_bounces = cycles.transmission_bounces = 32
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.filepath = str(picture.with_suffix(".part.png"))
    bpy.ops.render.render(write_still=True)
    picture.with_suffix(".part.png").rename(picture)


def join(folder: Path, room: Room) -> None:
    """Write before, after and traced side by side, and a detail of each below, as one JPEG.

    The pictures are scaled to two thirds; the details are not.
    """
    from PIL import Image

    names = [folder / "pictures" / f"{room.name}-{which}.png" for which in (BEFORE, AFTER, TRACED)]
    pictures = [Image.open(name).convert("RGB") for name in names]
    width, height = (2 * side // 3 for side in room.size)
    detail = width // 2
    joined = Image.new("RGB", (3 * (width + GAP) - GAP, height + GAP + detail), "white")
    left, top = room.detail
    for place, picture in enumerate(pictures):
        across = place * (width + GAP)
        joined.paste(picture.resize((width, height), Image.Resampling.LANCZOS), (across, 0))
        joined.paste(picture.crop((left, top, left + width, top + detail)), (across, height + GAP))
    IMAGES.mkdir(parents=True, exist_ok=True)
    target = IMAGES / f"{room.name}.jpg"
    for quality in range(92, 40, -2):
        joined.save(target, quality=quality, optimize=True)
        if target.stat().st_size <= LARGEST_BYTES:
            return


def record(folder: Path) -> None:
    """Write what all bakes cost into the results of the benchmarks, and the page's table from it."""
    for cost in folder.glob("*/*/cost.json"):
        known = json.loads(cost.read_text(encoding="utf-8"))
        if cost.parts[-3] in (BEFORE, AFTER) and "used_texels" not in known:
            cost.write_text(json.dumps(known | count_texels(cost.parent), indent=1) + "\n", encoding="utf-8")
    costs = {
        room.name: {
            when: costs_of(folder / when / room.name)
            for when in (BEFORE, AFTER)
            if (folder / when / room.name / "cost.json").is_file()
        }
        for room in ROOMS
    }
    found = {
        "case": "layouts",
        "resolution": RESOLUTION,
        "quality": QUALITY,
        "threads": THREADS,
        "costs": costs,
    }
    COSTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    write_table()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("step", choices=("scenes", "flip", "bake", "render", "join", "table"))
    parser.add_argument("when", nargs="?", choices=(BEFORE, AFTER))
    parser.add_argument("checkout", nargs="?", type=Path)
    parser.add_argument("--room", choices=[room.name for room in ROOMS])
    given = parser.parse_args()
    folder = given.folder.absolute()
    if given.step == "table":
        record(folder)
        return
    for room in ROOMS:
        if given.room in (None, room.name):
            _step(folder, room, given)


def _step(folder: Path, room: Room, given: argparse.Namespace) -> None:
    scene = folder / "scenes" / f"{room.name}.blend"
    if given.step == "scenes" and not scene.is_file():
        make_scene(room, scene)
    elif given.step == "flip" and room.flipped and not (folder / "unflipped" / room.name).is_dir():
        flip(folder, scene)
    elif given.step == "bake" and not (folder / given.when / room.name / "cost.json").is_file():
        bake(folder, room, given.when, given.checkout.absolute())
    elif given.step == "render":
        baked = [(folder / when / room.name / "baked.blend", when, BAKED_SAMPLES) for when in (BEFORE, AFTER)]
        for blend, which, samples in [*baked, (scene, TRACED, TRACED_SAMPLES)]:
            picture = folder / "pictures" / f"{room.name}-{which}.png"
            if blend.is_file() and not picture.is_file():
                picture.parent.mkdir(exist_ok=True)
                render(blend, picture, samples)
    elif given.step == "join":
        join(folder, room)


if __name__ == "__main__":
    main()
