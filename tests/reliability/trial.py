"""One random scene: built, baked by the operator, looked at, edited, restored."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import bpy
import numpy as np

from . import edits, folders, light, random_scenes
from .sandbox import add_foreign
from .snapshot import differences, snapshot

POWER = 1.05
"""The most that may arrive and escape by a bake's report, relative to the emitted power, at draft quality."""

EXCESS, DEVIATIONS = 1.10, 4.0
"""The most that a lightmap of 64 pixels may show of an object, relative to the particles' light, and in σ."""

FEWEST_TEXELS = 100

CALLS = ("baked", "refused")


@dataclass
class Trial:
    """What is known of the scene, and what was wrong."""

    random: Random
    folder: Path
    path: Path | None = None
    known: random_scenes.Known | None = None
    problems: list[str] = field(default_factory=list)
    said: str = ""
    measures: dict[str, Any] = field(default_factory=dict)

    def find(self, problems: list[str], when: str) -> None:
        """Note problems."""
        self.problems += [f"{when}: {problem}" for problem in problems]


def try_seed(seed: int, folder: Path) -> tuple[str, list[str], dict[str, Any]]:
    """Make the trial of a seed; returns how it ended, what was wrong, and what was measured."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    trial = Trial(Random(f"scene {seed}"), folder)
    if seed % 4 == 0:
        trial.known = random_scenes.build_known(trial.random)
    else:
        random_scenes.build(trial.random)
    trial.path = random_scenes.save(trial.random, folder)
    if trial.path is not None:
        # Saving gives datablocks what they had not.
        bpy.ops.wm.open_mainfile(filepath=str(trial.path))
    for place in (folder, folder / "lightmaps"):
        add_foreign(place)
    outcome = _run(trial, seed)
    return (
        outcome,
        trial.problems,
        {**trial.measures, **({"said": trial.said[:200]} if outcome == "refused" else {})},
    )


def _run(trial: Trial, seed: int) -> str:
    _evaluate_all()
    before, tree, clean = snapshot(), folders.tree(trial.folder), _images()
    edits.EDITABLE = {obj.name for obj in bpy.context.scene.objects}
    own = _own()
    bpy.ops.ed.undo_push(message="Before")
    outcome = _operate(trial, bpy.ops.radiosity.bake)
    if outcome != "baked":
        trial.find(differences(before, snapshot()), "refused")
        trial.find(folders.changes(tree, folders.tree(trial.folder)), "refused")
        return outcome
    _look_at_files(trial, tree)
    _look_at_texels(trial)
    _look_at_power(trial)
    if trial.known is not None:
        _compare_light(trial, seed)
    draw = trial.random.random()
    if draw < 0.1:
        bpy.ops.ed.undo()
        trial.find(differences(before, snapshot()), "undo of the bake")
        bpy.ops.ed.redo()
        trial.find(_missing_images(), "redo of the bake")
        way = "undone"
    elif draw < 0.55:
        way = "edited"
        _edit(trial, own)
    else:
        way = "two scenes" if len(bpy.data.scenes) > 1 else "plain"
        if way == "two scenes":
            _bake_the_other(trial, clean)
    baked = folders.tree(trial.folder)
    _restore(trial)
    if way != "edited":
        trial.find(differences(before, snapshot()), "restored")
    trial.find(folders.changes(baked, folders.tree(trial.folder)), "restored")
    trial.find(folders.changes(tree, baked, new_allowed=True), "bakes")
    left = [path for path in folders.leftovers(trial.folder) if "blender_mine" not in path]
    trial.find(left, "left over")
    return way


def _operate(trial: Trial, operator: Callable[..., set[str]]) -> str:
    """Run an operator of ours; a refusal is a line of its own."""
    try:
        with _heard() as words:
            status = operator("EXEC_DEFAULT", True)
    except RuntimeError as error:
        message = str(error).strip().removeprefix("Error: ")
        trial.said += message
        if "Traceback" in message or len(message.splitlines()) > 1:
            trial.problems.append(f"{operator.idname_py()}: {message[-400:]}")
            return "crashed"
        return "refused"
    trial.said += words[0]
    if "Traceback" in words[0]:
        trial.problems.append(f"{operator.idname_py()}: {words[0][-400:]}")
    return "baked" if status == {"FINISHED"} else "refused"


@contextlib.contextmanager
def _heard() -> Iterator[list[str]]:
    """Collect what this process prints."""
    words = [""]
    kept = os.dup(1), os.dup(2)
    with tempfile.TemporaryFile() as file:
        for number in (1, 2):
            os.dup2(file.fileno(), number)
        try:
            yield words
        finally:
            for number, old in zip((1, 2), kept, strict=True):
                os.dup2(old, number)
                os.close(old)
            file.seek(0)
            words[0] = file.read().decode("utf-8", "replace")


def _evaluate_all() -> None:
    """Have every scene's matrices worked out: what was never shown has none yet."""
    first = bpy.context.scene
    for scene in (*bpy.data.scenes, first):
        bpy.context.window.scene = scene
        bpy.context.view_layer.update()


