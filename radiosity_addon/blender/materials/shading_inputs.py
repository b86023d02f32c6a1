"""What shader nodes ask of the mesh and object they are rendered on, as values at corners.

Materials are evaluated on one mesh that holds triangles of many objects. What a node would ask
its own object for (UV maps, vertex colors, generated and object coordinates, Object Info) is
therefore read beforehand, and Attribute nodes give it back.

An *input* is named by a string such as "uv", "uv:Bricks" or "generated".
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy
import numpy as np

ObjectValues = dict[str, np.ndarray]
MeshValues = dict[str, np.ndarray]

_GENERATED_TEXTURES = frozenset(
    f"TEX_{kind}"
    for kind in (
        "BRICK", "CHECKER", "GABOR", "GRADIENT", "MAGIC", "MUSGRAVE", "NOISE", "SKY", "VORONOI", "WAVE",
    )
)  # fmt: skip
"""Textures that take generated coordinates where nothing feeds their Vector."""

LIGHT_PATHS = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0}
"""What a Light Path node says of the rays a lightmap is made of, diffuse bounces; all else is 0 of them."""

_VIEW_DEPENDENT = {
    "FRESNEL": "seen straight on",
    "LAYER_WEIGHT": "seen straight on",
    "CAMERA": "not as the camera sees it",
    "WIREFRAME": "by triangles",
    "AMBIENT_OCCLUSION": "as of the surface alone",
    "BEVEL": "without its bevel",
    "HAIR_INFO": "without hair",
    "PARTICLE_INFO": "without particles",
    "POINT_INFO": "without points",
    "SCRIPT": "without its script",
    "TANGENT": "with tangents of triangles",
    "VECT_TRANSFORM": "as if the object stood at the origin",
}
_OUTPUTS_ASKED_IN_VAIN = {
    "TEX_COORD": ("Camera", "Window", "Reflection"),
    "NEW_GEOMETRY": ("Tangent", "Incoming", "Pointiness", "Random Per Island", "Backfacing"),
    "LIGHT_PATH": ("Ray Length", "Ray Depth", "Diffuse Depth", "Glossy Depth", "Transparent Depth"),
}


def asked_by_outputs(node: bpy.types.Node) -> dict[str, tuple[str, str]]:
    """Return the inputs behind a node's outputs.

    Returns
    -------
    dict
        By the output's identifier: the input's name, and the output of an Attribute node
        that gives it.
    """
    if node.type == "TEX_COORD":
        names = {
            "Generated": ("generated", "Vector"),
            "Normal": ("normal", "Vector"),
            "UV": ("uv", "Vector"),
        }
        if node.object is None:
            names["Object"] = ("object", "Vector")
        return names
    if node.type == "UVMAP":
        return {"UV": (_named("uv", node.uv_map), "Vector")}
    if node.type == "VERTEX_COLOR":
        name = _named("color", node.layer_name)
        return {output: (name, output) for output in ("Color", "Alpha")}
    if node.type == "ATTRIBUTE" and node.attribute_type in ("GEOMETRY", "OBJECT", "INSTANCER"):
        kind = "attribute" if node.attribute_type == "GEOMETRY" else "property"
        name = f"{kind}:{node.attribute_name}"
        return {output: (name, output) for output in ("Color", "Vector", "Fac", "Alpha")}
    if node.type == "OBJECT_INFO":
        return {
            "Location": ("location", "Vector"),
            "Color": ("object color", "Color"),
            "Alpha": ("object color", "Alpha"),
            "Object Index": ("object index", "Fac"),
            "Random": ("random", "Fac"),
        }
    if node.type == "NEW_GEOMETRY":
        return {"Normal": ("world normal", "Vector")}
    return {}


def asked_by_default(node: bpy.types.Node) -> str | None:
    """Return the input a texture takes where nothing feeds its Vector; None for other nodes."""
    vector = node.inputs.get("Vector")
    if vector is None or vector.is_linked:
        return None
    if node.type == "TEX_IMAGE":
        return "generated" if node.projection in ("SPHERE", "TUBE") else "uv"
    return "generated" if node.type in _GENERATED_TEXTURES else None


def asked_by_material(tree: bpy.types.NodeTree) -> frozenset[str]:
    """Return the inputs that a material's nodes ask for, groups included."""
    names = set()
    for node in _all_nodes(tree):
        for identifier, (name, _) in asked_by_outputs(node).items():
            if node.outputs[identifier].is_linked:
                names.add(name)
        default = asked_by_default(node)
        if default is not None:
            names.add(default)
    return frozenset(names)


