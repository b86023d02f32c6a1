"""Flipping polygons of a mesh changes which way they face, and nothing else."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.datablocks.face_winding import flip_polygons, select_polygons, shape_digest
from radiosity_addon.blender.stand_ins.mesh_digest import digest_of_mesh

SOME = [0, 1, 2, 5, 11, 30]


def full_mesh() -> bpy.types.Mesh:
    """A smooth ball with all that a mesh may have."""
    rng = np.random.default_rng(7)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    obj = bpy.context.object
    mesh = obj.data
    mesh.shade_smooth()
    for name in ("Other UVs", "Third UVs"):
        mesh.uv_layers.new(name=name).data.foreach_set("uv", rng.random(2 * len(mesh.loops)))
    mesh.uv_layers.active_index = 1
    mesh.uv_layers["Third UVs"].active_render = True
    for name, domain in (("Corner Colors", "CORNER"), ("Point Colors", "POINT")):
        colors = mesh.color_attributes.new(name, "FLOAT_COLOR", domain)
        colors.data.foreach_set("color", rng.random(4 * len(colors.data)))
    mesh.attributes.new("Numbers", "INT", "FACE").data.foreach_set("value", np.arange(len(mesh.polygons)))
    for number in range(4):
        mesh.materials.append(bpy.data.materials.new(f"Slot {number}"))
    mesh.polygons.foreach_set("material_index", np.arange(len(mesh.polygons), dtype=np.int32) % 4)
    mesh.edges[3].use_seam = mesh.edges[5].use_edge_sharp = True
    mesh.polygons[4].use_smooth = False
    mesh["own"] = 3
    obj.vertex_groups.new(name="Group").add([1, 2, 3], 0.5, "REPLACE")
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Up").data[0].co.z += 1.0
    obj.data.shape_keys.key_blocks["Up"].value = 0.25
    return mesh


def corners(mesh: bpy.types.Mesh, values: np.ndarray) -> list[dict[int, tuple[float, ...]]]:
    """Return what the corners of each polygon have, by their vertices."""
    return [
        {
            mesh.loops[loop].vertex_index: tuple(np.round(values[loop], 3).tolist())
            for loop in polygon.loop_indices
        }
        for polygon in mesh.polygons
    ]


def layers(mesh: bpy.types.Mesh) -> dict[str, list[dict[int, tuple[float, ...]]]]:
    """Return the UVs and colors of all corners."""
    found = {}
    for layer in mesh.uv_layers:
        values = np.empty((len(mesh.loops), 2), np.float32)
        layer.data.foreach_get("uv", values.reshape(-1))
        found[layer.name] = corners(mesh, values)
    values = np.empty((len(mesh.loops), 4), np.float32)
    mesh.color_attributes["Corner Colors"].data.foreach_get("color", values.reshape(-1))
    found["Corner Colors"] = corners(mesh, values)
    return found


def normals(mesh: bpy.types.Mesh) -> np.ndarray:
    found = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", found.reshape(-1))
    return found


def signed(mesh: bpy.types.Mesh, flipped: list[int]) -> list[dict[int, tuple[float, ...]]]:
    """Return the normals of all corners, those of some polygons reversed."""
    sign = np.ones((len(mesh.loops), 1))
    for number in flipped:
        sign[list(mesh.polygons[number].loop_indices)] = -1.0
    return corners(mesh, sign * normals(mesh))


def test_chosen_polygons_face_the_other_way_and_nothing_else_changes() -> None:
    mesh = full_mesh()
    digest, winding, before = digest_of_mesh(mesh), shape_digest(mesh), layers(mesh)
    faces = np.array([polygon.normal for polygon in mesh.polygons])
    order = [tuple(polygon.vertices) for polygon in mesh.polygons]
    active = mesh.uv_layers.active.name, [layer.active_render for layer in mesh.uv_layers]
    flip_polygons(mesh, SOME)
    sign = np.ones((len(faces), 1))
    sign[SOME] = -1.0
    np.testing.assert_allclose([polygon.normal for polygon in mesh.polygons], sign * faces, atol=1e-6)
    assert [
        tuple(p.vertices) == (v if p.index not in SOME else (v[0], *v[:0:-1]))
        for p, v in zip(mesh.polygons, order, strict=True)
    ] == [True] * len(order)
    assert layers(mesh) == before
    assert (mesh.uv_layers.active.name, [layer.active_render for layer in mesh.uv_layers]) == active
    assert shape_digest(mesh) != winding
    assert not mesh.validate()
    # All that can be edited of a mesh is in its digest.
    flip_polygons(mesh, SOME)
    assert (digest_of_mesh(mesh), shape_digest(mesh)) == (digest, winding)


@pytest.mark.parametrize("flipped", [SOME, list(range(40))])
def test_custom_normals_are_reversed_along_and_others_stay(flipped: list[int]) -> None:
    mesh = full_mesh()
    rng = np.random.default_rng(3)
    tilted = np.array([vertex.normal for vertex in mesh.vertices]) + 0.3 * rng.normal(
        size=(len(mesh.vertices), 3)
    )
    mesh.normals_split_custom_set_from_vertices(tilted / np.linalg.norm(tilted, axis=1)[:, None])
    sharp = [edge.use_edge_sharp for edge in mesh.edges]
    before = signed(mesh, flipped)
    flip_polygons(mesh, flipped)
    after = corners(mesh, normals(mesh))
    for one, other in zip(before, after, strict=True):
        assert one.keys() == other.keys()
        np.testing.assert_allclose([one[key] for key in one], [other[key] for key in one], atol=3e-3)
    assert [edge.use_edge_sharp for edge in mesh.edges] == sharp


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="free normals came with Blender 4.5")
@pytest.mark.parametrize("domain", ["CORNER", "FACE"])
def test_free_normals_are_reversed_along(domain: str) -> None:
    mesh = full_mesh()
    attribute = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", domain)
    vectors = np.random.default_rng(3).normal(size=(len(attribute.data), 3))
    attribute.data.foreach_set("vector", (vectors / np.linalg.norm(vectors, axis=1)[:, None]).reshape(-1))
    mesh.update()
    before = signed(mesh, SOME)
    flip_polygons(mesh, SOME)
    for one, other in zip(before, corners(mesh, normals(mesh)), strict=True):
        np.testing.assert_allclose([one[key] for key in one], [other[key] for key in one], atol=2e-3)


def test_selecting_polygons_selects_nothing_else() -> None:
    mesh = full_mesh()
    assert all(edge.select for edge in mesh.edges)
    digest = digest_of_mesh(mesh)
    select_polygons(mesh, SOME)
    assert digest_of_mesh(mesh) == digest
    assert [polygon.index for polygon in mesh.polygons if polygon.select] == SOME
    vertices = {vertex for number in SOME for vertex in mesh.polygons[number].vertices}
    assert {vertex.index for vertex in mesh.vertices if vertex.select} == vertices
    edges = {key for number in SOME for key in mesh.polygons[number].edge_keys}
    assert {edge.key for edge in mesh.edges if edge.select} == edges