def _own() -> set[str]:
    """Return the names of objects with a mesh of their own, in one scene, and nothing that changes it."""
    users: dict[str, int] = {}
    for obj in bpy.data.objects:
        if obj.data is not None:
            users[obj.data.name] = users.get(obj.data.name, 0) + 1
    instanced = {obj.name for group in bpy.data.collections for obj in group.objects if _is_instanced(group)}
    return {
        obj.name
        for obj in bpy.context.scene.objects
        if obj.type == "MESH" and users[obj.data.name] == 1 and not obj.modifiers
        and len(obj.users_scene) == 1 and obj.name not in instanced and obj.instance_type == "NONE"
    }  # fmt: skip


def _is_instanced(group: bpy.types.Collection) -> bool:
    return any(obj.instance_collection == group for obj in bpy.data.objects)


def _images() -> set[str]:
    return {image.name for image in bpy.data.images}


def _look_at_files(trial: Trial, tree: dict[str, str]) -> None:
    """What is new is what a report lists; what was there is as it was."""
    after = folders.tree(trial.folder)
    trial.find(folders.changes(tree, after, new_allowed=True), "baked")
    new = [trial.folder / name for name in after.keys() - tree.keys()]
    places = {path.parent for path in new}
    told = {place / name for place in places for name in folders.listed(place)}
    told |= {path for place in places for path in folders.reports(place)}
    trial.find([f"nobody lists {path.name}" for path in new if path.is_file() and path not in told], "baked")
    if trial.path is not None:
        trial.find(folders.broken_result(trial.folder / "lightmaps"), "baked")


def _report(trial: Trial) -> dict[str, Any] | None:
    found = folders.reports(trial.folder / "lightmaps")
    return next(iter(found.values()), None)


def _look_at_texels(trial: Trial) -> None:
    """Every texel of every lightmap in the open file is a number, and not negative."""
    for image in bpy.data.images:
        if image.get("radiosity_lightmaps") is None and not _in_folder(trial, image):
            continue
        pixels = _pixels(image)
        if not np.isfinite(pixels).all():
            trial.problems.append(f"{image.name} holds NaN or infinity")
        elif pixels.size and pixels.min() < 0:
            trial.problems.append(f"{image.name} holds {pixels.min()}")


def _in_folder(trial: Trial, image: bpy.types.Image) -> bool:
    path = Path(bpy.path.abspath(image.filepath_raw)) if image.filepath_raw else None
    return path is not None and path.parent == trial.folder / "lightmaps"


def _pixels(image: bpy.types.Image) -> np.ndarray:
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)[..., :3]


def _look_at_power(trial: Trial) -> None:
    """By its own report, a bake does not absorb and lose more than was emitted."""
    report = _report(trial)
    power = report["solver"].get("power_W") if report is not None else None
    if not power:
        return
    emitted, arrived = (float(np.sum(power[key])) for key in ("emitted", "absorbed"))
    arrived += float(np.sum(power["escaped"]))
    if not np.isfinite(arrived):
        trial.problems.append(f"power: {power}")
    elif emitted > 0:
        trial.measures["power"] = arrived / emitted
        if arrived > POWER * emitted:
            trial.problems.append(f"power: {arrived / emitted:.3f} of what is emitted arrives")


def _compare_light(trial: Trial, seed: int) -> None:
    """No object that does not emit shows more light than particles bring to it."""
    known = trial.known
    assert known is not None
    triangles = light.triangles_of(bpy.context.scene)
    arrived = light.follow(triangles, known, seed)
    report = _report(trial)
    power = report["solver"].get("power_W") if report is not None else None
    if power and arrived.emitted > 0:
        told = float(np.mean(power["emitted"]))
        trial.measures["emitted"] = told / arrived.emitted
        doubt, least_doubt = (
            0.005 * arrived.emitted + 3 * deviation
            for deviation in (arrived.deviation, arrived.leaving_deviation)
        )
        # Rays pass layers that are a hair apart, so decision 0045 may count these once, or not.
        if not arrived.leaving - least_doubt <= told <= arrived.emitted + doubt:
            least = f"{arrived.leaving:.4g} to " if arrived.hair else ""
            trial.problems.append(
                f"power: {told:.4g} W emitted where there are {least}{arrived.emitted:.4g} W"
            )
    for name in arrived.front:
        mean = _mean_shown(bpy.data.objects[name], seed) if name not in known.emission else None
        if mean is None or (arrived.hair and mean.max() > 0):
            continue  # light between sheets a hair apart is held in, not made: a leak is another matter
        power_in, deviation = arrived.front[name]
        most = (EXCESS * power_in + DEVIATIONS * deviation) / arrived.area[name]
        brought = float(power_in.sum()) / arrived.area[name] / 3
        if brought > 0:
            ratio = float(mean.mean()) / brought
            trial.measures[f"shown {name}"] = ratio
        if (mean > most + 1e-6).any():
            trial.problems.append(
                f"light from nothing on {name}: {mean.mean():.4g} where {brought:.4g} W/m² arrive"
            )