def unreliable_nodes(tree: bpy.types.NodeTree) -> list[str]:
    """Say which of a material's nodes cannot be evaluated as a render would."""
    said = []
    for node in _all_nodes(tree):
        if node.type in _VIEW_DEPENDENT and any(output.is_linked for output in node.outputs):
            said.append(f"node '{node.bl_label}' is evaluated {_VIEW_DEPENDENT[node.type]}")
        for name in _OUTPUTS_ASKED_IN_VAIN.get(node.type, ()):
            output = node.outputs.get(name)
            if output is not None and output.is_linked:
                said.append(f"{node.bl_label} '{name}' cannot be evaluated for lightmaps")
        if node.type == "TEX_IMAGE" and node.projection == "BOX":
            said.append("box projection is evaluated along the world's axes, with flat faces")
        if node.type == "TEX_IMAGE" and (node.image is None or 0 in node.image.size):
            said.append("an image texture has no pixels (is its file missing?)")
    return list(dict.fromkeys(said))


def eevee_only(tree: bpy.types.NodeTree) -> list[str]:
    """Say which of a material's nodes Cycles does not know; what they feed counts as not linked there."""
    nodes = (node for node in _all_nodes(tree) if node.type == "SHADERTORGB")
    linked = {node.bl_label for node in nodes if any(output.is_linked for output in node.outputs)}
    return [
        f"node '{label}' is for EEVEE only: as in Cycles, the socket it feeds keeps its own value"
        for label in linked
    ]


def asks_light_path(tree: bpy.types.NodeTree, names: tuple[str, ...]) -> bool:
    """Return whether one of these outputs of a Light Path node is linked in a tree or its groups."""
    nodes = (node for node in _all_nodes(tree) if node.type == "LIGHT_PATH")
    return any(output.is_linked for node in nodes for output in node.outputs if output.name in names)


def read_mesh_inputs(mesh: bpy.types.Mesh, loops: np.ndarray, asked: Iterable[str]) -> MeshValues:
    """Read what is stored with an evaluated mesh.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    loops : (t, 3) int32
        The corners of its triangles.
    asked : iterable of str

    Returns
    -------
    dict of str to (t, 3, 4) float32
        By input; color and alpha. What the mesh does not have is left out: it counts as 0.
    """
    values: MeshValues = {}
    for name in asked:
        kind, _, layer = name.partition(":")
        found = None
        if kind == "uv":
            found = _uv(mesh, layer)
        elif kind == "color":
            found = _vertex_color(mesh, layer)
        elif kind == "attribute":
            found = _attribute(mesh, mesh.attributes.get(layer))
        elif kind == "generated":
            found = _generated(mesh)
        if found is not None:
            values[name] = found[loops]
    return values


def read_object_inputs(instance: bpy.types.DepsgraphObjectInstance, asked: Iterable[str]) -> ObjectValues:
    """Read the inputs that are the same at all corners of an instance: (4,) float32 by input."""
    obj = instance.object
    values: ObjectValues = {}
    for name in asked:
        kind, _, key = name.partition(":")
        if kind == "location":
            values[name] = _rgba(instance.matrix_world.translation)
        elif kind == "object color":
            values[name] = np.array(obj.color, dtype=np.float32)
        elif kind == "object index":
            values[name] = _rgba([obj.pass_index] * 3)
        elif kind == "random":
            values[name] = _rgba([_random_id(instance) / 0xFFFFFFFF] * 3)
        elif kind == "property":
            values[name] = _property(obj, key)
    return values


def _all_nodes(tree: bpy.types.NodeTree, above: tuple[str, ...] = ()) -> list[bpy.types.Node]:
    nodes = []
    for node in tree.nodes:
        nodes.append(node)
        if node.type == "GROUP" and node.node_tree is not None and node.node_tree.name not in above:
            nodes += _all_nodes(node.node_tree, (*above, node.node_tree.name))
    return nodes


def _named(kind: str, layer: str) -> str:
    return f"{kind}:{layer}" if layer else kind


def _rgba(values: Iterable[float]) -> np.ndarray:
    return np.array([*values, 1.0], dtype=np.float32)


