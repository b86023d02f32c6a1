"""Materials as glTF knows them: a Principled shader on constants and images, one for each lightmap material.

What varies in a way that glTF cannot say (procedural textures, mixed shaders) is evaluated by Cycles into
images in the lightmap's own UVs; see `evaluated_colors.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ...numerics import radiance_of_radiosity
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.image_marks import GROUP
from ..datablocks.image_values import known_means_only
from ..material_copies.material_slots import original_of
from ..material_copies.surface_nodes import SurfaceReader, SurfaceSockets, feed_color, feed_float
from ..material_copies.uv_pin import pin_uvs
from ..materials.materials import read_material, uses_nodes
from ..materials.shader_nodes import MissingImageError, NotConstantError, evaluate, feed_of, output_node

BASE, EMISSION, ALPHA = "base", "emission", "alpha"
CHANNELS = (BASE, EMISSION, ALPHA)

_INPUTS = {BASE: "Base Color", EMISSION: "Emission Color", ALPHA: "Alpha"}


@dataclass(eq=False)
class ExportMaterial:
    """A material of the temporary scene.

    page: Of its lightmap.
    sources: By channel, the socket that feeds it, or a constant.
    evaluated: The channels whose source glTF cannot express.
    glows: Whether it emits.
    factor: What its emission is multiplied by: that of its light group.
    notes: Which of its images are missing.
    is_cut_out: Whether its evaluated alpha is hardly anywhere between 0 and 1.
    """

    material: bpy.types.Material
    name: str
    page: int
    principled: bpy.types.Node
    sources: dict[str, Any]
    evaluated: set[str]
    glows: bool
    factor: tuple[float, float, float]
    notes: tuple[str, ...] = ()
    is_cut_out: bool = False

    @property
    def tree(self) -> bpy.types.NodeTree:
        """Its nodes."""
        return self.material.node_tree

    def show_images(self, images: dict[str, tuple[bpy.types.Image, float]]) -> None:
        """Read the channels that were evaluated from images, each with its image and the value of white."""
        uv = self.tree.nodes.new("ShaderNodeUVMap")
        uv.uv_map = LIGHTMAP_UV_LAYER
        textures: dict[str, bpy.types.Node] = {}
        for channel in sorted(self.evaluated & images.keys()):
            image, white = images[channel]
            if image.name not in textures:
                textures[image.name] = self.tree.nodes.new("ShaderNodeTexImage")
                textures[image.name].image, textures[image.name].extension = image, "EXTEND"
                self.tree.links.new(uv.outputs["UV"], textures[image.name].inputs["Vector"])
            output = textures[image.name].outputs["Alpha" if channel == ALPHA else "Color"]
            if channel == ALPHA and self.is_cut_out:
                rounded = self.tree.nodes.new("ShaderNodeMath")
                rounded.operation = "ROUND"
                self.tree.links.new(output, rounded.inputs[0])
                output = rounded.outputs[0]
            self.tree.links.new(output, self.principled.inputs[_INPUTS[channel]])
            if channel == EMISSION:
                self.principled.inputs["Emission Strength"].default_value = white


def export_material(
    shown: bpy.types.Material | None, name: str, page: int, has_uvs: bool, factor: tuple[float, float, float]
) -> ExportMaterial:
    """Make the material that is exported for a lightmap material, by a name that finds it in the file.

    has_uvs: Whether objects have a UV layer of their own; else images in it are at their origin.
    """
    original = original_of(shown)
    if original is None:
        made = bpy.data.materials.new(name)
    else:
        made = original.copy()
        made.name = name
    constant = read_material(original)
    radiance = radiance_of_radiosity(constant.emission)
    unknown = SurfaceSockets(
        tuple(constant.reflectance.tolist()), tuple(radiance.tolist()), glows=bool(radiance.any())
    )
    if original is None or not uses_nodes(original):
        _make_plain(made, unknown)
    tree = made.node_tree
    if not has_uvs:
        pin_uvs(tree)
    output = output_node(tree) or tree.nodes.new("ShaderNodeOutputMaterial")
    shown_as = original.name if original else "No Material"
    notes = tuple(f"material '{shown_as}': {missing}" for missing in _unlink_missing(tree))
    surface = SurfaceReader(unknown).shader(output.inputs["Surface"], tree)
    principled = feed_of(output.inputs["Surface"], enter_groups=False).node
    keeps_shine = principled is not None and principled.type == "BSDF_PRINCIPLED"
    if not keeps_shine:
        principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
        principled.inputs["Roughness"].default_value = 1.0
        principled.inputs["Specular IOR Level"].default_value = 0.0
        for link in list(output.inputs["Surface"].links):
            tree.links.remove(link)
        tree.links.new(principled.outputs[0], output.inputs["Surface"])
    assert principled is not None
    sources = {BASE: surface.base, EMISSION: surface.emission, ALPHA: surface.alpha}
    glows = bool(surface.glows)
    evaluated = {channel for channel in CHANNELS if not _express(tree, principled, channel, sources[channel])}
    if ALPHA in evaluated and keeps_shine and _is_cut_out(sources[ALPHA], sources[BASE]):
        evaluated.discard(ALPHA)
    if ALPHA in evaluated:
        evaluated.add(BASE)  # glTF has both in one image
    if EMISSION in evaluated and keeps_shine and _keeps_emission(principled):
        evaluated.discard(EMISSION)
    if not glows:
        evaluated.discard(EMISSION)
        principled.inputs["Emission Strength"].default_value = 0.0
    elif EMISSION not in evaluated and factor != (1.0, 1.0, 1.0):
        _scale_emission(principled, factor)
    return ExportMaterial(
        made,
        shown_as,
        page,
        principled,
        sources,
        evaluated,
        glows,
        factor,
        notes,
    )


def _express(tree: bpy.types.NodeTree, principled: bpy.types.Node, channel: str, source: Any) -> bool:
    """Feed a channel from a constant or an image, and return True; False where glTF can have neither."""
    socket = principled.inputs[_INPUTS[channel]]
    constant = _constant(source, channel)
    if constant is not None:
        for link in list(socket.links):
            tree.links.remove(link)
        if channel == ALPHA:
            socket.default_value = constant[0]
        else:
            largest = max(constant) if channel == EMISSION else 1.0
            scale = largest if largest > 1.0 else 1.0
            socket.default_value = (*(value / scale for value in constant), 1.0)
            if channel == EMISSION:
                strength = principled.inputs["Emission Strength"]
                for link in list(strength.links):
                    tree.links.remove(link)
                strength.default_value = scale
        return True
    if channel == EMISSION or not is_plain_image(source):
        return False
    (feed_float if channel == ALPHA else feed_color)(tree, socket, source)
    return True


def _constant(source: Any, channel: str) -> tuple[float, ...] | None:
    """Return the constant of a source (three of them, also of a number); None where it varies."""
    if not isinstance(source, bpy.types.NodeSocket):
        values = (source,) * 3 if channel == ALPHA else source
        return tuple(float(value) for value in values)
    node = source.node
    if node.type == "VECT_MATH" and node.operation == "SCALE":  # color × strength, as `SurfaceReader` has it
        color, strength = (_constant_input(node.inputs[name]) for name in ("Vector", "Scale"))
        return None if color is None or strength is None else tuple(value * strength[0] for value in color)
    probe = node.id_data.nodes.new("ShaderNodeEmission")
    try:
        probe.id_data.links.new(source, probe.inputs["Color"])
        return _constant_input(probe.inputs["Color"])
    finally:
        probe.id_data.nodes.remove(probe)


def _unlink_missing(tree: bpy.types.NodeTree) -> list[str]:
    """Let inputs of shaders that come from images without pixels have their defaults, as in the bake.

    Returns which they are.
    """
    found = []
    shaders = [node for node in tree.nodes if any(output.type == "SHADER" for output in node.outputs)]
    for socket in [each for node in shaders for each in node.inputs if each.is_linked]:
        if socket.type not in {"RGBA", "VALUE"}:
            continue
        try:
            with known_means_only(None):
                evaluate(socket)
        except MissingImageError as reason:
            found.append(f"{socket.name} comes from {reason}; its default is exported")
            for link in list(socket.links):
                tree.links.remove(link)
        except NotConstantError:
            pass
    return found


def _constant_input(socket: bpy.types.NodeSocket) -> tuple[float, ...] | None:
    try:
        with known_means_only(None):
            value = evaluate(socket)
    except (MissingImageError, NotConstantError):
        return None
    return None if value.notes else tuple(float(each) for each in value.rgb)


def is_plain_image(source: Any) -> bool:
    """Return whether a source is an image in sRGB on a UV layer, as glTF can have it."""
    node = source.node if isinstance(source, bpy.types.NodeSocket) else None
    if node is None or node.type != "TEX_IMAGE" or node.image is None or node.projection != "FLAT":
        return False
    of_color = source.name == "Color"
    if of_color and (node.image.is_float or node.image.colorspace_settings.name != "sRGB"):
        return False
    if node.image.source not in {"FILE", "GENERATED"} or not all(node.image.size) or node.extension == "CLIP":
        return False
    vector = feed_of(node.inputs["Vector"], enter_groups=False).node
    if vector is not None and vector.type == "MAPPING":
        if vector.vector_type != "POINT" or any(
            vector.inputs[name].is_linked for name in vector.inputs.keys()[1:]
        ):
            return False
        vector = feed_of(vector.inputs["Vector"], enter_groups=False).node
        return vector is not None and _is_uv(vector)
    return vector is None or _is_uv(vector)


def _is_cut_out(alpha: Any, base: Any) -> bool:
    """Return whether a source is the rounded alpha of the image that is the base color: glTF's mask."""
    node = alpha.node if isinstance(alpha, bpy.types.NodeSocket) else None
    if node is None or node.type != "MATH" or node.operation != "ROUND" or not is_plain_image(base):
        return False
    rounded = feed_of(node.inputs[0], enter_groups=False)
    return rounded.node == base.node and rounded.socket.name == "Alpha"


