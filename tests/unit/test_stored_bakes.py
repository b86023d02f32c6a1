"""Bakes stored in a spool come back as they were; what else is there is refused before it is used."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake import plan_bake
from radiosity_addon.bake.result import BakeResult
from radiosity_addon.base import SILENT, BakeError
from radiosity_addon.cli import Console, Interrupts
from radiosity_addon.farm import (
    BakeInputs,
    PreparedBake,
    Spool,
    prepared_in,
    result_in,
    run_command,
    store_prepared,
)
from radiosity_addon.farm.objects import DigestsAlone, Writer, digest_of
from radiosity_addon.farm.run_stage import run
from radiosity_addon.farm.stages import bake_prepared, finished_into, finishing, stage_of
from radiosity_addon.farm.stored_result import StoredResult
from radiosity_addon.farm.worker import wait_for
from radiosity_addon.lights import PointLight
from radiosity_addon.options import BakeSettings
from tests.glass_rooms import glazed_room
from tests.moved_rooms import ELSEWHERE, room

SETTINGS = BakeSettings(resolution=32, quality="sketch", threads=1)


@pytest.fixture
def spool(tmp_path: Path) -> Spool:
    return Spool.made(tmp_path / "spool")


@pytest.fixture
def inputs() -> BakeInputs:
    return BakeInputs(room(), SETTINGS, False)


@pytest.fixture
def prepared(spool: Spool, inputs: BakeInputs) -> PreparedBake:
    wanted = PreparedBake("", SETTINGS, source="/home/me/room.blend", scene="Scene")
    assert store_prepared(spool, inputs, wanted)
    return prepared_in(spool)


def same(one: Any, other: Any) -> None:
    """Assert that two values hold the same numbers."""
    tree = Writer(DigestsAlone())
    assert tree.tree(one) == tree.tree(other)


@pytest.mark.parametrize("scene", [room, glazed_room])
def test_a_scene_comes_back_with_its_digest(scene: Callable[[], Any], spool: Spool) -> None:
    inputs = BakeInputs(scene(), replace(SETTINGS, groups=(("A", ("Lamp",)),)), True)
    digest = inputs.write(spool)
    assert digest == inputs.digest()
    found = BakeInputs.read(Spool.to_work(spool.path), digest)
    assert (found.settings, found.keep) == (inputs.settings, True)
    same(found.bake_scene, inputs.bake_scene)
    assert found.digest() == digest


def test_everything_that_decides_a_bake_is_in_the_digest(inputs: BakeInputs) -> None:
    scene = inputs.bake_scene
    changed = [
        replace(inputs, keep=True),
        replace(inputs, settings=replace(SETTINGS, seed=1)),
        replace(inputs, bake_scene=replace(scene, cameras=((0.0, 0.0, 1.0),))),
        replace(inputs, bake_scene=replace(scene, emitter_names=("Other",))),
        replace(
            inputs, bake_scene=replace(scene, objects=(replace(scene.objects[0], page=1), *scene.objects[1:]))
        ),
        replace(inputs, bake_scene=replace(scene, scene=scene.scene.with_lights(()))),
    ]
    assert len({inputs.digest(), *(each.digest() for each in changed)}) == len(changed) + 1
    # What is looked up meanwhile is not.
    before = inputs.digest()
    _ = scene.scene.layers, scene.scene.sealed
    assert inputs.digest() == before


def test_a_result_comes_back(spool: Spool, inputs: BakeInputs, prepared: PreparedBake) -> None:
    with pytest.raises(BakeError, match="has no result yet"):
        result_in(spool, prepared)
    bake_prepared(spool, prepared.inputs, inputs, None)
    found = result_in(Spool.to_work(spool.path), prepared).result(inputs.bake_scene, SETTINGS)
    assert isinstance(found, BakeResult)
    assert [each.object for each in found.objects] == [
        item for item in inputs.bake_scene.objects if item.bake
    ]
    assert found.pages[0].pixels.shape == (32, 32, 3)
    assert stage_of(spool) == "ready to finish"


def with_state(value: Any, **state: Any) -> Any:
    """Return a value that is written with other attributes than it can have."""
    changed = copy(value)
    for name, part in state.items():
        object.__setattr__(changed, name, part)
    return changed


SCENES: dict[str, Callable[[Any], Any]] = {
    "no triangles": lambda it: _scene(it, triangles=np.zeros((0, 3, 3))),
    "flat triangles": lambda it: _scene(it, triangles=it.scene.triangles.reshape(-1, 9)),
    "triangles that are nowhere": lambda it: _scene(it, triangles=it.scene.triangles * np.nan),
    "whole numbers": lambda it: _scene(it, triangles=it.scene.triangles.astype(np.int64)),
    "normals of others": lambda it: _scene(it, normals=it.scene.normals[1:]),
    "too bright": lambda it: _scene(it, reflectance=it.scene.reflectance + 2.0),
    "sides of others": lambda it: _scene(it, two_sided=it.scene.two_sided[1:]),
    "no lamps": lambda it: _scene(it, lights=(None,)),
    "a lamp without light": lambda it: _scene(it, lights=(_lamp(power=np.array([np.nan] * 3)),)),
    "a lamp that is text": lambda it: _scene(it, lights=(_lamp(power="bright"),)),
    "images that are none": lambda it: _scene(it, images=it.scene.lights),
    "no scene": lambda it: with_state(it, scene=None),
    "no objects": lambda it: with_state(it, objects=()),
    "a list of objects": lambda it: with_state(it, objects=list(it.objects)),
    "objects twice": lambda it: with_state(it, objects=(*it.objects, *it.objects)),
    "a name that is none": lambda it: _object(it, name=3),
    "loops beyond": lambda it: _object(it, loops=it.objects[0].loops - 100),
    "loops of others": lambda it: _object(it, loops=it.objects[0].loops[:-1]),
    "polygons of others": lambda it: _object(it, polygon=it.objects[0].polygon[:-1]),
    "coordinates of others": lambda it: _object(it, uv=np.zeros((1, 3, 2), np.float32)),
    "more than there are": lambda it: _object(it, count=it.objects[0].count + 1),
    "emitters of others": lambda it: with_state(it, emitter=np.zeros(1, np.int32)),
    "warnings that are none": lambda it: with_state(it, warnings=("text",)),
    "groups that are numbers": lambda it: with_state(it, light_groups=(1,)),
    "cameras in the plane": lambda it: with_state(it, cameras=((0.0, 0.0),)),
}


def _scene(bake_scene: Any, **state: Any) -> Any:
    return with_state(bake_scene, scene=with_state(bake_scene.scene, **state))


def _object(bake_scene: Any, **state: Any) -> Any:
    first, *others = bake_scene.objects
    return with_state(bake_scene, objects=(with_state(first, **state), *others))


def _lamp(**state: Any) -> Any:
    return with_state(PointLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0)), **state)


@pytest.mark.parametrize("what", SCENES)
def test_scenes_that_no_export_makes_are_refused(what: str, spool: Spool, inputs: BakeInputs) -> None:
    hostile = replace(inputs, bake_scene=SCENES[what](inputs.bake_scene))
    store_prepared(spool, hostile, PreparedBake("", SETTINGS))
    with pytest.raises(BakeError, match=r"damaged.*: prepare it again") as caught:
        run(spool.path, None, Console(quiet=True), Interrupts())
    assert "\n" not in str(caught.value)
    assert not spool.has_results()


@pytest.mark.parametrize(
    "settings",
    [
        {"resolution": "many"},
        {"resolution": 10**9},
        {"threads": 10**6},
        {"groups": "A=B"},
        {"unknown": 1},
        {"seed": 1.5},
        {"method": "other"},
    ],
)
@pytest.mark.parametrize("place", ["inputs", "prepared"])
def test_settings_that_are_none_are_refused(
    settings: dict[str, Any], place: str, spool: Spool, prepared: PreparedBake
) -> None:
    digest = prepared.inputs if place == "inputs" else spool.pointer("prepared")
    assert digest is not None
    tree = json.loads(spool.object(digest))
    entries = next(value["dict"] for key, value in tree["dict"] if key == "settings")
    known = dict(map(tuple, entries)) | {name: Writer(spool).tree(value) for name, value in settings.items()}
    entries[:] = [list(each) for each in known.items()]
    changed = put(spool, tree)
    spool.point("prepared", changed)
    read = {"inputs": partial(BakeInputs.read, spool, changed), "prepared": partial(prepared_in, spool)}
    with pytest.raises(BakeError, match="damaged"):
        read[place]()


def put(spool: Spool, tree: Any) -> str:
    """Store what JSON holds, whatever it is; return its digest."""
    text = json.dumps(tree)
    spool.put_object(digest_of(text), text)
    return digest_of(text)


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"../../../../etc/passwd", b"0" * 40, b"f" * (1 << 20), b"\xff" * 40],
)
def test_pointers_that_lead_nowhere_are_refused(content: bytes, spool: Spool, prepared: PreparedBake) -> None:
    (spool.path / "results" / prepared.inputs).write_bytes(content)
    with pytest.raises(BakeError, match="is damaged: run the bake again"):
        result_in(spool, prepared)
    (spool.path / "prepared").write_bytes(content)
    with pytest.raises(BakeError, match=r"is damaged.*: prepare it again"):
        prepared_in(spool)
    assert run_command(["run", str(spool.path)]) == 1
    assert run_command(["status", str(spool.path)]) == 1


@pytest.mark.parametrize("tree", [1, None, [1], {"dict": []}, {"list": [1]}, {"function": "os:system"}])
def test_objects_of_other_things_are_refused(tree: Any, spool: Spool, prepared: PreparedBake) -> None:
    digest = put(spool, tree)
    spool.point(f"results/{prepared.inputs}", digest)
    with pytest.raises(BakeError, match="is damaged: run the bake again"):
        result_in(spool, prepared)
    with pytest.raises(BakeError, match="damaged"):
        BakeInputs.read(spool, digest)
    spool.point("prepared", digest)
    with pytest.raises(BakeError, match="damaged"):
        prepared_in(spool)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_pipes_are_not_waited_for(spool: Spool, prepared: PreparedBake) -> None:
    objects = [path for path in spool.path.glob("*/*") if path.is_file()]
    for path in (spool.path / "prepared", *objects):
        content = path.read_bytes()
        path.unlink()
        os.mkfifo(path)
        assert run_command(["run", str(spool.path), "--quiet"]) == 1
        path.unlink()
        path.write_bytes(content)
    os.mkfifo(spool.path / "finished")
    assert finished_into(spool) is None


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights here")
def test_results_that_are_a_link_are_refused(spool: Spool, prepared: PreparedBake, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (spool.path / "results").rmdir()
    (spool.path / "results").symlink_to(mine)
    with pytest.raises(BakeError, match="results' is a link out of the spool: remove it"):
        run(spool.path, None, Console(quiet=True), Interrupts())
    assert list(mine.iterdir()) == []


RESULTS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "no pages": lambda it: it.update(pages=()),
    "too many pages": lambda it: it.update(pages=it["pages"] * 2),
    "pixels of text": lambda it: it.update(pages=("page",)),
    "gray pixels": lambda it: it.update(pages=(with_state(it["pages"][0], pixels=np.zeros((32, 32))),)),
    "coverage of others": lambda it: it.update(
        pages=(with_state(it["pages"][0], coverage=np.ones((1, 1), bool)),)
    ),
    "an object that is not there": lambda it: it.update(objects=[("Nobody", *it["objects"][0][1:])]),
    "another page": lambda it: it.update(objects=[(*it["objects"][0][:2], 7, 1.0, 1.0)]),
    "coordinates of others": lambda it: it.update(
        objects=[(it["objects"][0][0], np.zeros((1, 3, 2), np.float32), 0, 1.0, 1.0)]
    ),
    "a density of text": lambda it: it.update(objects=[(*it["objects"][0][:3], "fine", 1.0)]),
    "a group that nobody wanted": lambda it: it.update(groups=[("../../mine", it["pages"], ())]),
    "no solver": lambda it: it.update(solver={}),
    "a solver with arrays": lambda it: it["solver"].update(more=np.zeros(9)),
    "seconds of text": lambda it: it.update(seconds={"solve": "long"}),
    "warnings of text": lambda it: it.update(warnings=("text",)),
    "facts of other pages": lambda it: it.update(atlas=it["atlas"] * 3),
    "light of others": lambda it: it.update(light=({},)),
    "something missing": lambda it: it.pop("coincident"),
}


def test_results_that_no_bake_finds_are_refused(
    spool: Spool, inputs: BakeInputs, prepared: PreparedBake
) -> None:
    bake_prepared(spool, prepared.inputs, inputs, None)
    whole = result_in(spool, prepared)
    whole.result(inputs.bake_scene, SETTINGS)
    for what, change in RESULTS.items():
        stored = {**whole.fields, "solver": dict(whole.fields["solver"])}
        change(stored)
        tree = Writer(spool).tree({"mark": "", "sidecar": None, "result": stored})
        spool.point(f"results/{prepared.inputs}", put(spool, tree))
        is_whole = StoredResult.is_whole(Spool(spool.path), prepared.inputs, inputs.bake_scene, SETTINGS)
        assert not is_whole, what
    for mark, sidecar in (("../x", None), ("A" * 32, None), (3, None), ("", np.zeros(3)), ("", "text")):
        tree = Writer(spool).tree({"mark": mark, "sidecar": sidecar, "result": whole.fields})
        spool.point(f"results/{prepared.inputs}", put(spool, tree))
        with pytest.raises(BakeError, match="is damaged"):
            result_in(Spool(spool.path), prepared)


@pytest.mark.parametrize(
    ("source", "advice"),
    [
        ("/home/me/room.blend", "prepare and run it again"),
        (
            "/home/me/room.OBJ",
            "prepare and run it again, or if it was not changed, save it as a .blend first",
        ),
    ],
)
def test_another_scene_is_not_finished(
    source: str, advice: str, spool: Spool, inputs: BakeInputs, tmp_path: Path
) -> None:
    store_prepared(spool, inputs, PreparedBake("", SETTINGS, source=source))
    prepared = prepared_in(spool)
    bake_prepared(spool, prepared.inputs, inputs, None)
    stored = result_in(spool, prepared)
    other = plan_bake(room(ELSEWHERE), SETTINGS, None, None)
    message = rf"^the scene is not as it was prepared from '{source}' \(object 'Box' has moved.*\): {advice}$"
    with finishing(spool, prepared, stored, tmp_path) as baking, pytest.raises(BakeError, match=message):
        baking(other, None, None, SILENT)


def test_another_xatlas_is_refused(
    spool: Spool, prepared: PreparedBake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("radiosity_addon.farm.prepared.version_of", lambda _: "9.9")
    with pytest.raises(BakeError, match=r"was prepared with xatlas .*, here is 9\.9: .*use one version"):
        run(spool.path, None, Console(quiet=True), Interrupts())


def test_workers_wait_until_a_prepared_bake_is_run(
    spool: Spool, prepared: PreparedBake, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = 0

    def look(_: float) -> None:
        nonlocal looks
        looks += 1
        if looks == 3:
            Spool.to_bake(spool.path)

    monkeypatch.setattr("radiosity_addon.farm.worker.time.sleep", look)
    assert wait_for(spool.path, 60.0).path == spool.path
    assert looks == 3


def test_status_names_the_stage_and_the_open_tasks_which_one_command_does(
    spool: Spool, inputs: BakeInputs, prepared: PreparedBake, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*words: str) -> tuple[int, list[str]]:
        capsys.readouterr()
        code = run_command([*words, str(spool.path)])
        out, err = capsys.readouterr()
        return code, (out + err).splitlines()

    of = "scene 'Scene' of '/home/me/room.blend'"
    assert said("status") == (0, [f"prepared: {of}"])
    assert said("status", "--tasks") == (0, [])
    found: list[Any] = []
    put_call = Spool.put_call

    def look(self: Spool, text: str) -> str:
        digest = put_call(self, text)
        if not found:
            self.claim(digest, 0)
            found.append(said("status"))
            _, names = said("status", "--tasks")
            assert names[0] == f"{digest}-1"
            found.append(said("task", names[0]))
            assert self.done(digest) == {1}
            # One that somebody has begun is done all the same; none is done twice.
            assert said("task", f"{digest}-0") == (0, [])
            assert said("status", "--tasks") == (0, names[1:])
            for name in (names[0], f"{digest}-999", f"{'0' * 40}-0", "../../mine", f"{digest}--1", "½-¼"):
                code, (line,) = said("task", name)
                assert code == 1
                assert line.startswith("error: ")
                assert "has no open task" in line
        return digest

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Spool, "put_call", look)
        patch.setattr("radiosity_addon.farm.executor.FEWEST", 2)
        patch.setattr("radiosity_addon.farm.stages.other_baker", lambda _: ("elsewhere", "1"))
        settings = replace(SETTINGS, resolution=320)
        larger = replace(inputs, settings=settings)
        bake_prepared(Spool.to_bake(spool.path), prepared.inputs, larger, None)
    (code, (first, second, _)), (done, lines) = found
    assert (code, done, lines) == (0, 0, [])
    assert first == f"running: {of}"
    assert "0 of" in second
    assert said("status") == (0, [f"ready to finish: {of}"])