def _uv(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    layers = [layer for layer in mesh.uv_layers if (layer.name == name if name else layer.active_render)]
    if not layers:
        return None
    flat = np.empty(2 * len(mesh.loops), dtype=np.float32)
    layers[0].uv.foreach_get("vector", flat)
    return _padded(flat.reshape(-1, 2))


def _vertex_color(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    colors = mesh.color_attributes
    if name:
        return _attribute(mesh, colors.get(name))
    index = colors.render_color_index
    return _attribute(mesh, colors[index]) if 0 <= index < len(colors) else None


def _generated(mesh: bpy.types.Mesh) -> np.ndarray:
    """Coordinates that are 0 to 1 over the box of the undeformed mesh, at loops."""
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("undeformed_co", flat)
    size = np.array(mesh.texspace_size)
    size = np.where(size != 0, size, 1.0)
    at_vertices = (flat.reshape(-1, 3) - np.array(mesh.texspace_location)) / (2 * size) + 0.5
    return _padded(at_vertices[_loop_rows(mesh, "POINT")])


_COMPONENTS = {  # data type → (name of the value, number of values)
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}


def _attribute(mesh: bpy.types.Mesh, attribute: bpy.types.Attribute | None) -> np.ndarray | None:
    """Return an attribute's values at loops, (l, 4) float32; None for what is not there."""
    if attribute is None or attribute.data_type not in _COMPONENTS:
        return None
    rows = _loop_rows(mesh, attribute.domain)
    if rows is None:
        return None
    name, width = _COMPONENTS[attribute.data_type]
    kind: type = {"BOOLEAN": bool, "INT": np.int32, "INT8": np.int32}.get(attribute.data_type, np.float32)
    flat: np.ndarray = np.empty(len(attribute.data) * width, dtype=kind)
    attribute.data.foreach_get(name, flat)
    values = flat.reshape(-1, width).astype(np.float32)[rows]
    return _padded(np.repeat(values, 3, axis=1) if width == 1 else values)


def _loop_rows(mesh: bpy.types.Mesh, domain: str) -> np.ndarray | None:
    """Return the row of a domain's values for every loop, (l,) int32."""
    count = len(mesh.loops)
    if domain == "CORNER":
        return np.arange(count, dtype=np.int32)
    if domain in ("POINT", "EDGE"):
        rows = np.empty(count, dtype=np.int32)
        mesh.loops.foreach_get("vertex_index" if domain == "POINT" else "edge_index", rows)
        return rows
    if domain == "FACE":
        sizes = np.empty(len(mesh.polygons), dtype=np.int32)
        mesh.polygons.foreach_get("loop_total", sizes)
        return np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)
    return None


def _padded(values: np.ndarray) -> np.ndarray:
    """Return (n, k) as (n, 4) float32: zeros up to the third, and alpha 1."""
    padded = np.zeros((len(values), 4), dtype=np.float32)
    padded[:, 3] = 1.0
    padded[:, : values.shape[1]] = values
    return padded


def _random_id(instance: bpy.types.DepsgraphObjectInstance) -> int:
    """Return Object Info's Random as an integer: an instance's own, or of the object's name.

    Cycles mixes its hash of the name by the last rounds of Jenkins' lookup3.
    """
    if instance.is_instance:
        return int(instance.random_id)
    name = 0
    for code in instance.object.name.encode():
        name = name * 37 + code  # Blender is built with unsigned characters
    bits = 0xFFFFFFFF
    b = c = (0xDEADBEEF + (2 << 2) + 13) & bits
    a = (b + name) & bits

    def mixed(x: int, y: int, turn: int) -> int:
        return ((x ^ y) - ((y << turn | y >> (32 - turn)) & bits)) & bits

    c = mixed(c, b, 14)
    a = mixed(a, c, 11)
    b = mixed(b, a, 25)
    c = mixed(c, b, 16)
    a = mixed(a, c, 4)
    b = mixed(b, a, 14)
    return mixed(c, b, 24)


def _property(obj: bpy.types.Object, name: str) -> np.ndarray:
    """Return a property of an object or its data as Attribute nodes show it; 0 if there is none."""
    value = obj.get(name, None if obj.data is None else obj.data.get(name))
    if value is None:
        try:
            value = obj.path_resolve(name)
        except ValueError:
            return np.zeros(4, dtype=np.float32)
    if isinstance(value, (int, float)):
        return _rgba([float(value)] * 3)
    try:
        numbers = [float(component) for component in value][:4]
    except (TypeError, ValueError):
        return np.zeros(4, dtype=np.float32)
    return _padded(np.array([numbers], dtype=np.float32))[0]
