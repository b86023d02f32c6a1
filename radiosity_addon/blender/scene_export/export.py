"""The scene as arrays: what a bake needs of the open file, and where it came from."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import TypeVar

import bpy
import numpy as np

from ...base import BakeWarning, SceneError, UsageError, drain, elsewhere
from ...lights import EnvironmentLight
from ...options import BakeSettings
from ...scene import BakeObject, BakeScene, Scene, SurfaceImages
from ..cycles.lamps import lamp_factors
from ..cycles.surface_evaluation import evaluate_surfaces
from ..cycles.world import read_world
from ..datablocks.mesh_arrays import all_finite, degenerate, not_finite_message, world_from_object
from ..datablocks.uv_layers import MAX_UV_LAYERS
from ..scene_records.export_sources import Export, ExportSource
from ..scene_records.light_membership import blender_groups, group_on
from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES, half_visible
from ..scene_records.pieces import Piece, SceneContents
from ..scene_records.render_options import option_warnings, world_of
from ..scene_records.render_state import leave_edit_mode, render_depsgraph
from .collect import collect_steps
from .levels_of_detail import level_of_detail, pieces_named, with_levels
from .page_checks import check_pages

T = TypeVar("T")


def export_scene(context: bpy.types.Context, settings: BakeSettings, dark: bool = False) -> Export:
    """Read the context's view layer as a render would see it, at once: for scripts; see `export_steps`."""
    return drain(export_steps(context, settings, dark))


def export_steps(
    context: bpy.types.Context,
    settings: BakeSettings,
    dark: bool = False,
    in_background: bool = False,
    shown: Callable[[], AbstractContextManager[object]] = nullcontext,
) -> Generator[float, None, Export]:
    """Read the context's view layer as a render would see it, in steps that a window can wait for.

    Between two steps the file is as the user has it, and may be edited: what was read stays as it was read,
    what is gone before it is read is not there.

    context: Of a scene without lightmaps: restore an earlier bake first, or have `shown` hide it.
    settings: `objects`, `light_only`, `ignore`, `sky` and `keep_uvs` matter here.
    dark: Whether lamps without power and a black world are lights too, for a bake that is kept.
    in_background: Whether a window waits: work on arrays is then done in a thread.
    shown: Shows the originals, within a step.
    Yields fraction: Of no great truth.
    Raises UsageError if settings name objects that are not there, or that cannot have a lightmap and should.
    Raises SceneError if there is nothing to bake, a coordinate is NaN or infinite, or an object to be baked
        has no room for another UV layer.
    """
    factors = yield from lamp_factors()
    options: list[BakeWarning] = []

    @contextmanager
    def view() -> Iterator[bpy.types.Depsgraph]:
        leave_edit_mode(context)  # a second window may have entered it
        with shown(), render_depsgraph(context) as depsgraph:
            yield depsgraph
            options[:] = option_warnings(context)

    sorted_out = yield from collect_steps(view, factors, settings, dark, in_background)
    collected = yield from elsewhere(sorted_out, in_background)
    collected.warnings.extend(options)
    # Before anything is rendered.
    check_names(context, collected.pieces, settings)
    chosen = chosen_pieces(context, collected.pieces, settings.objects)
    check_pages(chosen, settings)
    for piece in with_levels(chosen, collected.pieces):
        _check_uv_layers(piece)
    yield 0.5
    background = world_of(context)
    group = group_on(background, blender_groups(context.scene))
    # After that: Cycles may have to render it, which no evaluated object would survive.
    world, warnings = yield from read_world(background, dark)
    collected.lights.extend(world)
    collected.groups.extend([group] * len(world))
    collected.warnings.extend(warnings)
    names = {piece.source.name for piece in chosen}
    return (yield from _assemble(context, collected, names, settings, in_background))


