"""A kept bake in a file beside its lightmaps: what lights it anew when Blender was closed meanwhile.

Only what relighting reads is stored. The geometry itself is not: the scene brings it again, and its
objects must be those of the bake.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from ...base import BakeError, RadiosityError
from ...files import BAKE, DIGEST, FILE, KEPT
from ...files import SIDECAR_NAME as SIDECAR_NAME
from ...lightmap.images import LightmapPage, Seams
from ...lightmap.lighting import EarlierLight, LitTexels, PartLinks, Parts, StoredLinks, TexelTransport
from ...lightmap.points import Interpolation
from ...lightmap.texels import TexelGeometry
from ...lights import AreaLight, EnvironmentImage, EnvironmentLight, PointLight, SkyPatch, SpotLight, SunLight
from ...options import BakeSettings
from ...scene import BakeScene, Faces
from ...solver.balance import Balance
from ...solver.element_transport import ElementTransport, Relightable
from ...solver.emitters import EmitterGroup, LightSources
from ...solver.gather import AimedRays, LightGains, LocalPass
from ...solver.hierarchy import Clusters, Hierarchy, TreeTop
from ...solver.links import ClusterLinks, LightLinks, Links
from ...solver.methods import HierarchicalState
from ...solver.settings import SolverSettings
from ..relight import DAMAGED, KeptBake, damaged
from ..result import BakedObject, BakeResult
from ..scene_diff import RELIGHTABLE, SceneRecord, compare, scene_record
from .array_file import ArrayFileError, TooLargeError, read_arrays, read_digest, write_arrays
from .plain_objects import flatten, restore
from .sidecar_checks import check_stored, stored_layout

MAGIC, VERSION = b"RADIOSITYRELIGHT", 2
"""Version 1 did not know textures, and what solving stores may differ from it."""

OF_SOURCES = ("emitter", "emitter_names", "light_groups", "emitter_groups")
"""What a scene says of its sources beside their strengths: it stays as it was baked."""


def _all(kind: Any) -> tuple[str, ...]:
    return tuple(entry.name for entry in fields(kind))


_LIGHTS = (PointLight, SpotLight, SunLight, AreaLight, EnvironmentLight, EnvironmentImage, SkyPatch)

STORED: Mapping[type, Sequence[str]] = {
    **{kind: _all(kind) for kind in _LIGHTS},
    **{
        kind: _all(kind)
        for kind in (SolverSettings, LightLinks, Interpolation, AimedRays, Seams, Relightable)
    },
    **{kind: _all(kind) for kind in (StoredLinks, TexelTransport, LitTexels, Balance, Parts)},
    PartLinks: ("rows", "sources", "reflectance", "gains"),
    Links: ("receiver", "source", "factor", "visibility", "to_quarter", "of_quarter"),
    ClusterLinks: ("receiver", "source", "vector", "gradient", "even"),
    Clusters: ("order", "start", "children", "area", "centre", "levels"),
    TreeTop: (
        *("row", "n_inner", "n_rows", "tip", "_clusters", "_area"),
        *("_start", "_children", "_levels"),
    ),
    Faces: ("triangle", "normal", "centre", "area"),
    Hierarchy: (
        *("faces", "clusters", "face", "first_child", "level"),
        *("area", "reflectance", "emission", "opacity"),
    ),
    HierarchicalState: (
        *("settings", "hierarchy", "power", "links", "cluster_links", "top", "balance", "residual"),
        *("iterations", "over_budget", "faint", "started"),
    ),
    LightSources: ("lights", "emitter", "groups", "strengths", "_owner", "_single"),
    EmitterGroup: ("strength",),
    ElementTransport: ("_state", "_sources", "_light_links"),
    LocalPass: ("sources", "threads", "_state", "_seed"),
    LightGains: ("_count", "_of"),
    EarlierLight: ("_known",),
    TexelGeometry: ("page", "triangle", "centre_inside", "index", "_first", "uv", "page_of_triangle"),
}
"""What is stored of each class: all that relighting reads."""

DROPPED: Mapping[type, Sequence[str]] = {
    PartLinks: ("lamps",),
    Links: ("doubt",),
    ClusterLinks: ("factor", "visibility", "doubt"),
    TreeTop: ("kept", "tips"),
    HierarchicalState: (
        *("scene", "caster", "light_links", "irradiance", "radiosity"),
        *("history", "details", "conservation"),
    ),
    LocalPass: ("caster", "emitters"),
}
"""What only a bake needs, for which None stands."""


@dataclass(frozen=True, eq=False)
class StoredBake:
    """A bake as its sidecar has it, not yet tied to a scene.

    Attributes
    ----------
    mark : str
        The bake's own, which whoever wrote it knows it by.
    settings : BakeSettings
    path : Path
        Its file, for messages.
    """

    mark: str
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
        now = scene_record(bake_scene)
        compare(SceneRecord(stored["objects"], now.lights), now).refuse_all_but(RELIGHTABLE)
        baked = sum(item.bake and item.count > 0 for item in bake_scene.objects)
        if stored_layout(stored) != (len(bake_scene.scene), baked):
            raise damaged(self.path)
        scene = copy(bake_scene.scene)
        scene.emission, scene.lights = stored["emission"], stored["solved"].sources.lights
        return KeptBake(
            replace(bake_scene, scene=scene, **stored["of_sources"]),
            self.settings,
            solved=stored["solved"],
            lit=stored["lit"],
            geometry=stored["geometry"],
            seams=stored["seams"],
            rings=stored["rings"],
            reflectance=stored["texel_reflectance"],
            emission=stored["texel_emission"],
            origin=str(self.path),
        )

    def result(self, bake_scene: BakeScene, pages: tuple[LightmapPage, ...]) -> BakeResult:
        """Return other pages as the result of a bake, laid out as it was."""
        geometry, report = self._stored["geometry"], self._stored["report"]
        baked = [item for item in bake_scene.objects if item.bake and item.count]
        objects = tuple(
            BakedObject(item, geometry.uv[item.rows], page)
            for item, page in zip(baked, self._stored["pages"], strict=True)
        )
        return BakeResult(pages, objects, report["solver"], bake_scene.warnings, {}, report["atlas"])


def write_sidecar(path: Path, kept: KeptBake, result: BakeResult, mark: str) -> int:
    """Write a kept bake to a file; return the bytes that it takes.

    Parameters
    ----------
    result : BakeResult
        The bake's.
    mark : str
        See `StoredBake`.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    state = kept.solved.elements.state
    # Balanced links stand for those that were measured.
    skipped = [] if state.balance is None else [(state, "links")]
    stored = {
        "mark": mark,
        "settings": asdict(kept.settings),
        "objects": kept.record.objects,
        "emission": kept.bake_scene.scene.emission,
        "of_sources": {name: getattr(kept.bake_scene, name) for name in OF_SOURCES},
        "pages": [item.page for item in result.objects],
        "report": {"solver": {**result.solver, "history": []}, "atlas": result.atlas},
        "solved": kept.solved,
        "lit": replace(kept.lit, earlier=kept.lit.earlier.first()),
        "geometry": kept.geometry,
        "seams": kept.seams,
        "rings": kept.rings,
        "texel_reflectance": kept.reflectance,
        "texel_emission": kept.emission,
    }
    told, arrays = flatten(stored, STORED, skipped)
    try:
        return write_arrays(path, MAGIC, VERSION, told, arrays)
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
        If there is none, it is damaged or of another version, or would take too much memory.
    """
    most = int((memory_limit or SolverSettings.memory_limit) * (1 << 30))
    try:
        told, arrays = read_arrays(path, MAGIC, VERSION, most)
        stored = restore(told, arrays, STORED, DROPPED)
        check_stored(stored)
        return StoredBake(stored["mark"], BakeSettings(**stored["settings"]), path, stored)
    except FileNotFoundError:
        raise BakeError(f"there is no '{path}': bake with a sidecar to light that bake anew") from None
    except OSError as error:
        raise BakeError(f"cannot read '{path}': {error.strerror}") from error
    except TooLargeError as error:
        raise BakeError(f"'{path}' is not used: {error}; raise the limit, or bake again") from error
    except ArrayFileError as error:
        raise BakeError(f"'{path}' is not used: {error}; bake again") from error
    except (*DAMAGED, RadiosityError) as error:
        raise damaged(path) from error


def sidecar_entry(path: Path, mark: str) -> dict[str, str]:
    """Return what a report tells of the bake that was kept in a sidecar beside it.

    Raises
    ------
    BakeError
        If the sidecar cannot be read.
    """
    try:
        return {BAKE: mark, DIGEST: read_digest(path, MAGIC, VERSION), FILE: path.name}
    except OSError as error:
        raise BakeError(f"cannot read '{path}': {error.strerror}") from error
    except ArrayFileError as error:
        raise BakeError(f"'{path}' is not used: {error}; bake again") from error


def check_belongs(stored: StoredBake, report: Path) -> None:
    """Refuse a sidecar that the report beside it does not name as that of its bake.

    Raises
    ------
    BakeError
    """
    try:
        told = json.loads(report.read_text(encoding="utf-8"))
        kept = told.get(KEPT) if isinstance(told, dict) else None
    except (OSError, ValueError, RecursionError):
        raise BakeError(f"'{report}' cannot be read, or is no report: bake again, with --keep") from None
    if not isinstance(kept, dict):
        raise BakeError(
            f"'{stored.path}' is older than the bake of '{report}', which was not kept: bake again"
        )
    if kept.get(BAKE) != stored.mark or kept != sidecar_entry(stored.path, stored.mark):
        raise BakeError(f"'{stored.path}' belongs to another bake than '{report}': bake again")
