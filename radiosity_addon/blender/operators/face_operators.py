"""The buttons above warnings of faces that show their backs: *Flip Faces* and *Select*."""

from __future__ import annotations

import bpy

from ...base import RadiosityError
from ..datablocks.bake_record import is_made
from ..session import facts, last_bake
from ..session.turned_faces import TurnedFaces, runs_of
from .checks import last_check
from .polls import Conditional, has_scene, in_object_mode, no_bake_runs

MOST_REPORTED = 3
"""So many refusals are reported one by one."""


class RADIOSITY_OT_flip_turned_faces(Conditional, bpy.types.Operator):
    """Flip the faces that the last bake or check found to show their backs, and no others"""

    bl_idname = "radiosity.flip_turned_faces"
    bl_label = "Flip Faces"
    bl_options = {"REGISTER", "UNDO"}

    only_selected: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Only Selected",
        description="Flip only faces of selected objects, and of those that share a mesh with one",
        options={"SKIP_SAVE"},
    )

    conditions = (no_bake_runs, has_scene, in_object_mode)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Flip what can be flipped, and say why the rest is not."""
        from ..apply.edits import carry_edits
        from ..apply.face_flips import flip

        try:
            for warning in carry_edits(context):
                self.report({"WARNING"}, warning.message)
            found = _turned_faces(context.scene)
            names = [faces.object for faces in found]
            if self.only_selected:
                selected = {obj.name for obj in context.view_layer.objects.selected}
                names = [name for name in names if name in selected]
            flipped = flip(context, found, names)
        except RadiosityError as error:
            self.report({"ERROR"}, " ".join(str(error).split()))
            return {"CANCELLED"}
        return self._reported(flipped.faces, flipped.objects, flipped.refusals)

    def _reported(self, count: int, objects: tuple[str, ...], refusals: tuple[str, ...]) -> set[str]:
        """Say what was flipped and what was not."""
        facts.refresh()
        for reason in refusals[:MOST_REPORTED]:
            self.report({"WARNING" if count else "ERROR"}, reason)
        if len(refusals) > MOST_REPORTED:
            self.report({"WARNING"}, f"and {len(refusals) - MOST_REPORTED} more objects were not flipped")
        if not count:
            if not refusals:
                self.report({"INFO"}, "No faces to flip: bake or check the scene to find some")
            return {"CANCELLED"}
        of = f"'{objects[0]}'" if len(objects) == 1 else f"{len(objects)} objects"
        self.report({"INFO"}, f"Flipped {count:,} face{'' if count == 1 else 's'} of {of}: bake again")
        return {"FINISHED"}


class RADIOSITY_OT_select_turned_faces(Conditional, bpy.types.Operator):
    """Select objects with faces that the last bake or check found to show their backs, and these faces"""

    bl_idname = "radiosity.select_turned_faces"
    bl_label = "Select Turned Faces"
    bl_options = {"REGISTER", "UNDO"}

    conditions = (no_bake_runs, has_scene, in_object_mode)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select them, and nothing else; Edit Mode shows the faces."""
        found = {faces.object: faces for faces in _turned_faces(context.scene)}
        shown = [obj for obj in context.view_layer.objects if obj.name in found and obj.visible_get()]
        for obj in context.view_layer.objects:
            obj.select_set(obj in shown)
        if not shown:
            self.report({"INFO"}, "No faces to select: bake or check the scene to find some")
            return {"CANCELLED"}
        context.view_layer.objects.active = shown[0]
        context.tool_settings.mesh_select_mode = (False, False, True)
        for obj in shown:
            _select_faces(obj, found[obj.name])
        return {"FINISHED"}


def _turned_faces(scene: bpy.types.Scene) -> list[TurnedFaces]:
    """Return the faces that a scene's last bake and check found, where meshes are as they were."""
    from ..apply.face_flips import unchanged

    last, check = last_bake.read(scene), last_check(scene)
    found: dict[str, TurnedFaces] = {}
    for faces in unchanged((*(last.turned if last else ()), *(check.turned if check else ())))[0]:
        known = found.get(faces.object, faces)
        runs = runs_of(sorted({*known.polygons, *faces.polygons}))
        found[faces.object] = faces._replace(runs=runs, is_whole=known.is_whole or faces.is_whole)
    return list(found.values())


def _select_faces(obj: bpy.types.Object, faces: TurnedFaces) -> None:
    """Select faces of a mesh and nothing else of it; not of one that is linked, or has others."""
    from ..datablocks.face_winding import select_polygons

    mesh = obj.data
    if isinstance(mesh, bpy.types.Mesh) and mesh.library is None and (is_made(mesh) or not faces.is_made):
        select_polygons(mesh, faces.polygons)


CLASSES = (RADIOSITY_OT_flip_turned_faces, RADIOSITY_OT_select_turned_faces)
