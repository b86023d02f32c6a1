"""Where the light's power goes: emitted, absorbed, and escaped from the scene.

The escaped part is followed by rays that leave the surfaces and lamps, never taken as the
remainder, so that emitted = absorbed + escaped is a check and not a definition. Powers are
means over the three channels, in watts.
"""

from __future__ import annotations

import numpy as np

from ...numerics import (
    LAMP_STEP,
    Array,
    Stream,
    cosine_hemisphere,
    pick_in_runs,
    points_on_triangles,
    running_sums,
    stratified_square,
    to_world,
)
from ..hierarchy import LEAF, ClusterCut, Hierarchy, node_opacity
from ..links import ClusterLinks, Links, gather_at_clusters
from .lamp_power import fate, is_stopped, lost_by_lamp
from .state import SolverState

ESCAPE_RAYS = 1 << 17
"""Rays that follow the light surfaces send out."""


def power_balance(state: SolverState) -> dict[str, float]:
    """Return the emitted, absorbed and escaped power [W].

    Lamps and emission count with all they send, sun and sky with what arrives at the faces. So does a
    lamp without shadows: each surface in its light's way gets all of it. Other lamps also count with the
    light at faces that it reaches through others.
    """
    hierarchy, scene = state.hierarchy, state.scene
    leaves = hierarchy.leaves
    emitted = float((hierarchy.area[leaves] @ hierarchy.emission[leaves]).mean()) if len(leaves) else 0.0
    receiver = state.light_links.receiver
    gain = hierarchy.area[receiver] * hierarchy.opacity[receiver] * state.light_links.gain.mean(axis=1)
    # What stops a lamp's light has it from the lamp's power, all else on top of that.
    stops = scene.in_shadows[hierarchy.faces.triangle[hierarchy.face[receiver]]]
    for number, light in enumerate(scene.lights):
        on_top = state.light_links.light == number
        if is_stopped(light):
            emitted += float(light.flux.mean())
            on_top &= ~stops
        emitted += float(gain[on_top].sum()) * float(light.strength.mean())

    kept = (hierarchy.opacity[leaves, None] - hierarchy.reflectance[leaves]) * state.irradiance[leaves]
    absorbed = float((hierarchy.area[leaves] @ kept).mean()) if len(leaves) else 0.0
    from_surfaces = _follow_surfaces(state)
    from_lamps = _follow_lamps(state)
    return {
        "emitted": emitted,
        "absorbed": absorbed + from_surfaces[0] + from_lamps[0],
        "escaped": from_surfaces[1] + from_lamps[1],
    }


def _follow_surfaces(state: SolverState) -> tuple[float, float]:
    """Return the power [W] that leaves the surfaces onto black backs, and out of the scene."""
    hierarchy = state.hierarchy
    leaves = hierarchy.leaves
    power = hierarchy.area[leaves] * state.radiosity[leaves].mean(axis=1)
    total = float(power.sum())
    if total == 0.0:
        return 0.0, 0.0
    # Stratified by power: the rays are shared out along the running sum.
    number = np.arange(ESCAPE_RAYS)
    along = (number + 0.5) / ESCAPE_RAYS
    leaf = leaves[pick_in_runs(running_sums(power), along)[0]]
    seed = state.settings.seed
    unit = stratified_square(number, 1, seed + Stream.ESCAPE_POINTS)
    points = points_on_triangles(hierarchy.corners[leaf], unit)[:, 0]
    normals = hierarchy.normal[leaf]
    unit = stratified_square(number, 1, seed + Stream.ESCAPE_DIRECTIONS)
    directions = to_world(cosine_hemisphere(unit), normals)[:, 0]
    start = points + state.caster.surface_offset * normals
    black, escaped = fate(hierarchy, state.caster, start, directions)
    return total * float(black.mean()), total * float(escaped.mean())


def _follow_lamps(state: SolverState) -> tuple[float, float]:
    """Return the power [W] that leaves lamps with shadows onto black backs, and out of the scene."""
    black_total = escaped_total = 0.0
    for number, light in enumerate(state.scene.lights):
        if not is_stopped(light) or not light.flux.any():
            continue
        seed = state.settings.seed + LAMP_STEP * number
        black, escaped, _ = lost_by_lamp(light, state.scene, state.hierarchy, state.caster, seed)
        flux = float(light.flux.mean())
        black_total += flux * black
        escaped_total += flux * escaped
    return black_total, escaped_total


def link_closure(hierarchy: Hierarchy, links: Links, cluster_links: ClusterLinks | None = None) -> Array:
    """Return (f,) the area mean over each face's leaves of ΣFV over own and inherited links.

    1 in a closed scene: all that leaves a face arrives somewhere. A factor counts with its source's
    opacity, as light that finds no surface there goes on to the next.
    """
    opacity = node_opacity(hierarchy)
    there = opacity[links.source]
    child = np.full(len(opacity), LEAF)
    child[hierarchy.n_clusters :] = hierarchy.first_child
    inner = np.flatnonzero(child[links.source] != LEAF)
    there[inner] = 0.0
    for quarter in range(4):
        of_quarter = hierarchy.opacity[child[links.source[inner]] + quarter]
        there[inner] += 0.25 * links.of_quarter[inner, quarter] * of_quarter
    factor = links.factor * links.visibility * there
    own = np.bincount(links.receiver, factor, minlength=hierarchy.n_elements)
    # An element's own links count for its whole area: exactly the mean over its leaves.
    held = np.bincount(hierarchy.face, own * hierarchy.area, minlength=len(hierarchy.faces))
    per_face = np.asarray(held / hierarchy.faces.area)
    if cluster_links is not None:
        cut = ClusterCut(hierarchy, cluster_links.receiver, cluster_links.source)
        there = gather_at_clusters(hierarchy, cut, cluster_links, opacity[:, None])[:, 0]
        per_face += np.maximum(there, 0.0)
    return per_face
