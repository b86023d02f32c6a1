"""Copies of materials that show a lightmap: base color × lightmap, plus their own light, and their shine.

One copy for each (material, image, whether UVs are pinned, whether its slot is empty), shared
between the objects for which these are the same. A copy holds the original's nodes, connected,
so that it can be edited as the original can; `material_edits.py` carries such edits to the original.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable
from typing import Any

import bpy

from ...base import BakeWarning
from ...numerics import brdf_of_reflectance, radiance_of_radiosity
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.bake_record import ORIGINAL, is_made, mark_made
from ..datablocks.image_marks import GROUP
from ..images.images import image_scale
from ..images.light_mixer import factor_of
from ..images.node_group import (
    ALPHA,
    BASE_COLOR,
    DIFFUSE_COLOR,
    EMISSION,
    EMISSION_FACTOR,
    LIGHTMAP,
    LIGHTMAP_ONLY,
    LOOK_LIGHTMAP,
    SCALE,
    SHADER,
    SURFACE,
    libraries_showing_others,
    lightmap_group,
    looks_of_groups,
    put_looks_back,
    show_in_groups,
)
from ..materials.materials import is_volume, read_material, uses_nodes
from .copy_marks import (
    COPY_NAME,
    EMPTY_SLOT,
    FED,
    FED_BY,
    NO_MATERIAL,
    PLAIN,
    SAMPLING,
    SUFFIX,
    TOKEN,
    copied_groups,
    linked_output,
    mark_added,
)
from .copy_record import record
from .false_colors import false_colors
from .followed_values import follow_keys, is_animated
from .light_shares import LightShares
from .parted_surfaces import PartedSurfaces
from .surface_nodes import SurfaceSockets, feed_color, feed_float
from .uv_pin import pin_uvs

RADIANCE_PER_TEXEL = {
    "irradiance_over_pi": 1.0,
    "irradiance": brdf_of_reflectance(1.0),
    "radiosity": radiance_of_radiosity(1.0),
    "residual": 10.0 * radiance_of_radiosity(1.0),
}
"""What a texel of 1 makes a surface send out [W/m²/sr]: of a white one for the irradiances
(L = H/π), of the surface itself for radiosity (L = B/π, reflection and emission included). A
residual is shown ten times its size: an error of a tenth looks as bright as the light itself."""


HOLDS_REFLECTED = ("radiosity", "residual")
"""Quantities that hold what the surface reflects and emits already, and so does its error."""


class LightmapMaterials:
    """Makes the lightmap copies of materials for one bake, each once; `shares` where it has light groups."""

    def __init__(self, quantity: str, shares: LightShares | None = None) -> None:
        self._quantity = quantity
        self._shares = shares
        self._made: dict[tuple[Any, ...], bpy.types.Material] = {}
        self._glows: dict[bpy.types.Material | None, bool] = {}
        self._still: dict[str, BakeWarning] = {}

    @property
    def warnings(self) -> tuple[BakeWarning, ...]:
        """Those of materials whose keyframes and drivers do not show."""
        return tuple(self._still.values())

    def copy_of(
        self,
        material: bpy.types.Material | None,
        image: bpy.types.Image,
        pinned: bool,
        group: str = "",
        empty_slot: bool = False,
    ) -> bpy.types.Material:
        """Return the copy of `material` that shows `image`.

        material: None gives a plain gray.
        image: The lightmap page.
        pinned: The object had no UV layer of its own.
        group: The light group whose sliders its own light follows, if it has any; "" for none.
        empty_slot: The material is the mesh's; the object's own slot, which the copy fills, is empty.
        """
        group = group if self._glows.get(material, True) else ""
        key = (material, image, pinned, group, empty_slot)
        if key not in self._made:
            self._made[key] = self._make(material, image, pinned, group)
            if empty_slot:
                self._made[key][EMPTY_SLOT] = True
            if not self._glows.setdefault(material, False):
                self._made[material, image, pinned, "", empty_slot] = self._made[key]
        return self._made[key]

    def _make(
        self, material: bpy.types.Material | None, image: bpy.types.Image, pinned: bool, group: str
    ) -> bpy.types.Material:
        """Build one copy."""
        if material is None:
            copy = bpy.data.materials.new(NO_MATERIAL)
        else:
            copy = material.copy()
            copy.name = f"{material.name}{SUFFIX}"
            copy[ORIGINAL] = material
        mark_made(copy)
        copy[COPY_NAME], copy[TOKEN] = copy.name, uuid.uuid4().hex
        constant = read_material(material)
        radiance = radiance_of_radiosity(constant.emission)
        unknown = SurfaceSockets(
            tuple(constant.reflectance.tolist()), tuple(radiance.tolist()), glows=bool(radiance.any())
        )
        if material is None or not uses_nodes(material):
            copy[PLAIN] = True
            _make_plain_nodes(copy, unknown.base)
        tree = copy.node_tree
        record_content = record(copy)
        before, active = {node.name for node in tree.nodes}, tree.nodes.active
        if pinned:
            pin_uvs(tree)
        reader = PartedSurfaces(unknown)
        outputs = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]
        for index, output in enumerate(outputs or [tree.nodes.new("ShaderNodeOutputMaterial")]):
            if is_volume(output):
                continue
            surface = reader.shader(output.inputs["Surface"], tree)
            self._wire(tree, output, surface, image, group, reader.is_parted)
            if surface.glows:
                self._glows[material], copy[GROUP] = True, group
            if index == 0:
                _skip_light_sampling(copy, surface)
        if material is not None and is_animated(tree):
            self._warn_of_still(material.name, reader.is_parted)
        mark_added(tree, before)
        tree.nodes.active = active
        for inner in dict.fromkeys(copied_groups(tree)):
            mark_added(inner, {node.name for node in inner[ORIGINAL].nodes})
        follow_keys(copy)
        record_content()
        return copy

    def _warn_of_still(self, name: str, is_parted: bool) -> None:
        """Warn of an animated material if its lightmap stays as it was baked."""
        if self._quantity in HOLDS_REFLECTED:
            reason = f"the quantity '{self._quantity}' holds reflected light; bake 'irradiance_over_pi'"
        elif not is_parted:
            reason = "its shader is of a kind that cannot be read; use a Principled BSDF"
        else:
            return
        frame = bpy.context.scene.frame_current
        message = f"material '{name}' is animated, but its lightmap shows it as at frame {frame}: {reason}"
        self._still[name] = BakeWarning(name, message)

    def _wire(
        self,
        tree: bpy.types.NodeTree,
        output: bpy.types.Node,
        surface: SurfaceSockets,
        image: bpy.types.Image,
        light_group: str,
        is_parted: bool,
    ) -> None:
        """Wire UV Map → Image → group → output."""
        x, y = output.location.x - 500, output.location.y + 400
        uv_map = tree.nodes.new("ShaderNodeUVMap")
        uv_map.uv_map = LIGHTMAP_UV_LAYER
        uv_map.location = (x - 200, y + 450)
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        texture.extension = "EXTEND"
        texture.interpolation = "Linear"
        texture.location = (x, y + 450)
        group = tree.nodes.new("ShaderNodeGroup")
        holds_all = self._quantity in HOLDS_REFLECTED
        see_through = surface.alpha != 1.0
        group.node_tree = lightmap_group(is_parted and not holds_all, see_through)
        group.name = group.label = group.node_tree.name
        group.location = (x + 300, y + 300)
        tree.links.new(uv_map.outputs["UV"], texture.inputs["Vector"])
        texel, scale = texture.outputs["Color"], image_scale(image)
        if self._quantity == "residual":
            texel = false_colors(tree, texel)
        if self._shares is not None:
            mixer = self._shares.wire(tree, texture, uv_map.outputs["UV"])
            texel, scale = mixer.outputs[0], 1.0
            if light_group:
                tree.links.new(factor_of(mixer, light_group), group.inputs[EMISSION_FACTOR])
        tree.links.new(texel, group.inputs[LIGHTMAP])
        for link in list(output.inputs["Surface"].links):
            tree.links.new(link.from_socket, group.inputs[SURFACE]).is_muted = link.is_muted
        group.inputs[SCALE].default_value = RADIANCE_PER_TEXEL[self._quantity] * scale

        if not holds_all:
            feed_color(tree, group.inputs[BASE_COLOR], surface.base)
            feed_color(tree, group.inputs[DIFFUSE_COLOR], surface.diffuse)
            feed_color(tree, group.inputs[EMISSION], surface.emission)
        fed = [group.inputs[name] for name in (BASE_COLOR, EMISSION, DIFFUSE_COLOR)]
        group[FED] = [component for socket in fed for component in socket.default_value]
        group[FED_BY] = [linked_output(socket) for socket in fed]
        if see_through:
            feed_float(tree, group.inputs[ALPHA], surface.alpha)
        tree.links.new(group.outputs[SHADER], output.inputs["Surface"])


def show_lightmaps(look: str) -> int:
    """Show a look in all lightmap materials: shine, matte, or the lightmap alone.

    Materials of earlier versions, and lightmaps that cannot be parted from the shine, are matte instead.
    Returns how many materials there are.
    """
    show_in_groups(look)
    count = 0
    for material in bpy.data.materials:
        if is_made(material) and material.node_tree is not None:
            for socket in _earlier_switches(material):
                socket.default_value = float(look == LOOK_LIGHTMAP)
            count += 1
    return count


def linked_looks(look: str) -> tuple[BakeWarning, ...]:
    """Warn of files whose linked materials show another look than this one's."""
    return tuple(
        BakeWarning(
            library.name,
            f"lightmaps linked from '{library.filepath}' are shown differently from this file's, which show "
            f"'{look}': open that file, choose Show there, and reload",
        )
        for library in libraries_showing_others(look)
    )


