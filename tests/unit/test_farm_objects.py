"""Kernels and what they read survive being stored; what is read can neither run nor reach anything else."""

from __future__ import annotations

import base64
import json
import math
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
import pytest

from radiosity_addon.farm.objects import ObjectError, Reader, Writer, array_digest, digest_of, name_of, named
from radiosity_addon.farm.spool import Spool
from radiosity_addon.farm.tasks import KERNELS, is_kernel
from radiosity_addon.lights import PointLight
from radiosity_addon.numerics import Scratch, points_at, thread_count
from radiosity_addon.rays import Hits, counted_apart
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


def test_rays_of_a_copy_can_be_counted_where_the_caster_is(spool: Spool) -> None:
    scene = colored_room()
    caster = EmbreeCaster(scene.triangles)
    writer = Writer(spool)
    copy = Reader(Spool.to_work(spool.path)).value(writer.tree(caster))
    middle, up = np.full((7, 3), 0.5), np.tile((0.0, 0.0, 1.0), (7, 1))
    caster.intersect(middle, up)
    with counted_apart() as rays:
        copy.intersect(middle, up)
        copy.unoccluded(middle[:2], up[:2], np.ones(2))
    assert (copy.rays, caster.rays) == (0, 7)
    ((name, count),) = rays.items()
    assert count == 9
    writer.ray_counts[name].add(count)
    assert caster.rays == 16
    copy.intersect(middle, up)
    assert copy.rays == 7


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
        "lightmap.charts.xatlas_worker:start_process",
        "lightmap.charts.xatlas_worker:XatlasProcess",
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


@pytest.mark.parametrize("name", ["shadow_rays", "__class__", "__dict__"])
def test_states_that_replace_methods_are_refused(spool: Spool, name: str) -> None:
    """Kernels call methods of what they are given: these must be the class's own."""
    state = {"dict": [[name, {"function": name_of(thread_count)}]]}
    text = json.dumps([name_of(PointLight), state])
    spool.put_object(digest_of(text), text)
    with pytest.raises(ObjectError, match=f"with another '{name}'"):
        Reader(spool).value({"object": digest_of(text)})


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
