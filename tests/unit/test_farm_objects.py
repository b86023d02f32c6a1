"""Kernels and what they read survive being stored; what is read can neither run nor reach anything else."""

from __future__ import annotations

import base64
import json
import math
import os
import socket
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
import pytest

from radiosity_addon.base import BakeError
from radiosity_addon.farm.identity import identity
from radiosity_addon.farm.objects import ObjectError, Reader, Writer, named
from radiosity_addon.farm.spool import Spool, array_digest, this_process
from radiosity_addon.farm.tasks import KERNELS, is_kernel
from radiosity_addon.lights import PointLight
from radiosity_addon.numerics import Scratch, points_at, thread_count
from radiosity_addon.rays import Hits
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.scene import Scene
from tests.rooms import colored_room


@pytest.fixture
def spool(tmp_path: Path) -> Spool:
    return Spool.to_bake(tmp_path / "spool")


def read_again(spool: Spool, value: Any) -> Any:
    """Return a value that was written, and read by another process."""
    tree = json.loads(json.dumps(Writer(spool).tree(value)))
    return Reader(Spool.to_work(spool.path)).value(tree)


@pytest.mark.parametrize(
    "value",
    [None, True, 3, -2.5, math.inf, "text", slice(2, 5), (1, [2.0, (3,)], {"a": 1, 2: None}), 10**30],
)
def test_plain_values_come_back(spool: Spool, value: Any) -> None:
    found = read_again(spool, value)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("count", [0, 1, 5, 5000])
@pytest.mark.parametrize("kind", [bool, np.int8, np.int32, np.int64, np.uint16, np.float16, "f4", float])
def test_arrays_come_back_bit_by_bit_and_cannot_be_written_to(spool: Spool, kind: Any, count: int) -> None:
    array = np.random.default_rng(1).integers(0, 2, (count, 3)).astype(kind)
    found = read_again(spool, array)
    assert found.dtype == array.dtype
    np.testing.assert_array_equal(found, array)
    assert not found.flags.writeable


@pytest.mark.parametrize("value", [np.float32(0.1), np.int16(-3), np.bool_(True), np.float64(1e300)])
def test_scalars_keep_their_type(spool: Spool, value: Any) -> None:
    found = read_again(spool, value)
    assert type(found) is type(value)
    assert found == value


def test_views_come_back_as_what_they_show(spool: Spool) -> None:
    array = np.arange(60_000.0).reshape(300, 200)
    for view in (array[::3, ::-1], array.T, np.broadcast_to(array[0], (50, 200)), array[:, 7]):
        np.testing.assert_array_equal(read_again(spool, view), view)


def test_functions_methods_and_objects_come_back(spool: Spool) -> None:
    scene = colored_room()
    light = PointLight((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), name="Bulb")
    found, bulb, again = read_again(spool, (partial(thread_count, 3), light, [light, light.shadow_rays]))
    assert found() == 3
    np.testing.assert_array_equal(bulb.strength, light.strength)
    # An object that is written twice is one object.
    assert again[0] is bulb
    assert again[1].__self__ is bulb
    copy = read_again(spool, scene)
    assert isinstance(copy, Scene)
    np.testing.assert_array_equal(copy.triangles, scene.triangles)
    np.testing.assert_array_equal(copy.areas, scene.areas)


