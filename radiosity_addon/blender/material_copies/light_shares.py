"""What lightmap materials need of light groups: the images, the mixer, and whose emission is whose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import bpy

from ...bake.relight import group_of
from ...base import BakeWarning
from ...options import BakeSettings
from ..datablocks.bake_record import is_made
from ..images.group_images import shown_images
from ..images.images import image_scale
from ..images.light_mixer import mixers, new_mixer
from ..scene_records.export_sources import ExportSource
from ..scene_records.light_membership import Membership

MANY_IMAGES = 14
"""Images that EEVEE draws in one material on any graphics card: 16 units, less two that it needs itself."""


class LightShares:
    """The light groups of one bake, as materials mix them.

    scene: The one that was baked.
    images: The pages of all light.
    groups mapping of str to sequence of Image: Those of each group, parallel to `images`.
    mixer: The one that mixes them already; None makes one.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        images: Sequence[bpy.types.Image],
        groups: Mapping[str, Sequence[bpy.types.Image]],
        settings: BakeSettings,
        mixer: bpy.types.NodeTree | None = None,
    ) -> None:
        self._membership = Membership(scene)
        self._settings = settings
        self._of_page = {
            page: {name: of[number] for name, of in groups.items()} for number, page in enumerate(images)
        }
        self.mixer = mixer or new_mixer(list(groups), [image_scale(of[0]) for of in groups.values()])

    @classmethod
    def shown(cls, scene: bpy.types.Scene, settings: BakeSettings) -> LightShares | None:
        """Return those of the bake that this file shows, to make materials again; None without groups."""
        images, groups = shown_images()
        found = mixers()
        return cls(scene, images, groups, settings, found[0]) if groups and found else None

    def emission_group(self, source: ExportSource, material: bpy.types.Material | None) -> str:
        """Return the group whose sliders what a source emits by a material follows; "" for none."""
        shown = bpy.data.objects.get((source.object_name, source.library))
        if shown is None or material is None:
            return ""
        owner = bpy.data.objects.get((source.instancer, None)) if source.is_instance else shown
        of_scene = self._membership.at(shown, owner or shown).of_material(material)
        group = group_of(material.name, of_scene, self._settings)
        return group if group in next(iter(self._of_page.values())) else ""

    def wire(
        self, tree: bpy.types.NodeTree, page: bpy.types.Node, uv: bpy.types.NodeSocket
    ) -> bpy.types.Node:
        """Put the images of a page's groups next to the page, and the mixer after them.

        tree: Of a material.
        page: The Image Texture of all light; nothing reads it, which keeps it out of the shader.
        uv: Where the lightmap's coordinates are.
        Returns mixer: Its first output is the mixed texel; the others are the groups' factors, in their
            order.
        """
        x, y = page.location
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = self.mixer
        node.name = node.label = self.mixer.name
        node.location = (x + 300, y + 300)
        for row, (name, image) in enumerate(self._of_page[page.image].items()):
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image, texture.label = image, name
            texture.extension, texture.interpolation = page.extension, page.interpolation
            texture.location = (x, y + 300 * (1 + row))
            tree.links.new(uv, texture.inputs["Vector"])
            tree.links.new(texture.outputs["Color"], node.inputs[name])
        page.label = "All light (not used)"
        return node


def crowded_materials() -> list[BakeWarning]:
    """Warn of lightmap materials that read more images than EEVEE can show everywhere."""
    found = []
    for material in bpy.data.materials:
        if is_made(material) and material.node_tree is not None:
            number = len(_images_read(material.node_tree))
            if number > MANY_IMAGES:
                message = (
                    f"material '{material.name}' reads {number} images, with those of the light groups; "
                    f"EEVEE shows it pink on graphics cards that take {MANY_IMAGES}: use fewer groups"
                )
                found.append(BakeWarning(material.name, message))
    return found


def _images_read(tree: bpy.types.NodeTree) -> set[bpy.types.Image]:
    """Return the images of a tree's nodes, and of groups in it, that something reads."""
    images = set()
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree is not None:
            images |= _images_read(node.node_tree)
        elif getattr(node, "image", None) is not None and any(out.is_linked for out in node.outputs):
            images.add(node.image)
    return images