def looks_kept() -> Callable[[], None]:
    """Return what makes all lightmap materials of now, as far as they still exist, look as they do now."""
    groups = looks_of_groups()
    materials = {
        material.session_uid: [socket.default_value for socket in _earlier_switches(material)]
        for material in bpy.data.materials
        if is_made(material) and material.node_tree is not None
    }

    def put_back() -> None:
        put_looks_back(groups)
        for material in bpy.data.materials:
            if materials.get(material.session_uid):
                values = materials[material.session_uid]
                for socket, value in zip(_earlier_switches(material), values, strict=True):
                    socket.default_value = value

    return put_back


def _earlier_switches(material: bpy.types.Material) -> list[bpy.types.NodeSocket]:
    """Return the inputs by which a material of an earlier version shows the lightmap alone."""
    groups = [
        node for node in material.node_tree.nodes if node.type == "GROUP" and node.node_tree is not None
    ]
    return [node.inputs[LIGHTMAP_ONLY] for node in groups if LIGHTMAP_ONLY in node.inputs]


def _make_plain_nodes(material: bpy.types.Material, color: Any) -> None:
    """Have the material say by nodes what it is without: diffuse, of one color."""
    if bpy.app.version < (5, 0):
        material.use_nodes = True  # Blender 5.0 and later need no asking and warn of it
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*color, 1.0)
    output.location.x = 300
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])


def _skip_light_sampling(material: bpy.types.Material, surface: SurfaceSockets) -> None:
    """Keep Cycles from sampling baked walls as lamps: they are bright, but light nothing."""
    if not surface.glows and hasattr(material, "cycles"):
        material[SAMPLING] = material.cycles.emission_sampling
        material.cycles.emission_sampling = "NONE"