def _mean_shown(obj: bpy.types.Object, seed: int, count: int = 4000) -> np.ndarray | None:
    """Return the mean of an object's lightmap at random surface points; None for too few texels."""
    image, mesh = light.lightmap_of(obj), obj.data
    layer = mesh.uv_layers.get("Lightmap")
    if image is None or layer is None:
        return None
    mesh.calc_loop_triangles()
    uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
    layer.data.foreach_get("uv", uv)
    loops = np.array([triangle.loops[:] for triangle in mesh.loop_triangles])
    area = np.array([triangle.area for triangle in mesh.loop_triangles])
    corners = uv.reshape(-1, 2)[loops]
    random = np.random.default_rng(seed)
    chosen = random.choice(len(area), count, p=area / area.sum())
    root, second = np.sqrt(random.random(count)), random.random(count)
    weights = np.stack([1 - root, root * (1 - second), root * second], axis=1)
    at = np.einsum("ij,ijk->ik", weights, corners[chosen])
    pixels = _pixels(image)
    height, width = pixels.shape[:2]
    column = np.clip((at[:, 0] * width).astype(int), 0, width - 1)
    row = np.clip((at[:, 1] * height).astype(int), 0, height - 1)
    if len(set(zip(row.tolist(), column.tolist(), strict=True))) < FEWEST_TEXELS:
        return None
    return pixels[row, column].astype(np.float64).mean(axis=0)


def _missing_images() -> list[str]:
    """Return the lightmaps that have no pixels."""
    lost = []
    for image in bpy.data.images:
        if image.get("radiosity_lightmaps") is not None and not image.has_data:
            image.reload()
            if not image.pixels:
                lost.append(f"{image.name} has no pixels")
    return lost


def _edit(trial: Trial, own: set[str]) -> None:
    """Edit, bake again or not, restore, and look for the edits."""
    made: dict[str, tuple[str, edits.Check]] = {}
    for _ in range(trial.random.randint(1, 3)):
        found = edits.edit(trial.random, own)
        if found is None:
            continue
        # An edit may undo an earlier one of the same object: the last one counts.
        made[found[0].split(" on ", 1)[1]] = found
    again = trial.random.random() < 0.5
    if again:
        with contextlib.suppress(StopIteration):
            _operate(trial, bpy.ops.radiosity.bake)
    _restore(trial)
    for what, check in made.values():
        try:
            wrong = check(trial.said)
        except (KeyError, ReferenceError) as error:
            wrong = f"gone: {error}"
        if wrong:
            trial.problems.append(f"edit lost{' by the next bake' if again else ''}: {what}: {wrong}")


def _bake_the_other(trial: Trial, clean: set[str]) -> None:
    """Bake the second scene; what the first one shows stays."""
    first, second = bpy.context.scene, next(s for s in bpy.data.scenes if s != bpy.context.scene)
    alone = [obj for obj in first.objects if obj.type == "MESH" and len(obj.users_scene) == 1]
    alone = [obj for obj in alone if obj.name in edits.EDITABLE]
    shown = {obj.name for obj in alone if _shows_new(obj, clean)}
    bpy.context.window.scene = second
    if _operate(trial, bpy.ops.radiosity.bake) == "baked":
        now = {name for name in shown if _shows_new(bpy.data.objects[name], clean)}
        trial.find([f"{name} shows no lightmap any more" for name in sorted(shown - now)], "second scene")
    bpy.context.window.scene = first


def _shows_new(obj: bpy.types.Object, clean: set[str]) -> bool:
    image = light.lightmap_of(obj)
    return image is not None and image.name not in clean


def _restore(trial: Trial) -> None:
    """Restore every scene."""
    first = bpy.context.scene
    for scene in bpy.data.scenes:
        bpy.context.window.scene = scene
        if bpy.ops.radiosity.restore.poll():
            _operate(trial, bpy.ops.radiosity.restore)
    bpy.context.window.scene = first
