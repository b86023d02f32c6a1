"""A temporary scene of what renders show: copies of objects, with lightmaps as engines want them.

The user's objects are not touched. Copies of baked objects have meshes whose second UV layer is `Lightmap`,
and materials that glTF knows. Their names lead back to the user's.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...base import SceneError
from ...exports import ExportedNames, ViewSettings
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.bake_record import ORIGINAL, is_made, remove_datablocks
from ..material_copies.material_slots import is_copy
from ..scene_export.levels_of_detail import levels_of
from ..stand_ins.stand_ins import STAND_IN
from .export_materials import ExportMaterial, export_material, group_of_emission
from .shown_lightmaps import ShownLightmaps, shown_lightmaps

PREFIX = "radiosity_export_"
"""What names in the temporary scene begin with; those of other add-ons do not."""

TEMPORARY = f"{PREFIX}scene"
"""Custom property of the temporary scene."""

FIRST_LAYER = "UVMap"


@dataclass(eq=False)
class ExportScene:
    """The temporary scene, and what is known of it.

    user_scene: The name of the one that it is of.
    objects mapping of str to Object: The copies by the full names of the user's objects.
    baked: Names of those with a lightmap, with its page.
    view: How the user's scene is shown.
    left_out: Names of levels of detail of them that renders hide.
    """

    scene: bpy.types.Scene
    user_scene: str
    shown: ShownLightmaps
    view: ViewSettings
    objects: dict[str, bpy.types.Object] = field(default_factory=dict)
    baked: dict[str, int] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    materials: list[ExportMaterial] = field(default_factory=list)
    names: ExportedNames = field(default_factory=ExportedNames)
    made: list[bpy.types.ID] = field(default_factory=list)

    @property
    def baked_copies(self) -> list[bpy.types.Object]:
        """The copies of baked objects."""
        return [self.objects[name] for name in self.baked]

    def close(self) -> None:
        """Remove everything from the file."""
        remove_datablocks(reversed(self.made))
        self.made.clear()


def export_scene(context: bpy.types.Context) -> ExportScene:
    """Make the temporary scene of the context's; close it after use.

    Raises
    ------
    SceneError
        If nothing shows a lightmap, or one that cannot be exported.
    """
    shown_objects = list(rendered_objects(context.view_layer))
    shown = shown_lightmaps([obj for obj in shown_objects if obj.type == "MESH"])
    own = context.scene.view_settings
    view = ViewSettings(own.view_transform, own.look, own.exposure, own.gamma)
    made = ExportScene(bpy.data.scenes.new("Radiosity Export"), context.scene.name, shown, view)
    made.made.append(made.scene)
    made.scene[TEMPORARY] = True
    made.scene.frame_set(context.scene.frame_current)
    made.scene.world = context.scene.world
    for name in (
        "resolution_x",
        "resolution_y",
        "pixel_aspect_x",
        "pixel_aspect_y",
    ):  # of the camera's picture
        setattr(made.scene.render, name, getattr(context.scene.render, name))
    try:
        _Copies(made).add(shown_objects)
        hidden = {obj: None for obj in context.scene.objects if obj.type == "MESH" and not is_made(obj)}
        for obj in shown_objects:
            hidden.pop(obj, None)
        made.left_out = tuple(levels_of(made.baked, [obj.name for obj in hidden]))
    except BaseException:
        made.close()
        raise
    return made


def rendered_objects(layer: bpy.types.ViewLayer) -> Iterator[bpy.types.Object]:
    """Yield the objects of a view layer that renders show, once each, parents or not."""
    found: dict[bpy.types.Object, None] = {}

    def visit(part: bpy.types.LayerCollection) -> None:
        if part.exclude or part.collection.hide_render:
            return
        found.update(dict.fromkeys(part.collection.objects))
        for child in part.children:
            visit(child)

    visit(layer.layer_collection)
    yield from (obj for obj in found if not obj.hide_render)


class _Copies:
    """Fills the temporary scene."""

    def __init__(self, made: ExportScene) -> None:
        self._made = made
        self._nodes: dict[str, str] = {}
        self._meshes: dict[str, str] = {}
        self._materials: dict[tuple[str, bool], ExportMaterial] = {}
        self._groups: dict[str, str] = {}

    def add(self, objects: Sequence[bpy.types.Object]) -> None:
        """Copy objects, and put the copies below each other as they are."""
        made = self._made
        for number, obj in enumerate(objects):
            copy = obj.copy()
            made.made.append(copy)
            copy.name = f"{PREFIX}{number}"
            copy.hide_viewport = False  # renders show it, and only what viewports show is evaluated
            self._nodes[copy.name] = obj.name_full
            made.objects[obj.name_full] = copy
            if copy.instance_type == "COLLECTION":  # what it shows was not baked, or has stand-ins
                copy.instance_type, copy.instance_collection = "NONE", None
            made.scene.collection.objects.link(copy)
        for obj in objects:
            copy = made.objects[obj.name_full]
            if obj.parent is not None:
                parent = made.objects.get(obj.parent.name_full)
                if parent is None:
                    copy.parent, copy.matrix_world = None, obj.matrix_world
                else:
                    kept = obj.matrix_parent_inverse.copy()
                    copy.parent, copy.matrix_parent_inverse = parent, kept
            pages = {self._page(slot.material) for slot in obj.material_slots} - {None}
            if obj.type == "MESH" and pages:
                made.baked[obj.name_full] = min(page for page in pages if page is not None)
                self._prepare(obj, copy)
        made.scene.view_layers[0].update()
        made.materials = list(self._materials.values())
        made.names = ExportedNames(
            made.user_scene,
            self._nodes,
            self._meshes,
            {each.material.name: (each.name, each.page) for each in made.materials},
            [each.material.name for each in made.materials if each.evaluated],
            self._groups,
        )

    def _page(self, material: bpy.types.Material | None) -> int | None:
        return None if material is None else self._made.shown.page_of.get(material.name)

    def _prepare(self, obj: bpy.types.Object, copy: bpy.types.Object) -> None:
        """Give a copy a mesh of its own, whose second layer is the lightmap's."""
        mesh = obj.data.copy()
        self._made.made.append(mesh)
        mesh.name = f"{PREFIX}mesh_{len(self._meshes)}"
        original = obj.data.get(ORIGINAL) if STAND_IN in obj.data else obj.data
        self._meshes[mesh.name] = (original or obj.data).name
        has_uvs = arrange_layers(mesh, obj.name)
        shown = [slot.material for slot in obj.material_slots]
        links = [slot.link for slot in obj.material_slots]
        copy.data = mesh
        for number, (material, link) in enumerate(zip(shown, links, strict=True)):
            if not is_copy(material):
                continue
            exported = self._material(material, has_uvs).material
            mesh.materials[number] = exported
            if link == "OBJECT":
                copy.material_slots[number].link = "DATA"

    def _material(self, material: bpy.types.Material, has_uvs: bool) -> ExportMaterial:
        key = material.name, has_uvs
        if key not in self._materials:
            shown = self._made.shown
            name = f"{PREFIX}material_{len(self._materials)}"
            group = group_of_emission(material)
            factor = shown.factor_of(group)
            before = set(bpy.data.node_groups)
            self._materials[key] = made = export_material(
                material, name, shown.page_of[material.name], has_uvs, factor
            )
            self._made.made += [*(set(bpy.data.node_groups) - before), made.material]
            if made.glows and group:
                self._groups[made.material.name] = group
        return self._materials[key]


