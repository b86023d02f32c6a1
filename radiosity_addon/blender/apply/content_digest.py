"""A digest of all that a file's scenes are made of, by which a file is known in which nothing was edited.

It is of what users edit, not of what Blender evaluates of that. If it is the same, nothing has changed that a
bake reads; if it is not, something may have: renaming a collection changes it too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import bpy

from ..datablocks.bake_record import is_made
from ..datablocks.plain_values import StructReader, custom_properties, plain
from ..material_copies.copy_marks import is_copied_group
from ..material_copies.material_digest import animation_of, digest_of_material, tree_digest
from ..stand_ins.mesh_digest import attribute_bytes, digest_of_mesh

OURS = "radiosity"
"""What the names of our custom properties begin with."""

_KINDS = (
    *("objects", "collections", "lights", "worlds", "curves", "metaballs", "armatures", "lattices"),
    *("particles", "textures", "volumes", "cache_files", "hair_curves", "pointclouds"),
)
"""The collections of `bpy.data` that are read property by property."""

_EVALUATED = frozenset(
    (
        "bound_box", "dimensions", "matrix_world", "matrix_local", "matrix_basis", "motion_path",
        "point_cache", "point_caches", "particles", "child_particles", "node_warnings", "is_evaluated",
        "is_runtime_data", "all_objects", "original", "properties",
    )
)  # fmt: skip
"""Properties that follow from others, or that Blender fills in."""

_OTHERWISE = frozenset(
    (
        "name", "tag", "use_fake_user", "use_extra_user", "preview", "asset_data", "animation_data",
        "library_weak_reference", "override_library", "grease_pencil", "lineart", "node_tree", "pose",
        "bones", "shape_keys", "attributes", "color_attributes", "points", "position_data",
        "curve_offset_data", "surface_normals", "mode", "collections", "collections_all", "radiosity_bake",
        *(("use_nodes",) if bpy.app.version >= (5, 0) else ()),
    )
)  # fmt: skip
"""Properties of datablocks that do not count, or are read in another way."""

_DATABLOCK = _EVALUATED | _OTHERWISE
_POSE = _DATABLOCK | {"bone", "parent", "child"}
_STRUCTS = StructReader(
    _EVALUATED | {"parent", "child", "children_recursive", "bone", "node_tree"},
    ("active_", "bl_", "is_property_", "select"),
)


_UNREADABLE = (AttributeError, KeyError, RecursionError, RuntimeError, TypeError, ValueError)
"""What structs of a later Blender, or of an add-on, may raise: no bake fails for them."""


def content_digest() -> str | None:
    """Return the digest of the open file, also of what it links; None where it cannot be known.

    Images count by their files' sizes and times: those that were painted and not saved cannot be known.
    """
    if any(image.is_dirty and not is_made(image) for image in _used("images")):
        return None
    found = hashlib.blake2b(digest_size=16)
    try:
        for text in _contents():
            found.update(text.encode("utf-8", "surrogatepass"))
    except _UNREADABLE:
        return None
    return found.hexdigest()


def _contents() -> Iterator[str]:
    for scene in bpy.data.scenes:
        yield repr((scene.name_full, _scene(scene)))
    for kind in _KINDS:
        for block in _used(kind):
            yield repr((block.name_full, _datablock(block)))
    for mesh in _used("meshes"):
        rendered = [layer.name for layer in mesh.uv_layers if layer.active_render]
        rendered.append(str(mesh.color_attributes.render_color_index))
        driven = None if mesh.shape_keys is None else _driven(mesh.shape_keys)
        yield f"{mesh.name_full} {digest_of_mesh(mesh)} {plain(mesh.materials)} {rendered} {driven}"
    for material in _used("materials"):
        driven = None if material.node_tree is None else _driven(material.node_tree)
        yield f"{material.name_full} {digest_of_material(material)} {_driven(material)} {driven}"
    for tree in _used("node_groups"):
        if not is_made(tree) or is_copied_group(tree):
            yield f"{tree.name_full} {tree_digest(tree)} {_driven(tree)}"
    for image in _used("images"):
        if not is_made(image):
            yield repr((image.name_full, _image(image)))


def _used(kind: str) -> list[Any]:
    """Return the datablocks of a kind; without those that nothing uses, which saving leaves out."""
    return [block for block in getattr(bpy.data, kind) if block.users]


def _datablock(block: bpy.types.ID) -> list[Any]:
    own = [name for name in block.keys() if name.startswith(OURS)]  # noqa: SIM118 - an ID
    found: list[Any] = [_STRUCTS.read(block, _DATABLOCK), custom_properties(block, own)]
    if getattr(block, "animation_data", None) is not None:
        found.append(animation_of(block))
    tree = getattr(block, "node_tree", None)
    if tree is not None:
        found += [tree_digest(tree), _driven(tree)]
    if isinstance(block, bpy.types.Object):
        found += [_inputs_of_nodes(each) for each in block.modifiers if each.type == "NODES"]
        if block.pose is not None:
            found += [[_STRUCTS.read(bone, _POSE), custom_properties(bone, ())] for bone in block.pose.bones]
    if isinstance(block, bpy.types.Armature):
        found += [(bone.name, plain(bone.matrix_local), bone.length) for bone in block.bones]
    if isinstance(block, bpy.types.Lattice):
        found += [plain(point.co_deform) for point in block.points]
    keys = getattr(block, "shape_keys", None)
    if keys is not None:
        found += [_STRUCTS.read(keys, _DATABLOCK), animation_of(keys)]
    for attribute in getattr(block, "attributes", ()):
        found.append((attribute.name, hashlib.sha256(attribute_bytes(attribute)).hexdigest()))
    return found


def _driven(owner: bpy.types.ID) -> list[Any]:
    """Return the values that drivers have set, which digests of materials and shape keys leave out.

    A driver may read what no digest holds, such as a property of the scene. Keyed values need no such list:
    they follow from the frame.
    """
    data = owner.animation_data
    found = []
    for curve in () if data is None else data.drivers:
        try:
            found.append((curve.data_path, plain(owner.path_resolve(curve.data_path))))
        except ValueError:  # it drives nothing
            continue
    return found


def _inputs_of_nodes(modifier: bpy.types.NodesModifier) -> list[Any]:
    """Return what the inputs of Geometry Nodes are set to."""
    if bpy.app.version < (5, 2):  # a file that is opened again has 0 for False
        values = custom_properties(modifier, ())
        return [(name, int(value) if isinstance(value, bool) else value) for name, value in values]
    inputs = modifier.properties.inputs
    names = [prop.identifier for prop in inputs.bl_rna.properties if prop.type == "POINTER"]
    given = [(name, getattr(inputs, name)) for name in names if name != "rna_type"]
    return [(name, [plain(getattr(each, key)) for key in _own_names(each)]) for name, each in given]


def _own_names(struct: bpy.types.bpy_struct) -> list[str]:
    """Return the names of the properties of a struct whose type is its own."""
    return [prop.identifier for prop in struct.bl_rna.properties if prop.identifier != "rna_type"]


def _scene(scene: bpy.types.Scene) -> list[Any]:
    """Return what of a scene a bake reads."""
    layers = [
        (
            layer.name,
            layer.use,
            layer.use_sky,
            plain(layer.material_override),
            plain(getattr(layer, "world_override", None)),
            _STRUCTS.read(layer.layer_collection, _EVALUATED),
            [each.name for each in layer.lightgroups],
            custom_properties(layer, ()),  # Attribute nodes read them, and those of the scene
        )
        for layer in scene.view_layers
    ]
    render = scene.render
    simplified = (
        render.use_simplify,
        render.simplify_subdivision_render,
        render.simplify_child_particles_render,
    )
    return [
        (scene.frame_current, scene.frame_subframe, scene.unit_settings.scale_length),
        *(plain(each) for each in (scene.world, scene.camera, scene.background_set)),
        simplified,
        render.film_transparent,
        custom_properties(scene, [name for name in scene.keys() if name.startswith(OURS)]),  # noqa: SIM118
        layers,
        _datablock(scene.collection),
        _STRUCTS.read(scene.cycles, frozenset()) if hasattr(scene, "cycles") else None,
    ]


def _image(image: bpy.types.Image) -> list[Any]:
    settings = (image.source, image.alpha_mode, image.colorspace_settings.name, plain(image.size))
    return [settings, [*_files(image)]]


def _files(image: bpy.types.Image) -> Iterable[Any]:
    """Yield what an image's pixels are read from."""
    for packed in image.packed_files:
        yield hashlib.sha256(packed.packed_file.data).hexdigest()
    if image.source == "GENERATED":
        yield (
            image.generated_type,
            plain(image.generated_color),
            image.generated_width,
            image.generated_height,
        )
    elif not image.packed_files and image.filepath:
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        several = image.source in {"TILED", "SEQUENCE"}
        try:
            files = sorted(path.parent.glob(f"*{path.suffix}")) if several else [path]
            for file in files:
                status = file.stat()
                yield status.st_size, status.st_mtime_ns
        except OSError:
            yield "missing"