def test_a_caster_that_was_stored_meets_the_same(spool: Spool) -> None:
    scene = colored_room()
    caster = EmbreeCaster(scene.triangles, two_sided=scene.two_sided)
    other = read_again(spool, caster)
    unit = np.random.default_rng(2)
    start = unit.random((500, 3)) * 0.8 + 0.1
    along = unit.normal(size=(500, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    one, two = caster.intersect(start, along), other.intersect(start, along)
    assert isinstance(two, Hits)
    np.testing.assert_array_equal(one.triangle, two.triangle)
    np.testing.assert_array_equal(one.distance, two.distance)
    assert other.rays == 500


def test_what_belongs_to_a_process_is_made_anew(spool: Spool) -> None:
    scratch = Scratch(123.0)
    scratch.free = lambda: 0.0
    found = read_again(spool, scratch)
    assert found.budget == math.inf
    assert found.room() == math.inf
    assert isinstance(read_again(spool, Lock()), type(Lock()))


class Stranger(NamedTuple):
    number: int


@pytest.mark.parametrize(
    "value",
    [Path("/tmp"), {1, 2}, np.array([None]), np.array(["text"]), Stranger(1), print, partial(open)],
)
def test_other_things_are_not_written(spool: Spool, value: Any) -> None:
    with pytest.raises(TypeError):
        Writer(spool).tree(value)


@pytest.mark.parametrize(
    "name",
    [
        "os:system",
        "..os:system",
        "numerics.os:system",
        "numerics.scratch:os.system",
        "numerics.scratch:tempfile",
        "numerics.scratch:Scratch.empty",
        "numerics:points_at",  # named where it is defined alone
        "base.errors:BakeError",
        "files.file_names:FileNames",
        "farm.spool:Spool",
        "blender.files.files:empty_scene",
        "publishing.publish:publish",
        "",
        "numerics",
        "numerics.parallel:",
    ],
)
def test_nothing_outside_the_array_rooms_can_be_named(name: str) -> None:
    with pytest.raises((ObjectError, ImportError)):
        named(name)
    with pytest.raises(ObjectError):
        Reader(None).value({"function": name})  # type: ignore[arg-type]


def test_what_is_defined_in_an_array_room_can() -> None:
    assert named(f"{points_at.__module__.partition('.')[2]}:points_at") is points_at


def test_every_kernel_exists() -> None:
    for name in KERNELS:
        assert is_kernel(named(name)), name
    assert not is_kernel(points_at)
    assert not is_kernel(print)


@pytest.mark.parametrize(
    "tree",
    [
        {"inline": ["<f8", [1 << 40], ""]},
        {"inline": ["<f8", [-1], ""]},
        {"inline": ["<f8", [2], base64.b64encode(bytes(8)).decode()]},
        {"inline": ["|O", [1], base64.b64encode(bytes(8)).decode()]},
        {"inline": ["<f8", [1], "?"]},
        {"array": "../../../etc/passwd"},
        {"array": "0" * 40},
        {"object": "/etc/passwd"},
        {"object": "0" * 40},
        {"method": ["text", "upper"]},
        {"method": [{"inline": ["<f8", [0], ""]}, "tofile"]},
        {"partial": [{"function": "os:system"}, {"tuple": ["true"]}, {"dict": []}]},
        {"unknown": 1},
        {"slice": [1, 2, 3, 4]},
        {"tuple": [1], "list": [2]},
        [1, 2],
        {},
    ],
)
def test_hostile_trees_are_refused(spool: Spool, tree: Any) -> None:
    with pytest.raises(ObjectError):
        Reader(spool).value(tree)


def test_trees_that_are_too_deep_are_refused(spool: Spool) -> None:
    tree: Any = 1
    for _ in range(100_000):
        tree = {"list": [tree]}
    with pytest.raises(ObjectError):
        Reader(spool).value(tree)


@pytest.mark.parametrize("change", ["truncated", "flipped", "missing", "other"])
def test_damaged_arrays_and_objects_are_found_and_written_again(spool: Spool, change: str) -> None:
    array = np.arange(5000.0)
    light = PointLight((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    value = (array, light)
    tree = Writer(spool).tree(value)
    for path in (*spool.path.glob("arrays/*"), *spool.path.glob("objects/*")):
        content = bytearray(path.read_bytes())
        if change == "truncated":
            path.write_bytes(content[:-3])
        elif change == "flipped":
            content[-5] ^= 1
            path.write_bytes(content)
        elif change == "other":
            path.write_bytes(b"")
        else:
            path.unlink()
    reader = Spool.to_work(spool.path)
    for part in tree["tuple"]:
        with pytest.raises(ObjectError):
            Reader(reader).value(part)
    assert Writer(Spool.to_bake(spool.path)).tree(value) == tree
    np.testing.assert_array_equal(Reader(Spool.to_work(spool.path)).value(tree)[0], array)


def test_an_array_that_claims_to_be_larger_than_its_file_is_refused(spool: Spool) -> None:
    array = np.arange(5000.0)
    digest = spool.put_array(array)
    path = spool.path / "arrays" / f"{digest}.npy"
    path.write_bytes(path.read_bytes().replace(b"(5000,)", b"(9**9,)"))
    with pytest.raises(ObjectError):
        Spool.to_work(spool.path).array(digest)


def test_digests_tell_types_and_shapes_apart() -> None:
    zeros = [np.zeros(6), np.zeros((2, 3)), np.zeros((3, 2)), np.zeros(6, np.int64), np.zeros(12, np.float32)]
    assert len({array_digest(array) for array in zeros}) == len(zeros)


def test_a_folder_of_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(BakeError, match="is not empty and no spool"):
        Spool.to_bake(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
    with pytest.raises(BakeError, match="is no spool"):
        Spool.to_work(tmp_path)


@pytest.mark.parametrize("name", sorted(identity()))
def test_another_program_is_refused_by_what_differs(spool: Spool, name: str) -> None:
    record = json.loads((spool.path / "spool.json").read_text())
    record["program"][name] = "other"
    (spool.path / "spool.json").write_text(json.dumps(record))
    for make in (Spool.to_work, Spool.to_bake):
        with pytest.raises(BakeError, match=f"of another {name}"):
            make(spool.path)


def test_a_spool_belongs_to_one_bake(spool: Spool) -> None:
    sign = spool.path / "baking"
    assert sign.read_text() == this_process()
    host = socket.gethostname()
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        sign.write_text(f"{host} {other.pid}")
        with pytest.raises(BakeError, match=f"is used by process {other.pid} on {host}"):
            Spool.to_bake(spool.path)
    # Gone now.
    Spool.to_bake(spool.path)
    sign.write_text("elsewhere 1")
    with pytest.raises(BakeError, match="is used by process 1 on elsewhere"):
        Spool.to_bake(spool.path)
    os.utime(sign, (time.time() - 100,) * 2)
    Spool.to_bake(spool.path)
    assert sign.read_text() == this_process()


def test_what_others_put_into_a_spool_stays(spool: Spool) -> None:
    digest = spool.put_call("{}")
    spool.put_array(np.arange(5000.0))
    names = ["mine.txt", "arrays/mine.npy", "calls/mine/call.json", f"calls/{digest}/notes.txt"]
    for name in names:
        (spool.path / name).parent.mkdir(exist_ok=True)
        (spool.path / name).write_text("mine")
    spool.end()
    left = [path.relative_to(spool.path).as_posix() for path in spool.path.rglob("*") if path.is_file()]
    assert sorted(left) == sorted([*names, "over", "spool.json"])
