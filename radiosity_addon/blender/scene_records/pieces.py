"""What a scene holds as plain records: meshes at places, surfaces, lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base import BakeWarning, SceneError
from ...lights import Light
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.mesh_arrays import MeshArrays, RawMesh, all_finite, no_triangles, not_finite_message
from ..materials.materials import DEFAULT_GRAY, Surface
from ..materials.shading_inputs import MeshValues
from .export_sources import ExportSource, MaterialSource
from .light_membership import PlaceGroups
from .object_roles import BAKE, IGNORE, Role


@dataclass(frozen=True, eq=False)
class CoarseLevel:
    """A coarser level of detail.

    base: The name of the finest one, whose lightmap it shows.
    matrix (4, 4): Of the finest one.
    mesh: Its own triangles; the scene has none of them.
    """

    base: str
    matrix: np.ndarray
    mesh: MeshArrays


@dataclass(frozen=True)
class Piece:
    """One mesh at one place.

    Parameters
    ----------
    source : ExportSource
    mesh : MeshArrays
    matrix : (4, 4) float64
    surface : (t,) int32
        Rows of `SceneContents.surfaces`.
    role : Role
        Of what is ignored, `mesh` is empty.
    asked : frozenset of str
        What its materials' nodes ask for, of those that vary; see `shading_inputs`.
    inputs : dict of str to (t, 3, 4) or (4,) float32
        What was found of it: not what follows from `mesh` and `matrix`, nor what is missing.
    bakeable : bool
        It may get a lightmap, if requested: the object is editable.
    linked : bool
        It would be bakeable, were it not linked from a library.
    uv_layers : int
        The UV layers of the mesh that would get another.
    has_lightmap_layer : bool
    linking : tuple of BakeWarning
        What is not followed, should it emit.
    groups : PlaceGroups
        The light group of what it emits.
    level : CoarseLevel or None
        Of a coarser level of detail, whose `mesh` is empty.
    """

    source: ExportSource
    mesh: MeshArrays
    matrix: np.ndarray
    surface: np.ndarray
    role: Role
    asked: frozenset[str]
    inputs: dict[str, np.ndarray]
    bakeable: bool
    linked: bool
    uv_layers: int
    has_lightmap_layer: bool
    linking: tuple[BakeWarning, ...]
    groups: PlaceGroups
    level: CoarseLevel | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The names by which a user may ask for it."""
        return names_of(self.source)


@dataclass(frozen=True, eq=False)
class Found:
    """One mesh at one place, as it was copied; see `Piece`.

    Parameters
    ----------
    raw : RawMesh or None
        None of what is ignored.
    slots : (s,) int
        Rows of surfaces, in the order in which they were found.
    empty : tuple of bool
        Which of the slots have no material; none where a material is put over all.
    """

    source: ExportSource
    shown: str
    raw: RawMesh | None
    matrix: np.ndarray
    slots: np.ndarray
    empty: tuple[bool, ...]
    role: Role
    asked: frozenset[str]
    mesh_inputs: MeshValues
    inputs: dict[str, np.ndarray]
    can_bake: bool
    library: bool
    owner: str
    layers: frozenset[str]
    linking: tuple[BakeWarning, ...]
    groups: PlaceGroups


@dataclass(frozen=True)
class SceneContents:
    """All that was found. `surfaces` and `materials` are indexed by `Piece.surface`.

    `groups` are the lights' light groups, parallel to them, "" for those in none; `cameras` are the places of
    cameras.
    """

    pieces: list[Piece]
    surfaces: list[Surface]
    materials: list[MaterialSource | None]
    lights: list[Light]
    warnings: list[BakeWarning]
    groups: list[str]
    cameras: list[tuple[float, float, float]]


def piece_of(
    found: Found, mesh: MeshArrays | None, rows: np.ndarray, collected: SceneContents
) -> Piece | None:
    """Make a piece of what was found, if it is one, and add its warnings."""
    role, name = found.role, found.source.name
    surface, asked = np.zeros(0, dtype=np.int32), found.asked
    inputs = {**found.mesh_inputs, **found.inputs}
    if mesh is not None and len(rows):
        # A face whose slot does not exist shows the last one, as in Blender.
        surface = rows[np.clip(mesh.material, 0, len(rows) - 1)]
        shown = np.unique(surface)
        if len(shown) and all(collected.surfaces[row].is_volume for row in shown):
            # All there is of it is what fills it.
            role, mesh, surface = role._replace(mode=IGNORE), no_triangles(), surface[:0]
            asked, inputs = frozenset(), {}
    if mesh is None or not all_finite(found.matrix):
        raise SceneError(not_finite_message(found.shown))
    if len(mesh) == 0 and role.mode != IGNORE:
        return None
    used = np.unique(np.clip(mesh.material, 0, max(len(found.empty) - 1, 0)))
    if any(found.empty[slot] for slot in used if slot < len(found.empty)):
        message = f"object '{name}' has an empty material slot; gray {DEFAULT_GRAY} is used"
        collected.warnings.append(BakeWarning(name, message))
    can_bake = found.can_bake and role.mode == BAKE
    if can_bake and found.library:
        collected.warnings.append(_linked(found.owner))
    collected.warnings.extend(role.warnings)
    return Piece(
        source=found.source,
        mesh=mesh,
        matrix=found.matrix,
        surface=surface,
        asked=asked,
        inputs=inputs,
        role=role,
        bakeable=can_bake and not found.library,
        linked=can_bake and found.library,
        uv_layers=max(mesh.uv_layers, len(found.layers)),
        has_lightmap_layer=mesh.lightmap_uv is not None or LIGHTMAP_UV_LAYER in found.layers,
        linking=found.linking,
        groups=found.groups,
    )


def names_of(source: ExportSource) -> tuple[str, ...]:
    """Return the names by which a user may ask for what a source shows."""
    return tuple(filter(None, (source.name, source.object_name, source.instancer)))


def _linked(name: str) -> BakeWarning:
    what = f"object '{name}' is linked from a library: it lights and blocks but gets no lightmap"
    return BakeWarning(name, f"{what}; make it local or a library override to bake it")