@dataclass(frozen=True, eq=False)
class _Triangles:
    """What all pieces are together, one row a triangle; see `Scene` and `BakeScene`."""

    objects: list[BakeObject]
    corners: np.ndarray
    normals: np.ndarray
    surface: np.ndarray
    in_bounces: np.ndarray
    in_shadows: np.ndarray
    warnings: list[BakeWarning]
    area_to_bake: bool


def _triangles(pieces: list[Piece], chosen: set[str], settings: BakeSettings) -> _Triangles:
    """Carry all pieces into the world; works on arrays alone."""
    warnings: list[BakeWarning] = []
    objects, corners, normals, surfaces = [], [], [], []
    in_bounces, in_shadows = [], []
    first, area_to_bake = 0, False
    for piece in pieces:
        mesh = piece.mesh
        world, world_normals, mirrored = world_from_object(mesh, piece.matrix)
        if not all_finite(world):
            raise SceneError(not_finite_message(piece.source.object_name))
        flat = degenerate(world)
        if flat.any():
            warnings.append(_degenerate_warning(piece.source.name, int(flat.sum())))
        bake = piece.source.name in chosen
        area_to_bake |= bake and not flat.all()
        order = slice(None, None, -1 if mirrored else 1)
        uv = mesh.lightmap_uv if settings.keep_uvs else None
        objects.append(
            BakeObject(
                name=piece.source.name,
                first=first,
                count=len(mesh),
                bake=bake,
                polygon=mesh.polygon,
                loops=np.ascontiguousarray(mesh.loops[:, order]),
                uv=None if uv is None else np.ascontiguousarray(uv[:, order]),
                texel_scale=piece.role.texel_scale,
                page=piece.role.page,
                level=level_of_detail(piece),
                winding=mesh.winding,
            )
        )
        in_bounces.append(np.full(len(mesh), piece.role.in_bounces))
        in_shadows.append(np.full(len(mesh), piece.role.in_shadows))
        corners.append(world)
        normals.append(world_normals)
        surfaces.append(piece.surface)
        first += len(mesh)
    return _Triangles(
        objects,
        np.concatenate(corners),
        np.concatenate(normals),
        np.concatenate(surfaces),
        np.concatenate(in_bounces),
        np.concatenate(in_shadows),
        warnings,
        area_to_bake,
    )


def _assemble(
    context: bpy.types.Context,
    collected: SceneContents,
    chosen: set[str],
    settings: BakeSettings,
    in_background: bool,
) -> Generator[float, None, Export]:
    """Make one scene of all that was collected."""
    triangles = yield from elsewhere(lambda: _triangles(collected.pieces, chosen, settings), in_background)
    if not triangles.area_to_bake:
        raise SceneError(_nothing_to_bake(context))
    images = yield from evaluate_surfaces(
        context,
        collected.pieces,
        collected.surfaces,
        collected.materials,
        settings,
        in_background,
    )
    name = context.scene.name
    return (
        yield from elsewhere(lambda: _export(name, collected, triangles, images, settings), in_background)
    )


