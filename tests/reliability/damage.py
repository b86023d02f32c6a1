"""Damaged files of every kind, given to the command line in a process of its own.

Whatever the file holds: exit code 0, 1 or 2, a few lines at most, no traceback, little memory, nothing
touched outside the output folder, and the earlier result is whole, or a new one is.
"""

from __future__ import annotations

import contextlib
import json
import shutil
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from random import Random

from . import folders
from .command import bad_manners, run_python
from .damage_place import Place
from .damaged_arrays import damage_arrays
from .sandbox import FOREIGN
from .tally import Tally

COUNT = 320

OPEN = """
import bpy, os, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
for image in bpy.data.images:
    len(image.pixels)  # reads its file
os._exit(0)
"""
IMPORT = """
import bpy, os, sys
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
run = bpy.ops.wm.obj_import if sys.argv[1].endswith("obj") else bpy.ops.import_scene.gltf
try:
    run(filepath=sys.argv[1])
except RuntimeError:
    pass
os._exit(0)
"""


def run_all(tally: Tally, root: Path, seeds: Iterable[int], workers: int = 2) -> None:
    """Make the trials, each worker in a place of its own."""
    places: Queue[Place] = Queue()
    first = Place(root / "0")
    first.make()
    places.put(first)
    for number in range(1, workers):
        # A result names its scene by its path: each place bakes its own.
        place = Place(root / str(number))
        place.make()
        places.put(place)

    def one(seed: int) -> None:
        place = places.get()
        try:
            tally.add(seed, *_try(place, seed))
        finally:
            places.put(place)

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(one, [seed for seed in seeds if not tally.done(seed)]))


def _try(place: Place, seed: int) -> tuple[str, list[str]]:
    """Damage a file, bake, and look at what is left."""
    random = Random(f"damage {seed}")
    title, damage = KINDS[seed % len(KINDS)]
    scene, what, relights = damage(place, random)
    before = folders.tree(place.work, place.out, place.work / "tmp")
    temporary = folders.tree(place.work / "tmp")
    foreign = {name: (place.out / name).read_bytes() for name in FOREIGN}
    old = {name: entry["sha256"] for name, entry in folders.listed(place.out).items()}
    done = place.relight(scene) if relights else place.bake(scene)
    problems = []
    outcome = f"{title}: exit code {done.code}"
    if done.crashed and _blender_crashes(place.work / scene):
        outcome = f"{title}: Blender itself crashes"
    else:
        problems += bad_manners(done)
    problems += folders.changes(before, folders.tree(place.work, place.out, place.work / "tmp"))
    now = {name: (place.out / name).read_bytes() for name in FOREIGN if (place.out / name).is_file()}
    problems += [f"touched: {name}" for name in FOREIGN if now.get(name) != foreign[name]]
    kept = {name: of["sha256"] for name, of in folders.listed(place.out).items()} == old
    if (done.code == 0 or not kept) and title != "report":
        lines = folders.broken_result(place.out)
        # A sidecar that is damaged and serves all the same is not written again.
        problems += [line for line in lines if title != "sidecar" or not line.endswith(".relight")]
    if done.code >= 0:
        left = folders.changes(temporary, folders.tree(place.work / "tmp"))
        problems += [f"left: {line}" for line in left]
        problems += [f"left: {line}" for line in folders.leftovers(place.out) if "blender_mine" not in line]
    if done.code == 0:
        problems += _bad_texels(place)
    return outcome, [f"{title}, {what}: {problem}" for problem in problems]


def _blender_crashes(scene: Path) -> bool:
    """Whether Blender alone goes down with the file."""
    code = OPEN if scene.suffix == ".blend" else IMPORT
    return run_python(code, scene, cwd=scene.parent).code < 0


READ = """
import os, sys
import bpy
import numpy as np
for path in sys.argv[1:]:
    image = bpy.data.images.load(path)
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    if not np.isfinite(pixels).all():
        sys.stderr.write(f"NaN in {path}")
    elif pixels.min() < 0:
        sys.stderr.write(f"negative in {path}")
sys.stderr.flush()
os._exit(0)
"""


