"""A kept bake in a file next to its lightmaps: what relights it after Blender was closed.

Only what relighting reads is stored. The geometry itself is not: the scene brings it again, and its
objects must be those of the bake.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import copy
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ...base import BakeError, RadiosityError
from ...files import BAKE, DIGEST, FILE, KEPT
from ...lightmap.images import LightmapPage, Seams
from ...lightmap.points import Interpolation, Smoothing
from ...lightmap.texels import TexelGeometry
from ...lightmap.transport import (
    GatherLinks,
    RelightableTexels,
    SubCellLinks,
    SubCells,
    TexelTransport,
    WarmStart,
)
from ...lights import AreaLight, EnvironmentImage, EnvironmentLight, PointLight, SkyPatch, SpotLight, SunLight
from ...numerics import ArrayFileError, TooLargeError, read_arrays, read_digest, write_arrays
from ...options import BakeSettings
from ...scene import BakeScene, Faces
from ...solver.element_transport import ElementTransport, Relightable
from ...solver.emitters import EmitterGroup, LightSources
from ...solver.gather import AimedRays, CompactGains, LightGains, LocalPass, RunGains
from ...solver.hierarchy import Clusters, Hierarchy
from ...solver.links import ClusterLinks, LightLinks, Links
from ...solver.methods import HierarchicalState
from ...solver.settings import SolverSettings
from ..bake_warnings import coincident_counts, of_coincident, small_objects
from ..levels import with_levels
from ..relight import DAMAGED, KeptBake, damaged
from ..result import BakeResult, baked_with_figures
from ..scene_diff import RELIGHTABLE, SceneRecord, compare, scene_record
from ..turned_faces import of_inside_out
from .plain_objects import flatten, restore
from .sidecar_checks import check_stored, stored_layout

MAGIC, FORMAT = b"RADIOSITYRELIGHT", 7
"""The format rises with every change of the stored fields (`plain_objects.stored_names`)."""

OF_SOURCES = ("emitter", "emitter_names", "light_groups", "emitter_groups")
"""What a scene says of its sources besides their strengths: it stays as it was baked."""

STORED_CLASSES: tuple[type, ...] = (
    *(PointLight, SpotLight, SunLight, AreaLight, EnvironmentLight, EnvironmentImage, SkyPatch),
    *(LightSources, EmitterGroup, SolverSettings, ElementTransport, HierarchicalState),
    *(Hierarchy, Faces, Clusters, Links, ClusterLinks, LightLinks),
    *(RelightableTexels, TexelTransport, GatherLinks, AimedRays, Interpolation, SubCells, SubCellLinks),
    *(LightGains, CompactGains, RunGains, WarmStart, Smoothing, TexelGeometry, Seams),
)
"""The classes that may be stored: those that relighting reads."""


@dataclass(frozen=True, eq=False)
class StoredBake:
    """A bake as its sidecar has it, not yet tied to a scene.

    Attributes
    ----------
    bake_id : str
        The bake's own, which its images and its report carry as well.
    settings : BakeSettings
    path : Path
        Its file, for messages.
    """

    bake_id: str
    settings: BakeSettings
    path: Path
    _stored: Mapping[str, Any]

    def kept(self, bake_scene: BakeScene) -> KeptBake:
        """Return the kept bake of a scene that differs in light alone.

        Raises
        ------
        SceneError
            If anything else differs; the message names it.
        BakeError
            If the file is not of the scene that it says it is of.
        """
        stored = self._stored
        present = scene_record(bake_scene)
        compare(SceneRecord(stored["objects"], present.lights), present).refuse_all_but(RELIGHTABLE)
        baked = sum(item.bake and item.count > 0 for item in bake_scene.objects)
        if stored_layout(stored) != (len(bake_scene.scene), baked):
            raise damaged(self.path)
        scene = copy(bake_scene.scene)
        scene.emission, scene.lights = stored["emission"], stored["elements"].sources.lights
        return KeptBake(
            replace(bake_scene, scene=scene, **stored["of_sources"]),
            self.settings,
            solved=_solved(stored["elements"]),
            lit=stored["lit"],
            geometry=stored["geometry"],
            seams=stored["seams"],
            rings=stored["rings"],
            reflectance=stored["texel_reflectance"],
            emission=stored["texel_emission"],
            origin=str(self.path),
        )

    def result(self, bake_scene: BakeScene, pages: tuple[LightmapPage, ...], error: float) -> BakeResult:
        """Return other pages as the result of a bake, laid out as it was.

        What is of the light that was baked is left out: powers, and warnings of faces lit from behind.

        Parameters
        ----------
        error : float
            The estimate of theirs.
        """
        geometry, report, scene = self._stored["geometry"], self._stored["report"], bake_scene.scene
        baked = [item for item in bake_scene.objects if item.bake and item.count]
        objects = baked_with_figures(baked, self._stored["pages"], geometry, scene.areas)
        coincident = coincident_counts(baked, scene)
        of_texels = small_objects(bake_scene, baked, geometry)
        of_faces = (*of_coincident(coincident), *of_inside_out(bake_scene))
        solver = {key: value for key, value in report["solver"].items() if key != "power_W"}
        return BakeResult(
            pages,
            with_levels(bake_scene, objects),
            {**solver, "estimated_error": error},
            (*bake_scene.warnings, *of_texels, *of_faces),
            atlas=report["atlas"],
            coincident=coincident,
        )


def write_sidecar(path: Path, kept: KeptBake, result: BakeResult, bake_id: str) -> int:
    """Write a kept bake to a file; return the bytes that it takes.

    Parameters
    ----------
    result : BakeResult
        The bake's.
    bake_id : str
        See `StoredBake`.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    stored = {
        "bake_id": bake_id,
        "settings": asdict(kept.settings),
        "objects": kept.record.objects,
        "emission": kept.bake_scene.scene.emission,
        "of_sources": {name: getattr(kept.bake_scene, name) for name in OF_SOURCES},
        "pages": [item.page for item in result.objects if item.object.level is None],
        "report": {"solver": {**result.solver, "history": []}, "atlas": result.atlas},
        "elements": kept.solved.elements,
        "lit": replace(kept.lit, warm_start=kept.lit.warm_start.first()),
        "geometry": kept.geometry,
        "seams": kept.seams,
        "rings": kept.rings,
        "texel_reflectance": kept.reflectance,
        "texel_emission": kept.emission,
    }
    description, arrays = flatten(stored, STORED_CLASSES)
    try:
        return write_arrays(path, MAGIC, FORMAT, description, arrays)
    except OSError as error:
        raise BakeError(f"cannot write '{path}': {error.strerror}") from error