def _export(
    scene_name: str,
    collected: SceneContents,
    triangles: _Triangles,
    images: SurfaceImages | None,
    settings: BakeSettings,
) -> Export:
    """Put the parts together; works on arrays alone."""
    warnings = [*collected.warnings, *triangles.warnings]
    surface = triangles.surface
    reflectance = np.array([surface.reflectance for surface in collected.surfaces]).reshape(-1, 3)
    emission = np.array([surface.emission for surface in collected.surfaces]).reshape(-1, 3)
    # What takes nothing of the light need not be traced.
    unseen = np.zeros(len(surface), dtype=bool) if images is None else images.invisible
    scene = Scene(
        triangles=triangles.corners,
        reflectance=reflectance[surface],
        emission=emission[surface],
        two_sided=True,  # Blender's surfaces reflect and emit on both sides
        lights=collected.lights,
        normals=triangles.normals,
        images=images,
        in_bounces=triangles.in_bounces & ~unseen,
        in_shadows=triangles.in_shadows & ~unseen,
    )
    objects, sources = _without_glass(triangles.objects, collected.pieces, images)
    if not any(item.bake and item.count for item in objects):
        name = next(item.name for item in triangles.objects if item.bake and item.count)
        raise SceneError(all_glass(name))
    for piece, obj in zip(collected.pieces, triangles.objects, strict=True):
        if piece.linking and scene.emission[obj.rows].any():
            warnings += piece.linking
    shining = [light for light in scene.lights if light.strength.any()]
    if not shining and not scene.emission.any():
        if settings.sky:
            scene.lights = (*scene.lights, EnvironmentLight(1.0))
        else:
            warnings.append(_no_light(scene_name))
    if scene.emission.any() or any(isinstance(light, EnvironmentLight) for light in shining):
        warnings += [
            half_visible(piece.source.object_name)
            for piece in collected.pieces
            if piece.role.in_bounces != piece.role.in_shadows and len(piece.mesh)
        ]
    emitter, emitting, emitter_groups = _emitters(scene, surface, collected)
    if settings.light_groups and not any((*collected.groups, *emitter_groups)):
        warnings.append(_no_groups(scene_name))
    # A sky that was added belongs to nobody.
    of_lights = (*collected.groups, *("",) * (len(scene.lights) - len(collected.groups)))
    return Export(
        BakeScene(
            scene,
            tuple(objects),
            tuple(dict.fromkeys(warnings)),
            emitter,
            emitting,
            of_lights,
            emitter_groups,
            tuple(collected.cameras),
        ),
        tuple(sources),
    )


def _without_glass(
    objects: Sequence[BakeObject], pieces: Sequence[Piece], images: SurfaceImages | None
) -> tuple[list[BakeObject], list[ExportSource]]:
    """Return objects and sources that say what of them is glass; what is nothing else gets no lightmap."""
    sources = [piece.source for piece in pieces]
    if images is None or not images.clear.any():
        return list(objects), sources
    found, noted = [], []
    for item, piece, source in zip(objects, pieces, sources, strict=True):
        glass = images.clear[item.rows]
        if glass.any():
            slots = np.maximum(piece.mesh.material, 0)
            only = frozenset(np.unique(slots[glass]).tolist()) - frozenset(np.unique(slots[~glass]).tolist())
            source = replace(source, glass_slots=only)
            item = replace(item, glass=glass, bake=item.bake and not glass.all())
        found.append(item)
        noted.append(source)
    return found, noted


def _emitters(
    scene: Scene, surface: np.ndarray, collected: SceneContents
) -> tuple[np.ndarray, tuple[str, ...], tuple[str, ...]]:
    """Number the materials that emit, each once for every light group that it is in.

    Returns emitter (t,) int32: Whose each triangle is.
    Returns names, groups: The materials', and the light groups they are in.
    """
    names: list[str] = []
    place = []
    on_material = [getattr(material, "group", "") for material in collected.materials]
    for piece in collected.pieces:
        here = {row: piece.groups.of_group(on_material[row]) for row in np.unique(piece.surface)}
        names += [name for name in here.values() if name not in names]
        numbers = np.zeros(len(collected.surfaces), dtype=np.int32)
        numbers[list(here)] = [names.index(name) for name in here.values()]
        place.append(numbers[piece.surface])
    emits = scene.emission.any(axis=1)
    origin = np.stack([surface, np.concatenate(place)], axis=1)[emits]
    rows, number = np.unique(origin, axis=0, return_inverse=True)
    emitter = np.zeros(len(scene), dtype=np.int32)
    emitter[emits] = number.reshape(-1)
    # Without a material nothing emits.
    materials = tuple(getattr(collected.materials[row], "name", "") for row, _ in rows)
    return emitter, materials, tuple(names[group] for _, group in rows)


