"""No step of an export holds the window up for long, but for what Blender does in one piece."""

from __future__ import annotations

import time
from collections.abc import Iterator

import bpy
import numpy as np
import pytest

from radiosity_addon.base.steps import drain
from radiosity_addon.blender.apply import rebake, sweep
from radiosity_addon.blender.cycles import surface_bake, surface_batches, world_pixels
from radiosity_addon.blender.datablocks.bake_record import is_made
from radiosity_addon.blender.scene_export import collect as collecting
from radiosity_addon.blender.scene_export.export import export_scene, export_steps
from radiosity_addon.blender.scene_records.export_sources import Export
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.hand_bake import bake_by_hand
from tests.blender.scenes import add_lamp

LONGEST = 0.1
"""Seconds of processor time of a step; about half of it where this was written."""


def many_objects(count: int = 300, materials: int = 60, textured: int = 0) -> None:
    made = []
    for number in range(materials):
        material = bpy.data.materials.new(f"Paint {number}")
        if bpy.app.version < (5, 0):
            material.use_nodes = True
        shader = material.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (0.1 + 0.8 * number / materials, 0.5, 0.3, 1.0)
        if number < textured:
            checker = material.node_tree.nodes.new("ShaderNodeTexChecker")
            material.node_tree.links.new(checker.outputs[0], shader.inputs["Base Color"])
        made.append(material)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    first = bpy.context.object
    for number in range(count):
        mesh = first.data.copy()
        mesh.materials.append(made[number % materials])
        obj = bpy.data.objects.new(f"Ball {number}", mesh)
        obj.location = (2.2 * (number % 20), 2.2 * (number // 20), 1.0)
        bpy.context.scene.collection.objects.link(obj)
    bpy.data.objects.remove(first)
    add_lamp("SUN", "Sun", energy=3.0)
    bpy.context.view_layer.update()


class Timed:
    """Processor time that a function of Blender's took, so that it can be told from ours."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def wrap(self, function):
        def timed(*args, **more):
            start = time.thread_time()
            try:
                return function(*args, **more)
            finally:
                self.seconds += time.thread_time() - start

        return timed


@pytest.fixture
def of_blender(monkeypatch: pytest.MonkeyPatch) -> Iterator[Timed]:
    """Takes the time of calls that cannot be divided: those that docs/main-thread.md lists."""
    timed = Timed()
    monkeypatch.setattr(surface_bake, "bake_emission", timed.wrap(surface_bake.bake_emission))
    monkeypatch.setattr(world_pixels, "look_around", timed.wrap(world_pixels.look_around))
    return timed


def _times_of_steps(of_blender: Timed) -> tuple[list[float], Export]:
    steps = export_steps(bpy.context, BakeSettings(resolution=128), in_background=True)
    taken = []
    while True:
        start, of_blender.seconds = time.thread_time(), 0.0
        try:
            next(steps)
        except StopIteration as done:
            return taken, done.value
        finally:
            taken.append(time.thread_time() - start - of_blender.seconds)


@pytest.mark.parametrize("textured", [0, 20, 60])
def test_no_step_of_an_export_of_300_objects_takes_long(textured: int, of_blender: Timed) -> None:
    """Other processes slow single steps, also in processor time: a long one is long every time."""
    many_objects(textured=textured)
    for _ in range(3):
        taken, export = _times_of_steps(of_blender)
        if max(taken) < LONGEST:
            break
    assert len(export.sources) == 300
    assert max(taken) < LONGEST, [round(each, 3) for each in sorted(taken)[-8:]]


def test_moments_change_nothing_of_what_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """However often the scene is looked at, the arrays are the same, in the same order."""
    many_objects(40, 7, 3)
    at_once = export_scene(bpy.context, BakeSettings(resolution=64))
    monkeypatch.setattr(collecting, "MOMENT", 0.0)
    looked = 0
    steps = export_steps(bpy.context, BakeSettings(resolution=64), in_background=True)
    while True:
        try:
            next(steps)
        except StopIteration as done:
            in_steps = done.value
            break
        looked += 1
    assert looked > 40
    assert in_steps.sources == at_once.sources
    one, other = at_once.bake_scene, in_steps.bake_scene
    for name in ("triangles", "reflectance", "emission", "normals", "opacity"):
        assert np.array_equal(getattr(one.scene, name), getattr(other.scene, name)), name
    assert np.array_equal(one.scene.images.values, other.scene.images.values)
    assert one.warnings == other.warnings
    assert np.array_equal(one.emitter, other.emitter)


@pytest.mark.usefixtures("record")
def test_edits_since_a_bake_are_carried_once_and_read_in_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looking for edits takes 160 ms where 300 objects share a mesh."""
    many_objects(12, 3)
    bake_by_hand()
    carried: list[bpy.types.Context] = []
    carry = rebake.carry_edits
    monkeypatch.setattr(rebake, "carry_edits", lambda context: (carried.append(context), carry(context))[1])
    monkeypatch.setattr(collecting, "MOMENT", 0.0)
    for material in bpy.data.materials:
        if is_made(material):
            material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (
                0.1,
                0.9,
                0.1,
                1,
            )
    export = drain(
        export_steps(bpy.context, BakeSettings(resolution=64), shown=rebake.Originals(bpy.context))
    )
    assert len(carried) == 1
    green = export.bake_scene.scene.reflectance
    assert (green[:, 1] > 2 * green[:, 0]).all()


@pytest.mark.usefixtures("record")
def test_stand_ins_of_an_earlier_bake_are_removed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """One by one, the meshes of 300 objects that share one took 0.9 s."""
    many_objects(12, 3)
    shared = bpy.data.objects["Ball 0"].data
    for number in range(1, 12):
        bpy.data.objects[f"Ball {number}"].data = shared
    bake_by_hand()
    meshes: list[int] = []
    remove = sweep.remove_datablocks

    def counted(blocks: list[bpy.types.ID]) -> None:
        meshes.append(sum(isinstance(block, bpy.types.Mesh) for block in blocks))
        remove(blocks)

    monkeypatch.setattr(sweep, "remove_datablocks", counted)
    bake_by_hand()
    assert sorted(meshes)[-2:] == [0, 12]
    assert sum(is_made(mesh) for mesh in bpy.data.meshes) == 12


def test_batches_of_materials_change_nothing_of_what_is_evaluated(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many materials and texels a batch has, each texel is as if all were evaluated at once."""
    many_objects(12, 6, 6)
    for limit in ("MAX_NODES", "MAX_TEXELS"):
        monkeypatch.setattr(surface_batches, limit, 10**9)
    at_once = export_scene(bpy.context, BakeSettings(resolution=64))
    baked: list[int] = []
    bake = surface_bake.bake_emission
    monkeypatch.setattr(surface_bake, "bake_emission", lambda: (baked.append(1), bake())[1])
    for limit, value, least in (("MAX_NODES", 1, 6), ("MAX_TEXELS", 5000, 12)):
        with monkeypatch.context() as patch:
            patch.setattr(surface_batches, limit, value)
            baked.clear()
            in_batches = export_scene(bpy.context, BakeSettings(resolution=64))
        assert len(baked) >= least, limit
        one, other = at_once.bake_scene.scene.images, in_batches.bake_scene.scene.images
        assert np.array_equal(one.image_uv, other.image_uv)
        # A checker's edge may fall between a texel's two roundings.
        differs = np.abs(one.values - other.values).max(axis=2) > 1e-5
        assert differs.mean() < 1e-3, limit
        assert np.ptp(one.values[..., :3]) > 0.1  # there is something to tell apart


def test_means_of_images_are_computed_outside_of_the_moment() -> None:
    many_objects(4, 2)
    image = bpy.data.images.new("Picture", 64, 64)
    image.pixels.foreach_set(np.tile(np.array([0.5, 0.25, 1.0, 1.0], dtype=np.float32), 64 * 64))
    tree = bpy.data.materials["Paint 0"].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])
    steps = export_steps(bpy.context, BakeSettings(resolution=64))
    next(steps)
    bpy.data.images.remove(image)  # between two steps
    export = drain(steps)
    assert len(export.sources) == 4


def test_a_sky_is_rendered_without_an_importance_map(monkeypatch: pytest.MonkeyPatch) -> None:
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    tree = world.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], tree.nodes["Background"].inputs["Color"])
    bpy.context.scene.world = world
    many_objects(2, 1)
    methods = []
    render = world_pixels.look_around

    def noted(scene, *args):
        methods.append(scene.world.cycles.sampling_method)
        return render(scene, *args)

    monkeypatch.setattr(world_pixels, "look_around", noted)
    steps = export_steps(bpy.context, BakeSettings(resolution=16))
    most, before = 0, 0
    for _ in steps:
        most, before = max(most, len(methods) - before), len(methods)
    assert set(methods) == {"NONE"}
    assert most == 1  # a render a step
    assert world.cycles.sampling_method != "NONE"