def _is_uv(node: bpy.types.Node) -> bool:
    return node.type == "UVMAP" or (node.type == "TEX_COORD" and node.outputs["UV"].is_linked)


def _keeps_emission(principled: bpy.types.Node) -> bool:
    """Return whether the shader's own emission is an image in sRGB times a constant."""
    strength, color = principled.inputs["Emission Strength"], principled.inputs["Emission Color"]
    if strength.is_linked and _constant(strength.links[0].from_socket, EMISSION) is None:
        return False
    return color.is_linked and is_plain_image(color.links[0].from_socket)


def _scale_emission(principled: bpy.types.Node, factor: tuple[float, float, float]) -> None:
    """Multiply a constant emission by its light group's factor; of images, by the mean of that."""
    color, strength = principled.inputs["Emission Color"], principled.inputs["Emission Strength"]
    if color.is_linked:
        strength.default_value *= sum(factor) / 3.0
        return
    scaled = [value * each for value, each in zip(color.default_value[:3], factor, strict=True)]
    largest = max(*scaled, 1e-12)
    color.default_value = (*(value / largest for value in scaled), 1.0)
    strength.default_value *= largest


def _make_plain(material: bpy.types.Material, surface: SurfaceSockets) -> None:
    """Have a material without nodes say by nodes what it is."""
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    feed_color(material.node_tree, shader.inputs["Color"], surface.base)
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])


def group_of_emission(shown: bpy.types.Material | None) -> str:
    """Return the light group that a lightmap material's emission follows; "" for none."""
    return str(shown.get(GROUP, "")) if shown is not None else ""