def _bad_texels(place: Place) -> list[str]:
    """Tell of NaN, infinity and negative values in the lightmaps."""
    names = [name for report in folders.reports(place.out).values() for name in folders.images_of(report)]
    done = run_python(READ, *(place.out / name for name in names), cwd=place.work)
    return [line for line in done.err.splitlines() if line.startswith(("NaN", "negative"))]


Damage = Callable[[Place, Random], tuple[str, str, bool]]
"""Damages a file; returns the scene to bake, what was done, and whether the bake is to be relit."""


def flip(path: Path, random: Random) -> str:
    """Cut bytes off, or change some, or all of a part."""
    content = bytearray(path.read_bytes())
    kind = random.choice(("cut", "flip", "flip", "zero", "random", "head", "grow", "empty"))
    if kind == "cut":
        content = content[: random.randrange(1, len(content))]
    elif kind == "flip":
        for _ in range(random.choice((1, 3, 20, 200))):
            content[random.randrange(len(content))] ^= 1 << random.randrange(8)
    elif kind in ("zero", "random"):
        start = random.randrange(len(content))
        for place in range(start, min(len(content), start + random.choice((4, 64, 1024)))):
            content[place] = 0 if kind == "zero" else random.randrange(256)
    elif kind == "head":
        for _ in range(3):
            content[random.randrange(min(64, len(content)))] = random.randrange(256)
    elif kind == "grow":
        content += bytes(random.randrange(256) for _ in range(1000))
    else:
        content = bytearray()
    path.write_bytes(content)
    return kind


def blend(place: Place, random: Random) -> tuple[str, str, bool]:
    name = random.choice(("plain.blend", "with_png.blend"))
    place.refresh(name)
    return name, flip(place.work / name, random), False


def glb(place: Place, random: Random) -> tuple[str, str, bool]:
    """Change the description in a .glb, or its bytes."""
    place.refresh("plain.glb")
    path = place.work / "plain.glb"
    if random.random() < 0.4:
        return path.name, flip(path, random), False
    content = path.read_bytes()
    length = int.from_bytes(content[12:16], "little")
    told = json.loads(content[20 : 20 + length])
    what = _break_gltf(told, random)
    text = json.dumps(told).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + length :]
    size = 20 + len(text) + len(rest)
    head = b"glTF" + (2).to_bytes(4, "little") + size.to_bytes(4, "little")
    path.write_bytes(head + len(text).to_bytes(4, "little") + b"JSON" + text + rest)
    return path.name, what, False


def gltf(place: Place, random: Random) -> tuple[str, str, bool]:
    """Change a .gltf, or the files beside it."""
    place.refresh("apart.gltf")
    path = place.work / "apart.gltf"
    kind = random.choice(("text", "json", "json", "json", "buffer", "missing"))
    beside = [
        other
        for other in place.work.iterdir()
        if other.suffix in {".bin", ".png"} and other.name != "photo.png"
    ]
    if kind == "text":
        return path.name, flip(path, random), False
    if kind == "buffer":
        other = random.choice(sorted(beside))
        return path.name, f"{other.suffix} {flip(other, random)}", False
    if kind == "missing":
        other = random.choice(sorted(beside))
        other.unlink()
        return path.name, f"{other.suffix} missing", False
    told = json.loads(path.read_text())
    what = _break_gltf(told, random)
    path.write_text(json.dumps(told))
    return path.name, what, False


ODD = (
    -1,
    0,
    1,
    2**31,
    2**63,
    10**12,
    1e308,
    None,
    "text",
    [],
    {},
    True,
    float("nan"),
    float("inf"),
    "../../etc/passwd",
)