def arrange_layers(mesh: bpy.types.Mesh, name: str) -> bool:
    """Make `Lightmap` the second UV layer of a mesh; a mesh without another gets a copy of it as the first.

    Returns whether it had one of its own, which then is the one that images without a named layer read.
    Raises SceneError if the mesh has no layer of this name.
    """
    layers = {layer.name: _coordinates(layer) for layer in mesh.uv_layers}
    if LIGHTMAP_UV_LAYER not in layers:
        raise SceneError(f"object '{name}' has lost its UV layer '{LIGHTMAP_UV_LAYER}': bake it again")
    rendered = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    ours = layers.pop(LIGHTMAP_UV_LAYER)
    has_uvs = bool(layers)
    if not has_uvs:
        layers = {FIRST_LAYER: ours}
    first, *others = layers
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    for wanted, values in (
        (first, layers[first]),
        (LIGHTMAP_UV_LAYER, ours),
        *((o, layers[o]) for o in others),
    ):
        mesh.uv_layers.new(name=wanted, do_init=False).uv.foreach_set("vector", values)
    mesh.uv_layers[rendered if rendered in layers else first].active_render = True
    mesh.uv_layers[LIGHTMAP_UV_LAYER].active = True
    return has_uvs


def _coordinates(layer: bpy.types.MeshUVLoopLayer) -> np.ndarray:
    found = np.empty(2 * len(layer.uv), dtype=np.float32)
    layer.uv.foreach_get("vector", found)
    return found


def lamps_in(objects: Mapping[str, bpy.types.Object]) -> list[str]:
    """Return the names of the lamps among objects."""
    return sorted(name for name, obj in objects.items() if obj.type == "LIGHT")