def read_sidecar(path: Path, memory_limit: float | None = None) -> StoredBake:
    """Read a kept bake from a file.

    Parameters
    ----------
    memory_limit : float or None
        GiB that it may take; None takes the default of bakes.

    Raises
    ------
    BakeError
        If there is none, it is damaged or of another format, or would take too much memory.
    """
    most = int((memory_limit or SolverSettings.memory_limit) * (1 << 30))
    try:
        description, arrays = read_arrays(path, MAGIC, FORMAT, most)
        stored = restore(description, arrays, STORED_CLASSES)
        check_stored(stored)
        return StoredBake(stored["bake_id"], BakeSettings(**stored["settings"]), path, stored)
    except FileNotFoundError:
        raise BakeError(f"there is no '{path}': bake with --keep to relight the bake later") from None
    except OSError as error:
        raise BakeError(f"cannot read '{path}': {error.strerror}") from error
    except TooLargeError as error:
        raise BakeError(f"'{path}' is not used: {error}; raise the limit, or bake again") from error
    except ArrayFileError as error:
        raise BakeError(f"'{path}' is not used: {error}; bake again") from error
    except (*DAMAGED, RadiosityError) as error:
        raise damaged(path) from error


def _solved(elements: ElementTransport) -> Relightable:
    """Make what is not stored of a solved scene that was read and checked."""
    state = elements.state
    if state.sent is not None:
        state.cut = state.linked_cut()
    return Relightable(elements.sources, elements, LocalPass.of(state, elements.sources))


def sidecar_entry(path: Path, bake_id: str) -> dict[str, str]:
    """Return what a report says of the bake that was kept in a sidecar next to it.

    Raises
    ------
    BakeError
        If the sidecar cannot be read.
    """
    try:
        return {BAKE: bake_id, DIGEST: read_digest(path, MAGIC, FORMAT), FILE: path.name}
    except OSError as error:
        raise BakeError(f"cannot read '{path}': {error.strerror}") from error
    except ArrayFileError as error:
        raise BakeError(f"'{path}' is not used: {error}; bake again") from error


def check_belongs(stored: StoredBake, report: Path) -> None:
    """Refuse a sidecar that the report next to it does not name as that of its bake.

    Raises
    ------
    BakeError
    """
    try:
        data = json.loads(report.read_text(encoding="utf-8"))
        kept = data.get(KEPT) if isinstance(data, dict) else None
    except (OSError, ValueError, RecursionError):
        raise BakeError(f"'{report}' cannot be read, or is no report: bake again, with --keep") from None
    if not isinstance(kept, dict):
        raise BakeError(
            f"'{stored.path}' is older than the bake of '{report}', which was not kept: bake again"
        )
    if kept.get(BAKE) != stored.bake_id or kept != sidecar_entry(stored.path, stored.bake_id):
        raise BakeError(f"'{stored.path}' belongs to another bake than '{report}': bake again")
