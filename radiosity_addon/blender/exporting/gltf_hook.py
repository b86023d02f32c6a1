"""File → Export → glTF while lightmaps are shown: Blender's own exporter writes them as our exports do.

Before it reads the scene, baked objects get the meshes and materials of an export for a while; hooks name the
lightmaps in the file; the lightmaps go next to it. The exporter calls nothing where it fails: then a timer,
or the next export, puts the objects back.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy

from ...base import RadiosityError
from ...exports import LIGHTMAP_CHANNEL, write_ktx2
from ...publishing import replacing
from ..datablocks.bake_record import remove_datablocks
from .export import evaluated_materials
from .export_scene import TEMPORARY, ExportScene, export_scene

WRITER = b"Radiosity Lightmaps"
"""In each KTX2 file of ours: by it an earlier one is known, which may be replaced."""

Settings = dict[str, Any]


@dataclass(eq=False)
class _Dressed:
    """What objects were before, and what they are made of now."""

    scene: ExportScene
    files: dict[int, str] = field(default_factory=dict)
    slots: list[tuple[bpy.types.Object, bpy.types.Mesh, list[tuple[str, bpy.types.Material | None]]]] = field(
        default_factory=list
    )
    textures: dict[int, Any] = field(default_factory=dict)


_now: list[_Dressed] = []


def before(settings: Settings) -> None:
    """Give baked objects what is to be exported; called by the exporter."""
    put_back()
    context = bpy.context
    if context.scene is None or context.scene.get(TEMPORARY) is not None:
        return  # our own export
    try:
        scene = export_scene(context)
    except RadiosityError:
        return  # nothing is baked, or not so that engines could use it
    try:
        evaluated_materials(context, scene)
        dressed = _Dressed(scene)
        _write_lightmaps(dressed, Path(settings["gltf_filepath"]))
        meshes = {name: scene.objects[name].data for name in scene.baked}
        objects = [(obj, meshes[obj.name_full]) for obj in bpy.data.objects if obj.name_full in meshes]
        # By default all scenes of the file are exported.
        temporary = [*scene.objects.values(), scene.scene]
        scene.made = [block for block in scene.made if block not in temporary]
        remove_datablocks(temporary)
        _now.append(dressed)
        bpy.app.timers.register(put_back, first_interval=0.0, persistent=True)
        for obj, mesh in objects:
            dressed.slots.append((obj, obj.data, [(slot.link, slot.material) for slot in obj.material_slots]))
            obj.data = mesh
            for slot in obj.material_slots:
                slot.link = "DATA"
        if scene.shown.light != "indirect":
            settings["gltf_lights"] = False  # they are in the lightmap
    except BaseException:
        put_back()
        if not _now:
            scene.close()
        raise


def after(_settings: Settings) -> None:
    """Put everything back; called by the exporter."""
    put_back()


def put_back() -> None:
    """Give objects back what they had, if an export has not yet."""
    with suppress(ValueError):  # not registered, or it is what runs
        bpy.app.timers.unregister(put_back)
    while _now:
        dressed = _now.pop()
        for obj, mesh, slots in dressed.slots:
            obj.data = mesh
            for slot, (link, material) in zip(obj.material_slots, slots, strict=False):
                slot.link = link
                if link == "OBJECT":
                    slot.material = material
        dressed.scene.close()


def _write_lightmaps(dressed: _Dressed, place: Path) -> None:
    """Write the lightmaps next to the file; one that is not ours is left, and its page is not named."""
    for page in range(len(dressed.scene.shown.images)):
        path = place.with_name(f"{place.stem}_lightmap{f'_{page + 1}' if page else ''}.ktx2")
        if path.exists() and WRITER not in path.read_bytes()[:512]:
            continue
        with replacing(path) as aside:
            aside.write_bytes(write_ktx2(dressed.scene.shown.page(page)))
        dressed.files[page] = path.name


class LightmapExtension:
    """Names lightmaps in the file: the exporter makes one for each export."""

    def gather_material_hook(self, material: Any, blender_material: Any, settings: Settings) -> None:
        """Name a material's lightmap. Exporters of Blender 5.2 pass no material of Blender's: names tell."""
        del blender_material, settings
        known = _now[-1].scene.names.materials if _now else {}
        if material.name not in known:
            return
        material.name, page = known[material.name]
        if page is None or page not in _now[-1].files:
            return
        file = _now[-1].files[page]
        told = {"file": file, "page": page, "texCoord": LIGHTMAP_CHANNEL, "intensity": math.pi}
        material.extras = {**(material.extras or {}), "lightmap": told}
        info = {"index": _texture(page, file), "texCoord": LIGHTMAP_CHANNEL, "intensity": math.pi}
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        extension = Extension("MOZ_lightmap", info, required=False)
        material.extensions = {**(material.extensions or {}), "MOZ_lightmap": extension}

    def gather_mesh_hook(self, mesh: Any, *_: Any) -> None:
        """Give a mesh the user's name."""
        known = _now[-1].scene.names.meshes if _now else {}
        mesh.name = known.get(mesh.name, mesh.name)
        _strip(mesh)

    def gather_node_hook(self, node: Any, *_: Any) -> None:
        """Take our properties off a node."""
        _strip(node)

    def gather_scene_hook(self, scene: Any, *_: Any) -> None:
        """Take our properties off a scene."""
        _strip(scene)


def _strip(item: Any) -> None:
    if _now and item.extras:
        item.extras = {
            key: value for key, value in item.extras.items() if not key.startswith("radiosity")
        } or None


def _texture(page: int, file: str) -> Any:
    """Return the exporter's texture of a page, one for all materials."""
    from io_scene_gltf2.io.com import gltf2_io

    textures = _now[-1].textures
    if page not in textures:
        image = gltf2_io.Image(None, None, None, None, f"Lightmap {page}", file)
        sampler = gltf2_io.Sampler(None, None, 9729, 9729, None, 33071, 33071)
        textures[page] = gltf2_io.Texture(None, None, None, sampler, image)
    return textures[page]
