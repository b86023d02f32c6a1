"""Where the exported triangles came from: what applying a lightmap needs to find again."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...base import SceneError
from ...scene import BakeScene
from ..materials.gloss import ALL, Gloss

Matrix4 = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class ExportSource:
    """The Blender object, or instance of one, behind a `BakeObject`.

    name: The `BakeObject`'s name, unique in the export: the object's own, or "Instancer/Object" of an
        instance.
    object_name: Name of the object itself; of an instance, that of the object it shows.
    library: File the object is linked from; None for a local one.
    is_instance: True where no object stands at this place: an instance of a collection, of geometry nodes or
        of particles. Applying makes a stand-in object for it.
    instancer: Name of the object that makes the instance, to be hidden once stand-ins are there; empty for a
        real object.
    persistent_id: Blender's key of the instance below its instancer; empty for a real object.
    matrix_world 4 rows of 4 floats.
    needs_evaluated_mesh: The exported polygons and loops are those of the evaluated mesh, because modifiers
        change them. False: they are those of the object's own mesh. Always True for an instance.
    makes_instances: The object also makes instances that became stand-ins.
    glass_slots: Material slots of glass, which gets no lightmap and keeps its material.
    is_modified: Modifiers or nodes may make other polygons than the object's own mesh has.
    """

    name: str
    object_name: str
    library: str | None
    is_instance: bool
    instancer: str
    persistent_id: tuple[int, ...]
    matrix_world: Matrix4
    needs_evaluated_mesh: bool
    makes_instances: bool = False
    glass_slots: frozenset[int] = frozenset()
    is_modified: bool = False


@dataclass(frozen=True)
class MaterialSource:
    """A material of the file, to be found again: it may be edited or removed meanwhile.

    library: File it is linked from; None for a local one.
    group: The light group that is named on it, or "".
    lets_through, gloss: See `read_material`.
    """

    name: str
    library: str | None
    group: str
    lets_through: bool = False
    gloss: Gloss = ALL

    @staticmethod
    def of(material: bpy.types.Material, group: str, lets_through: bool, gloss: Gloss) -> MaterialSource:
        """Return the source that finds a material."""
        library = material.library.filepath if material.library else None
        return MaterialSource(material.name, library, group, lets_through, gloss)

    def find(self) -> bpy.types.Material:
        """Return the material.

        Raises SceneError if it is gone.
        """
        material = bpy.data.materials.get((self.name, self.library))
        if material is None:
            what = f"material '{self.name}' was removed or renamed while the scene was read"
            raise SceneError(f"{what}: bake again")
        return material


@dataclass(frozen=True)
class Export:
    """A scene ready to bake, and where each of its objects came from.

    sources: Parallel to `bake_scene.objects`.
    """

    bake_scene: BakeScene
    sources: tuple[ExportSource, ...]
