"""A look at the open scene before it is baked: what will be baked, how large, and what is odd about it.

Meshes and materials are read as a bake reads them, but nothing is rendered, unwrapped or solved: an
office takes a second or two.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...bake import (
    Estimate,
    LightmappedObject,
    estimate_bake,
    may_thin_out,
    process_bytes,
    refuse_large_pages,
    refuse_many_triangles,
    thinned_out,
)
from ...base import RadiosityError
from ...lightmap.unwrap import greedy_object, share_of
from ...lights import Lamp
from ...numerics import folder as scratch_folder
from ...numerics import give_back
from ...options import BakeSettings
from ...scene import LIGHTMAP_UV_LAYER
from ..apply.rebake import originals_shown
from ..cycles.surface_evaluation import foreseen_bytes
from ..files.foreseen_files import file_refusal
from ..material_copies.lightmap_materials import linked_looks
from ..materials.materials import uses_nodes
from ..scene_export.collect import collect
from ..scene_export.export import all_glass, check_names, chosen_pieces
from ..scene_export.page_checks import check_pages
from ..scene_records.object_roles import BAKEABLE_TYPES
from ..scene_records.pieces import Piece, SceneContents
from ..scene_records.render_state import render_depsgraph
from ..session.turned_faces import TurnedFaces
from ..settings.properties import look_of
from .lit_objects import PieceShape, glass_materials, lit_objects, lit_sides, piece_shape
from .shape_checks import coincident_warnings, faces_of, inside_out_warnings, unlit_scene

if TYPE_CHECKING:
    from ..cycles.lamps import LampFactors
    from ..files.output import OutputFolder

ERROR, WARNING, INFO = "ERROR", "WARNING", "INFO"
"""The bake would stop; the result may disappoint; worth knowing."""

TINY_TEXELS = 64
"""Objects with fewer texels are called tiny: 8 × 8."""

MAX_BLACK = 0.01
"""What reflects less is called black."""

ODD_SCALE = 100.0
"""Scales that were not applied are reported from here on, and from its inverse down."""

HUGE, MINUTE = 5000.0, 0.02
"""Sizes of a scene [m] that look like a mistaken unit."""

NOTED_FILES = 1e9
"""Temporary files are reported from this size on [bytes]."""

MAX_NAMED = 3
"""So many objects are named in a finding."""


@dataclass(frozen=True)
class Finding:
    """Something odd: how bad (`ERROR`, `WARNING`, `INFO`), whose it is, and what to do."""

    level: str
    name: str
    message: str


@dataclass(frozen=True)
class Inspection:
    """What a bake of the scene will be.

    Parameters
    ----------
    objects, triangles : int
        That get lightmaps.
    scene_triangles : int
        All, what only lights and blocks among them.
    estimate : Estimate
    findings : tuple of Finding
        The worst first.
    turned : tuple of TurnedFaces
        Faces that the findings name.
    """

    objects: int
    triangles: int
    scene_triangles: int
    estimate: Estimate
    findings: tuple[Finding, ...]
    turned: tuple[TurnedFaces, ...] = ()

    @property
    def texels(self) -> int:
        """About how many texels will be lit."""
        return round(sum(self.estimate.texels))

    @property
    def is_odd(self) -> bool:
        """Whether there is something to look at before time is spent."""
        return any(finding.level != INFO for finding in self.findings)


def inspect(
    context: bpy.types.Context,
    settings: BakeSettings,
    folder: Path | None,
    output: OutputFolder | None = None,
    files: Collection[str] = (),
) -> Inspection:
    """Look at the context's scene.

    Parameters
    ----------
    context : Context
    settings : BakeSettings
        Of the bake to be.
    folder : Path or None
        Where it would write; None where it packs.
    output : OutputFolder or None
        The same as the bake would have it; None if it is not known which files there are.
    files : collection of str
        What it would write besides lightmaps and the report.

    Raises
    ------
    SceneError
        If a coordinate is NaN or infinite.
    """
    factors: LampFactors = {}
    with originals_shown(context) as edited, render_depsgraph(context) as depsgraph:
        collected = collect(depsgraph, factors, settings)
    findings = [Finding(WARNING, warning.name, warning.message) for warning in edited]
    try:
        check_names(context, collected.pieces, settings)
        chosen = chosen_pieces(context, collected.pieces, settings.objects)
        check_pages(chosen, settings)
    except RadiosityError as error:
        chosen = []
        findings.append(Finding(ERROR, context.scene.name, str(error)))
    shapes = {id(piece): piece_shape(piece) for piece in collected.pieces if len(piece.mesh)}
    lit = lit_objects(chosen, shapes, collected, settings.keep_uvs)
    if chosen and not lit:
        findings.append(Finding(ERROR, chosen[0].source.name, all_glass(chosen[0].source.name)))
    triangles = sum(len(piece.mesh) for piece in collected.pieces)
    faces = lit_sides(collected.pieces, collected)
    give_back()
    textures = foreseen_bytes(collected.surfaces, settings)
    emits = np.array([surface.emission.any() for surface in collected.surfaces], dtype=bool)
    sources = sum(isinstance(light, Lamp) for light in collected.lights)
    sources += sum(bool(emits[piece.surface].any()) for piece in collected.pieces)
    plan = estimate_bake(lit, triangles, settings, faces, textures, sources)
    findings += _of_memory(plan, triangles, faces, textures, settings)
    refused = None if output is None else file_refusal(output, settings, collected, chosen, files)
    if refused is not None:
        findings.append(Finding(ERROR, "file", refused))
    shown = unlit_scene(collected, chosen)
    inside_out = inside_out_warnings(shown)
    findings += [
        *_of_the_file(folder),
        *_of_light(context, collected, settings),
        *_of_glass(collected),
        *_of_visibility(context),
        *_of_layers(chosen, settings),
        *(Finding(WARNING, each.name, each.message) for each in linked_looks(look_of(context.scene))),
        *_of_texels(lit, plan, settings),
        *_of_scales(collected),
        *_of_size(shapes),
        *(Finding(WARNING, warning.name, warning.message) for warning in inside_out),
        *(Finding(INFO, warning.name, warning.message) for warning in collected.warnings),
        *(Finding(INFO, warning.name, warning.message) for warning in coincident_warnings(shown)),
    ]
    findings.sort(key=lambda finding: (ERROR, WARNING, INFO).index(finding.level))
    return Inspection(
        objects=len(lit),
        triangles=sum(item.triangles for item in lit),
        scene_triangles=triangles,
        estimate=plan,
        findings=tuple(dict.fromkeys(findings)),
        turned=faces_of(inside_out, shown, collected),
    )


def _of_glass(collected: SceneContents) -> Iterator[Finding]:
    """Name the materials that are glass."""
    names = glass_materials(collected)
    if names:
        listed = ", ".join(f"'{name}'" for name in names)
        message = f"light goes straight through glass, which gets no lightmap: {listed}"
        yield Finding(INFO, names[0], message)


def _of_the_file(folder: Path | None) -> Iterator[Finding]:
    """Say where lightmaps go, where that may surprise."""
    if folder is None:
        message = "the file is not saved: lightmaps will be packed into it; save it to write them to files"
        yield Finding(INFO, "file", message)
        return
    # `Path.exists` raises for a name that is too long.
    existing = next(each for each in (folder, *folder.parents) if os.path.exists(each))  # noqa: PTH110
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        yield Finding(ERROR, "file", f"cannot write to the output folder '{folder}': choose another")


def _of_light(
    context: bpy.types.Context, collected: SceneContents, settings: BakeSettings
) -> Iterator[Finding]:
    """Say whether anything shines, and which surfaces are black."""
    shown = {row for piece in collected.pieces for row in np.unique(piece.surface).tolist()}
    surfaces = [(row, collected.surfaces[row]) for row in sorted(shown)]
    emits = any(surface.emission.any() or surface.varies for _, surface in surfaces)
    if not collected.lights and not emits and not _shines(context.scene.world):
        scene = context.scene.name
        if settings.sky:
            yield Finding(INFO, scene, f"scene '{scene}' has no light: a white sky will be added")
        else:
            message = (
                f"scene '{scene}' has no light at all: the lightmaps will be black; add a lamp or the sky"
            )
            yield Finding(WARNING, scene, message)
    for row, surface in surfaces:
        material = collected.materials[row]
        black = surface.reflectance.max() < MAX_BLACK and not surface.emission.any() and not surface.varies
        if material is not None and black and surface.opacity > 0 and not surface.is_clear:
            message = f"material '{material.name}' is black: surfaces with it look black in any light"
            yield Finding(INFO, material.name, message)


def _shines(world: bpy.types.World | None) -> bool:
    """Return whether a world may give light, without rendering it."""
    if world is None:
        return False
    if not uses_nodes(world):
        return any(world.color)
    backgrounds = [node for node in world.node_tree.nodes if node.type in {"BACKGROUND", "EMISSION"}]
    if not backgrounds:
        return bool(world.node_tree.links)
    return any(_may_shine(node) for node in backgrounds)


def _may_shine(node: bpy.types.Node) -> bool:
    color, strength = node.inputs["Color"], node.inputs["Strength"]
    return (strength.is_linked or strength.default_value > 0) and (
        color.is_linked or any(color.default_value[:3])
    )


def _of_visibility(context: bpy.types.Context) -> Iterator[Finding]:
    """Name what is baked though it is not seen in the viewport, and what is seen and not baked."""
    surfaces = [obj for obj in context.view_layer.objects if obj.type in BAKEABLE_TYPES]
    left_out = [obj.name for obj in surfaces if obj.hide_render and obj.visible_get()]
    unseen = [obj.name for obj in surfaces if not obj.hide_render and not obj.visible_get()]
    if left_out:
        message = f"{_names(left_out)} hidden from renders but seen here: left out of the bake"
        yield Finding(WARNING, left_out[0], message)
    if unseen:
        message = f"{_names(unseen)} hidden in the viewport but not from renders: part of the bake"
        yield Finding(WARNING, unseen[0], message)


def _of_layers(chosen: Sequence[Piece], settings: BakeSettings) -> Iterator[Finding]:
    """Say whose UV layers are missing or too many."""
    full = [piece.source.name for piece in chosen if not piece.has_lightmap_layer and piece.uv_layers >= 8]
    if full:
        yield Finding(
            ERROR, full[0], f"{_names(full)} without room for another UV layer: remove one of the eight"
        )
    without = [piece.source.name for piece in chosen if piece.uv_layers == 0]
    if without:
        message = f"{_names(without)} without UVs: '{LIGHTMAP_UV_LAYER}' becomes the first layer"
        yield Finding(INFO, without[0], message)
    if settings.keep_uvs:
        new = [piece.source.name for piece in chosen if not piece.has_lightmap_layer]
        if new:
            message = f"{_names(new)} without a UV layer '{LIGHTMAP_UV_LAYER}' to keep: they are unwrapped"
            yield Finding(WARNING, new[0], message)


def _of_texels(lit: Sequence[LightmappedObject], plan: Estimate, settings: BakeSettings) -> Iterator[Finding]:
    """Name objects that get hardly any texels, and one that gets nearly all."""
    tiny = [
        item.name
        for item, texels in zip(lit, plan.texels, strict=True)
        if item.area > 0 and texels < TINY_TEXELS
    ]
    names = [item.name for item in lit]
    # Where the density is given, nobody takes texels from others.
    greedy = greedy_object(names, plan.texels) if may_thin_out(settings) else None
    for warning in thinned_out(names, plan.thinned, plan.texels):
        yield Finding(WARNING, warning.name, warning.message)
    if tiny:
        advice = (
            "raise the resolution, the texel density or the texel scale"
            if greedy is None
            else f"'{greedy}' takes nearly all of them"
        )
        yield Finding(WARNING, tiny[0], f"{_names(tiny)} about to get fewer than 8 × 8 texels: {advice}")
    if greedy is not None:
        taken = share_of(max(plan.texels), sum(plan.texels))
        message = (
            f"object '{greedy}' takes {taken} of all texels: lower its texel scale, or set it to Light Only, "
            "to leave more to the others"
        )
        yield Finding(WARNING, greedy, message)


def _of_scales(collected: SceneContents) -> Iterator[Finding]:
    """Name scales that look forgotten."""
    for piece in collected.pieces:
        scale = np.linalg.norm(piece.matrix[:3, :3], axis=0)
        odd = scale.max() > ODD_SCALE or scale.min() < 1.0 / ODD_SCALE
        if odd and len(piece.mesh) and not piece.source.is_instance:
            factors = " × ".join(f"{value:g}" for value in scale)
            message = f"object '{piece.source.name}' has a scale of {factors}: apply it if that is a mistake"
            yield Finding(WARNING, piece.source.name, message)


def _of_size(shapes: dict[int, PieceShape]) -> Iterator[Finding]:
    """Doubt the unit of a scene of an unlikely size."""
    if not shapes:
        return
    boxes = np.array([shape.box for shape in shapes.values()])
    size = float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max())
    if size > HUGE or size < MINUTE:
        extent = f"{size / 1000:.3g} km" if size > HUGE else f"{1000 * size:.3g} mm"
        yield Finding(
            WARNING,
            "scene",
            f"the scene is {extent} large: lamps and texels are in meters, so check the unit scale",
        )


def _of_memory(
    plan: Estimate, triangles: int, faces: int, textures: float, settings: BakeSettings
) -> Iterator[Finding]:
    """Say whether triangles or pages exceed the memory limit, and whether memory or disk may not do."""
    try:
        refuse_many_triangles(triangles, faces, settings, textures)
        refuse_large_pages(plan.pages, settings)
    except RadiosityError as error:
        yield Finding(ERROR, "memory", str(error))
        return
    if plan.files > NOTED_FILES:
        disk = shutil.disk_usage(scratch_folder()).free
        message = (
            f"about {plan.files / 1e9:.1f} GB of temporary files will be written to '{scratch_folder()}'"
        )
        if plan.files > disk:
            message += f", where {disk / 1e9:.1f} GB are free: free some, or raise the memory limit"
        yield Finding(WARNING if plan.files > disk else INFO, "memory", message)
    free, more = free_memory(), plan.memory - process_bytes()
    if free is not None and more > free:
        message = (
            f"about {more / 2**30:.1f} GiB more will be needed and {free / 2**30:.1f} GiB are free: "
            "lower the resolution or the quality"
        )
        yield Finding(WARNING, "memory", message)


def free_memory() -> float | None:
    """Return the memory that is free [bytes]; None if the system does not report it."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        values = {line.split(":")[0]: float(line.split()[1]) for line in lines}
        return 1024.0 * values["MemAvailable"]
    except (OSError, KeyError, ValueError, IndexError):
        return None


def _names(names: Sequence[str]) -> str:
    """Say which objects, with the verb: "object 'A' is", "5 objects ('A', 'B', 'C' …) are"."""
    if len(names) == 1:
        return f"object '{names[0]}' is"
    named = ", ".join(f"'{name}'" for name in names[:MAX_NAMED])
    return f"{len(names)} objects ({named}{' …' if len(names) > MAX_NAMED else ''}) are"
