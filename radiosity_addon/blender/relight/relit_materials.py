"""Emission of the materials that show lightmaps, brought up to that of the originals."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import bpy

from ...numerics import radiance_of_radiosity
from ..datablocks.bake_record import ORIGINAL, is_made
from ..images.node_group import EMISSION
from ..material_copies.copy_marks import PLAIN, STATE
from ..material_copies.copy_record import is_untouched
from ..material_copies.material_digest import digest_of_material
from ..material_edits.copy_values import take_values
from ..material_edits.stripping import is_lightmap_node
from ..materials.materials import read_material, uses_nodes

_EMISSION_SOCKETS = {"Color", "Strength", "Emission Color", "Emission Strength"}


def refresh_copies(names: Collection[str]) -> None:
    """Have the lightmap copies of some materials glow as their originals do.

    The copies hold the originals' nodes: all their values are taken over, but by a copy that the user edited
    only those of its emission.

    names collection of str: Of the originals whose emission has changed.
    """
    for copy, original in lightmap_copies(names):
        _take(copy, original, None if is_untouched(copy) else _EMISSION_SOCKETS)


def show_emission(names: Collection[str]) -> None:
    """Have the copies of some materials glow as their originals do, as far as shaders' constants say it."""
    for copy, original in lightmap_copies(names):
        _take(copy, original, _EMISSION_SOCKETS)


def lightmap_copies(names: Collection[str]) -> Iterator[tuple[bpy.types.Material, bpy.types.Material]]:
    """Yield the lightmap copies of the materials of these names, and the originals."""
    for copy in [block for block in bpy.data.materials if is_made(block) and block.node_tree is not None]:
        original = copy.get(ORIGINAL)
        if original is not None and original.name in names:
            yield copy, original


def _take(copy: bpy.types.Material, original: bpy.types.Material, sockets: set[str] | None) -> None:
    untouched = is_untouched(copy)
    if uses_nodes(original) and not copy.get(PLAIN):
        take_values(copy.node_tree, original.node_tree, sockets)
    radiance = radiance_of_radiosity(read_material(original).emission)
    for node in copy.node_tree.nodes:
        # What no shader of ours says, and what earlier versions wrote there.
        if is_lightmap_node(node) and not node.inputs[EMISSION].is_linked:
            node.inputs[EMISSION].default_value = (*radiance.tolist(), 1.0)
    if untouched:
        copy[STATE] = digest_of_material(copy, as_copy=True)
