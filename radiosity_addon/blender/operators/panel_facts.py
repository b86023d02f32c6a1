"""What panels and polls know of a scene: worked out after changes and not while drawing.

Values hold names and no references to Blender's data, which do not outlive an undo.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy

from ..datablocks.bake_record import is_baked
from ..images.light_mixer import mixers, sliders_of
from ..overlays.overlay_properties import overlay_of
from ..relight import kept_bakes
from ..relight.kept_sidecars import why_not_relit
from ..scene_records.object_roles import has_role
from ..session import last_bake
from ..session.facts import fact
from ..settings.light_group_properties import ListedGroup, list_groups
from .checks import last_check

SHOWN_LIGHTS = 16


class PropertyPath(NamedTuple):
    """A property of a datablock.

    Parameters
    ----------
    collection : str
        Attribute of `bpy.data`.
    key : (str, str or None)
        Name, and file path of the library.
    path : str
        From the datablock to the owner of the property.
    attribute : str
    """

    collection: str
    key: tuple[str, str | None]
    path: str
    attribute: str

    def owner(self) -> Any:
        """Return the owner of the property, None if it is gone."""
        block = getattr(bpy.data, self.collection).get(self.key)
        try:
            return block.path_resolve(self.path) if block is not None and self.path else block
        except ValueError:
            return None


class LightRow(NamedTuple):
    """A light of the kept bake, or a baked light group: what of color and strength can be set."""

    name: str
    icon: str
    places: tuple[PropertyPath, ...] = ()


@fact(unknown=True)
def has_meshes(context: bpy.types.Context) -> bool:
    """Whether the scene has anything to bake."""
    return any(obj.type == "MESH" for obj in context.scene.objects)


def copy_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the selected objects that can take the settings of the active one; linked ones cannot."""
    return [
        obj
        for obj in context.selected_objects
        if obj != context.object and has_role(obj) and obj.library is None
    ]


@fact(unknown=True)
def has_copy_targets(context: bpy.types.Context) -> bool:
    """Whether any selected object can take the settings of the active one."""
    return bool(copy_targets(context))


@fact(unknown=False)
def can_restore(_context: bpy.types.Context) -> bool:
    """Whether the file shows a bake."""
    return is_baked()


@fact(unknown="")
def relight_refusal(context: bpy.types.Context) -> str:
    """Why the scene's bake cannot be relit; empty if it can."""
    return why_not_relit(context.scene)


@fact(unknown=())
def listed_groups(context: bpy.types.Context) -> tuple[ListedGroup, ...]:
    """The scene's light groups by name."""
    return list_groups(context.scene)


def has_light_mixers(context: bpy.types.Context) -> bool:
    """Whether any baked light groups have sliders."""
    return bool(light_mixers(context))


@fact(unknown=())
def light_mixers(_context: bpy.types.Context) -> tuple[tuple[str, tuple[LightRow, ...]], ...]:
    """The node groups that mix baked light groups, each with its groups."""
    found = []
    for tree in mixers():
        rows = []
        for each in sliders_of(tree):
            places = [_place(tree, socket, "default_value") for socket in (each.color, each.strength)]
            rows.append(LightRow(each.name, "NONE", tuple(places)))
        found.append((tree.name, tuple(rows)))
    return tuple(found)


@fact(unknown=((), 0))
def kept_lights(context: bpy.types.Context) -> tuple[tuple[LightRow, ...], int]:
    """The first lights of the kept bake, and how many more there are."""
    from ..materials.light_inputs import inputs_of

    held = kept_bakes.find(context.scene)
    if held is None:
        return (), 0
    lights = len(held.bake.sources.lights)
    named = list(dict.fromkeys((name, row >= lights) for row, name in enumerate(held.bake.names)))
    rows = []
    for name, emits in named[:SHOWN_LIGHTS]:
        found = inputs_of(context.scene, name, emits)
        if found is None:
            rows.append(LightRow(name, "ERROR"))
            continue
        inputs = [each for each in (found.color, found.strength) if each[0] is not None]
        rows.append(LightRow(name, found.icon, tuple(_place(found.block, *each) for each in inputs)))
    return tuple(rows), len(named) - len(rows)


class FacesToFlip(NamedTuple):
    """Objects with faces that show their backs.

    found: Names of those that can be flipped now.
    changed: Names of those whose mesh has changed since they were found.
    """

    found: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()


@fact(unknown=(FacesToFlip(), FacesToFlip()))
def faces_to_flip(context: bpy.types.Context) -> tuple[FacesToFlip, FacesToFlip]:
    """What the scene's last bake found, and its last check."""
    from ..apply.face_flips import unchanged

    looked = []
    for source in (last_bake.read(context.scene), last_check(context.scene)):
        same, changed = unchanged(source.turned if source is not None else ())
        looked.append(FacesToFlip(tuple(faces.object for faces in same), tuple(changed)))
    return looked[0], looked[1]


@fact(unknown="")
def overlay_message(context: bpy.types.Context) -> str:
    """Why the chosen overlay cannot be shown; empty if it can."""
    from ..overlays.overlay_pictures import missing

    return missing(context)


@fact(unknown=())
def light_on_active(context: bpy.types.Context) -> tuple[tuple[str, str], ...]:
    """Minimum, mean, maximum and uniformity of the light on the active object; empty without a lightmap."""
    from ..overlays.lightmap_values import lightmap_of, object_statistics

    obj, settings = context.view_layer.objects.active, overlay_of(context)
    if obj is None or lightmap_of(obj) is None:
        return ()
    found = object_statistics(obj, context.scene, settings.unit, settings.efficacy)
    if found is None:
        return ()
    statistics, unit = found
    return (
        ("Minimum", f"{statistics.minimum:.4g} {unit}"),
        ("Mean", f"{statistics.mean:.4g} {unit}"),
        ("Maximum", f"{statistics.maximum:.4g} {unit}"),
        ("Uniformity", "–" if statistics.uniformity is None else f"{statistics.uniformity:.2f}"),
    )


_COLLECTIONS = (
    (bpy.types.Light, "lights"),
    (bpy.types.Material, "materials"),
    (bpy.types.World, "worlds"),
    (bpy.types.NodeTree, "node_groups"),
)


def _place(block: bpy.types.ID, owner: Any, attribute: str) -> PropertyPath:
    """Return where a property is: of a datablock itself, or of a socket in its node tree."""
    collection = next(name for kind, name in _COLLECTIONS if isinstance(block, kind))
    path = ""
    if owner != block:
        inside = "" if isinstance(block, bpy.types.NodeTree) else "node_tree."
        path = inside + owner.path_from_id()
    library = None if block.library is None else block.library.filepath
    return PropertyPath(collection, (block.name, library), path, attribute)