def chosen_pieces(
    context: bpy.types.Context, pieces: list[Piece], names: tuple[str, ...] | None
) -> list[Piece]:
    """Return the pieces that get a lightmap.

    Raises SceneError, UsageError if there is none, or if one that is given by name can have none.
    """
    if names is None:
        bakeable = [piece for piece in pieces if piece.bakeable]
        if not bakeable:
            linked = [piece for piece in pieces if piece.linked]
            raise SceneError(_linked(linked[0]) if linked else _nothing_to_bake(context))
        return bakeable
    chosen: list[Piece] = []
    for name in names:
        named = pieces_named(pieces, name)
        bakeable = [piece for piece in named if piece.bakeable]
        if not bakeable:
            linked = [piece for piece in named if piece.linked]
            if linked:
                raise SceneError(_linked(linked[0]))
            raise UsageError(_unknown(context, pieces, name))
        chosen += bakeable
    return chosen


def check_names(context: bpy.types.Context, pieces: list[Piece], settings: BakeSettings) -> None:
    """Refuse names of objects to leave out, or without lightmaps, that fit nothing."""
    known = {name for piece in pieces for name in piece.names}
    for option, names in (("--ignore", settings.ignore), ("--light-only", settings.light_only)):
        for name in names:
            # What has no faces, or does not show, is left out anyway.
            if name not in known and name not in context.scene.objects:
                raise UsageError(f"{option}: no object '{name}'" + _did_you_mean(name, known))


def _did_you_mean(name: str, known: set[str]) -> str:
    close = difflib.get_close_matches(name, sorted(known), n=3, cutoff=0.5)
    hint = " or ".join(f"'{match}'" for match in close)
    return f"; did you mean {hint}?" if close else " in this scene"


def _unknown(context: bpy.types.Context, pieces: list[Piece], name: str) -> str:
    """Say why `name` cannot be baked."""
    obj = context.scene.objects.get(name)
    if obj is None:
        known = {known for piece in pieces if piece.bakeable for known in piece.names}
        return f"no object '{name}' to bake" + _did_you_mean(name, known)
    if obj.type not in BAKEABLE_TYPES:
        return f"object '{name}' is not a surface but {obj.type.lower()}; only surfaces get lightmaps"
    roles = [piece.role for piece in pieces if name in piece.names]
    if any(role.mode != BAKE for role in roles):
        return f"object '{name}' is light only or ignored: set it to Bake to give it a lightmap"
    if not roles and (obj.type != "MESH" or len(obj.data.polygons) > 0):
        return f"object '{name}' is hidden from render; show it there to bake it"
    return f"object '{name}' has no faces to bake"


def _check_uv_layers(piece: Piece) -> None:
    if not piece.has_lightmap_layer and piece.uv_layers >= MAX_UV_LAYERS:
        raise SceneError(
            f"object '{piece.source.object_name}' already has {piece.uv_layers} UV layers; "
            "remove one to make room for the lightmap's"
        )


def _degenerate_warning(name: str, count: int) -> BakeWarning:
    which = "a triangle" if count == 1 else f"{count} triangles"
    return BakeWarning(name, f"object '{name}': {which} without area; no light falls there")


def all_glass(name: str) -> str:
    """Return the error for a bake of nothing but glass, of which `name` is some."""
    return f"object '{name}' is glass and gets no lightmap, and nothing else is to be baked: bake others too"


def _no_light(name: str) -> BakeWarning:
    return BakeWarning(
        name, f"scene '{name}' has no light at all: the lightmaps are black; add a lamp or the sky"
    )


def _no_groups(name: str) -> BakeWarning:
    message = f"scene '{name}': no lamp, emissive material or world is in a light group; none is baked"
    return BakeWarning(name, message)


def _nothing_to_bake(context: bpy.types.Context) -> str:
    return f"scene '{context.scene.name}' has nothing to bake: add a mesh with faces, or show one in renders"


def _linked(piece: Piece) -> str:
    return (
        f"object '{piece.source.object_name}' is linked from {piece.source.library or 'a library'}; "
        "make it local or a library override to bake it"
    )