def _break_gltf(told: dict, random: Random) -> str:
    """Put something odd somewhere, or take something away."""
    for _ in range(random.choice((1, 1, 3))):
        node, path = told, []
        while True:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            if not keys:
                break
            key = random.choice(keys)
            path.append(str(key))
            inner = node[key]
            if isinstance(inner, dict | list) and inner and random.random() < 0.85:
                node = inner
                continue
            if random.random() < 0.3:
                del node[key]
                path.append("gone")
            else:
                node[key] = random.choice(ODD)
                path.append(repr(node[key]))
            break
    return "/".join(path)


def obj(place: Place, random: Random) -> tuple[str, str, bool]:
    """Break lines of an .obj."""
    place.refresh("plain.obj")
    path = place.work / "plain.obj"
    if random.random() < 0.3:
        return path.name, flip(path, random), False
    lines = path.read_text().splitlines()
    odd = (
        "f 1 2 999999",
        "f -1 -2 -99",
        "f 1/9/9 2/9/9 3/9/9",
        "f 1",
        "f",
        "v nan 0 0",
        "v inf 1 1",
        "v 1e308 0 0",
    )
    odd += (
        "v 1",
        "vt nan nan",
        "f 0 0 0",
        "f 99999999999999999999 1 2",
        "mtllib ../../../etc/passwd",
        "usemtl \x00",
    )
    odd += (
        "vn nan 0 0",
        "l 1 999",
        "g " + "x" * 5000,
        "f " + "1 2 3 " * 5000,
        "curv 0 1 1 2",
        "f 1 1 1",
        "call rm",
    )
    made = [random.choice(odd) for _ in range(random.choice((1, 3)))]
    for line in made:
        lines.insert(random.randrange(len(lines)), line)
    path.write_text("\n".join(lines))
    return path.name, made[0][:30], False


def image(place: Place, random: Random) -> tuple[str, str, bool]:
    """Damage a texture that the scene reads, or put a file of another kind in its place."""
    suffix = random.choice(("png", "jpg", "exr", "hdr"))
    name = f"with_{suffix}.blend"
    place.refresh(name)
    path = place.work / f"picture.{suffix}"
    if random.random() < 0.2:
        other = random.choice([place.work / f"picture.{kind}" for kind in ("png", "jpg", "exr", "hdr")])
        shutil.copyfile(place.work / "plain.obj" if other == path else other, path)
        return name, f"{suffix} is {other.suffix}", False
    return name, f"{suffix} {flip(path, random)}", False


def sidecar(place: Place, random: Random) -> tuple[str, str, bool]:
    """Damage a sidecar, with its digest made right or not; or put one of another scene there."""
    place.refresh("plain.blend")
    (path,) = place.out.glob("*.relight")
    if random.random() < 0.25:
        return "plain.blend", flip(path, random), True
    if random.random() < 0.1:
        place.refresh("with_png.blend")
        content = next(place.out.glob("*.relight")).read_bytes()
        place.refresh("plain.blend")
        path.write_bytes(content)
        return "plain.blend", "of another scene", True
    return "plain.blend", damage_arrays(path, random), True


def report(place: Place, random: Random) -> tuple[str, str, bool]:
    """Damage the report of the earlier result."""
    place.refresh("plain.blend")
    (path,) = folders.reports(place.out)
    if random.random() < 0.4:
        return "plain.blend", flip(path, random), False
    told = json.loads(path.read_text())
    what = _break_gltf(told, random)
    with contextlib.suppress(AttributeError, TypeError):
        if random.random() < 0.3:
            told["files"]["../notes.txt"] = {"bytes": 1, "sha256": "0", "scene": ""}
            what += " and a path that climbs"
    path.write_text(json.dumps(told))
    return "plain.blend", what, False


KINDS: tuple[tuple[str, Damage], ...] = (
    *(("blend", blend), ("glb", glb), ("sidecar", sidecar), ("image", image), ("obj", obj), ("gltf", gltf)),
    *(
        ("blend", blend),
        ("sidecar", sidecar),
        ("glb", glb),
        ("report", report),
        ("blend", blend),
        ("image", image),
    ),
    *(("obj", obj), ("gltf", gltf), ("sidecar", sidecar), ("blend", blend)),
)
