"""Objects lit from behind: lightmaps hold the light on fronts, so theirs are dark.

A wall whose normals point out of its room, or a bathtub whose normals point inward, looks right in every
render, as both sides of a surface show, and black once it is baked. Somebody who does not know that will look
for a leak. The front of a picture's frame that faces the wall it hangs on is not quite black: some light gets
into the gap.

Closed objects that are inside out are found by their shape alone, also before a bake. For all others it takes
light. The solver's elements are too coarse for this: inside a thin shell they get a tenth of the light around
it. So fronts are judged by their texels, and backs by rays. A rail along a wall may get light on many of its
fronts, in the gap behind it; what the scene's cameras see only from behind is turned all the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ..base import BakeWarning
from ..lightmap.texels import TexelGeometry
from ..lightmap.transport import TexelLight
from ..numerics import Array, Stream, cosine_hemisphere, stratified_square, tiles, to_world
from ..rays import NO_HIT, Hits, free_segment
from ..scene import BakeObject, BakeScene, Scene, inside_out, places, wound_parts
from ..solver import Solution
from ..solver.gather import Footprints, LocalPass

DARK = 0.05
"""A front that gets less than this part of its back's light, and of usual light, is dark, …"""

DIM, HIDDEN, WITHIN = 0.5, 0.9, 0.25
"""So is one that gets less than this part of its back's light if at least so much of what it faces is within
this part of the root of its part's area, …"""

SEEN = 0.1
"""… if the back gets at least this part of usual light."""

MAX_TURNED_SHARE = 0.1
"""Objects are warned of where more than this part of their area is like that: walls often are one object,
and closed ones, which are dark inside, never are."""

PROBED, PROBES = 64, 16
"""So many dark triangles of an object are looked at from behind, by so many rays each."""

VIEWED = 0.1
"""Cameras see a part only from behind if fronts are at most this part of what they see of it."""

OPEN = 0.5
"""A back does not face the inside of a solid if at least this part of the rays meets fronts, or leaves."""

MOSTLY = 0.5
"""A part whose faces go on facing one way is turned, as a whole, if so much of what is lit of it is."""

NO_AREA = 1e-12
"""Triangles without area count as so much of the largest: polygons of nothing else follow their part."""

FLIPS = "Flip Faces in the panel, `flip` on the command line,"
"""What flips the faces that a warning has found."""

PROBED_AT_ONCE = 1 << 14
"""Triangles whose rays are traced together."""


def of_turned_faces(
    bake_scene: BakeScene,
    baked: list[BakeObject],
    solution: Solution,
    geometry: TexelGeometry,
    light: TexelLight | None,
) -> Iterator[BakeWarning]:
    """Warn of objects that are inside out, and of others that are lit from behind.

    What shines is not dark on its front: a closed bulb is as bright inside as its own light makes it.
    """
    turned = of_inside_out(bake_scene)
    yield from turned
    front = solution.triangle_irradiance.max(axis=1)
    if light is not None:
        front = front_irradiance(baked, geometry, light, front)
    front = front + bake_scene.scene.emission.max(axis=1)
    probe = BackProbe(bake_scene.scene, solution.local_pass, bake_scene.cameras)
    back = solution.back_irradiance.max(axis=1)
    named = {warning.name for warning in turned}
    for warning in turned_away(baked, bake_scene.scene, front, back, probe):
        if warning.name not in named:
            yield warning


def of_inside_out(bake_scene: BakeScene) -> list[BakeWarning]:
    """Return a warning for each object that gets a lightmap and is inside out on a large area."""
    turned, areas = inside_out(bake_scene), bake_scene.scene.areas
    warnings = []
    for item in bake_scene.objects:
        inward, whole = float(areas[item.rows] @ turned[item.rows]), float(areas[item.rows].sum())
        if item.bake and inward > MAX_TURNED_SHARE * whole:
            message = (
                f"object '{item.name}' is inside out on {inward / whole:.0%} of its surface: normals point "
                f"inward, so its lightmap is black there; use {FLIPS} or Mesh → Normals → Recalculate Outside"
            )
            polygons = tuple(np.unique(item.polygon[turned[item.rows]]).tolist())
            warnings.append(BakeWarning(item.name, message, turned=polygons))
    return warnings


class BackProbe:
    """Decides by rays whether light reaches triangles from behind, and which of their sides are seen.

    cameras (n, 3): Where the scene is seen from.
    """

    def __init__(self, scene: Scene, local: LocalPass, cameras: Sequence[Sequence[float]] = ()) -> None:
        self._scene, self._local = scene, local
        self._cameras = np.array(cameras, dtype=np.float64).reshape(-1, 3)

    def all_lit(self, rows: Array, least: float) -> Array:
        """Return what `lit` does, for any number of triangles."""
        chunks = [rows[first : first + PROBED_AT_ONCE] for first in range(0, len(rows), PROBED_AT_ONCE)]
        return np.concatenate([self.lit(chunk, least) for chunk in chunks])

    def lit(self, rows: Array, least: float) -> Array:
        """Return (n,) whether the backs of triangles face lit surfaces, or lamps give them `least` [W/m²]."""
        points, normals, hits = self._seen(rows, -1.0)
        is_open = (hits.front | (hits.triangle == NO_HIT)).reshape(-1, PROBES).mean(axis=1) >= OPEN
        direct = self._local.direct.at(Footprints(points, normals, rows)).max(axis=1)
        return np.asarray(is_open | (direct > least))

    def hidden(self, rows: Array, reach: Array) -> Array:
        """Return (n,) whether the fronts of triangles face hardly anything beyond `reach`, (n,) [m]."""
        found = np.zeros(len(rows), dtype=bool)
        for first in range(0, len(rows), PROBED_AT_ONCE):
            chunk = slice(first, first + PROBED_AT_ONCE)
            _, _, hits = self._seen(rows[chunk], 1.0)
            near = hits.distance.reshape(-1, PROBES) < reach[chunk, None]
            found[chunk] = near.mean(axis=1) >= HIDDEN
        return found

    def viewed(self, rows: Array) -> tuple[Array, Array]:
        """Return how many cameras see the middles of triangles from the front and from behind, (n,) each."""
        points, normals = self._scene.triangles[rows].mean(axis=1), self._scene.face_normals[rows]
        counts = np.zeros((2, len(rows)))
        for camera in self._cameras:
            offset = camera - points
            side = np.sign((offset * normals).sum(axis=1, keepdims=True))
            starts = points + 2.0 * self._local.caster.surface_offset * side * normals
            is_free = free_segment(self._local.caster, starts, np.broadcast_to(camera, points.shape))
            counts += is_free * np.array([side[:, 0] > 0, side[:, 0] < 0])
        return counts[0], counts[1]

    def _seen(self, rows: Array, side: float) -> tuple[Array, Array, Hits]:
        """Return the middles of triangles, normals on a side, both (n, 3), and what rays from there hit."""
        caster = self._local.caster
        normals = side * self._scene.face_normals[rows]
        points = self._scene.triangles[rows].mean(axis=1)
        unit = stratified_square(rows, PROBES, Stream.BACK_PROBES)
        directions = to_world(cosine_hemisphere(unit), normals).reshape(-1, 3)
        starts = np.repeat(points + 2.0 * caster.surface_offset * normals, PROBES, axis=0)
        return points, normals, caster.intersect(starts, directions)


def turned_away(
    objects: Iterable[BakeObject], scene: Scene, front: Array, back: Array, probe: BackProbe
) -> Iterator[BakeWarning]:
    """Yield a warning for each object with a large area lit from behind, the largest first.

    objects: Those that get lightmaps.
    front, back (t,) [W/m²]: Mean irradiance on both sides of every triangle, of the brightest channel.
    """
    areas = scene.areas
    of = [(item, areas[item.rows]) for item in objects if areas[item.rows].any()]
    lit = np.maximum(front, back)
    levels = [float(area @ lit[item.rows] / area.sum()) for item, area in of]
    # A median over objects: a ground in the sun is a hundred times as bright and large as a room.
    usual = float(np.quantile(levels, 0.5, method="higher")) if levels else 0.0
    seen = back > SEEN * usual
    dark, dim = seen & (front < DARK * np.minimum(back, usual)), seen & (front < DIM * back)
    found: list[tuple[float, BakeWarning]] = []
    for item, area in of:
        if float(area @ (dark | dim)[item.rows]) <= MAX_TURNED_SHARE * float(area.sum()):
            continue
        suspects = item.first + np.flatnonzero(dark[item.rows])
        part = wound_parts(places(scene.triangles[item.rows]))
        behind = np.bincount(part, area * (back - front)[item.rows]) > 0
        behind &= only_seen_from_behind(probe, item, part, area)
        others = np.flatnonzero((dim & ~dark)[item.rows])
        reach = WITHIN * np.sqrt(np.bincount(part, area)[part[others]])
        hidden = item.first + others[behind[part[others]] | probe.hidden(item.first + others, reach)]
        suspects = np.sort(np.append(suspects, hidden))
        share = float(areas[suspects].sum() / area.sum())
        if share <= MAX_TURNED_SHARE:
            continue
        ends = np.cumsum(areas[suspects])
        chosen = np.searchsorted(ends, (np.arange(PROBED) + 0.5) / PROBED * ends[-1])
        distinct, count = np.unique(np.minimum(chosen, len(suspects) - 1), return_counts=True)
        share *= float(count @ probe.lit(suspects[distinct], SEEN * usual)) / PROBED
        if share > MAX_TURNED_SHARE:
            turned = suspects[probe.all_lit(suspects, SEEN * usual)] - item.first
            unlit = lit[item.rows] <= SEEN * usual
            right = (front > DARK * usual)[item.rows]
            right[turned] = False
            fine = np.flatnonzero(right)
            reach = WITHIN * np.sqrt(np.bincount(part, area)[part[fine]])
            right[fine] = ~probe.hidden(item.first + fine, reach)
            unlit, right = unlit | behind[part], right & ~behind[part]
            polygons = turned_polygons(item, part, area, turned, unlit, right)
            ways = f"{FLIPS} or Mesh → Normals → Flip" if polygons else "Mesh → Normals → Flip"
            message = (
                f"object '{item.name}' is lit from behind on {share:.0%} of its surface: normals point "
                f"away from the light, so its lightmap is dark there; flip them ({ways}) if that side should "
                "be visible"
            )
            found.append((share * float(area.sum()), BakeWarning(item.name, message, turned=polygons)))
    for _, warning in sorted(found, key=lambda each: -each[0]):
        yield warning


def only_seen_from_behind(probe: BackProbe, item: BakeObject, part: Array, areas: Array) -> Array:
    """Return (parts,) whether cameras see a part of an object, but hardly any of its fronts.

    part (count,) int, areas (count,) [m²]: Of the object's triangles.
    """
    rows = np.arange(item.first, item.first + item.count)
    fronts, backs = (np.bincount(part, areas * seen) for seen in probe.viewed(rows))
    return (backs > 0) & (fronts <= VIEWED * (fronts + backs))


def turned_polygons(
    item: BakeObject, part: Array, areas: Array, turned: Array, unlit: Array, right: Array
) -> tuple[int, ...]:
    """Return the polygons of an object that are to be flipped, in ascending order.

    Parts whose faces go on facing one way stay so: each is flipped as a whole, or not at all.

    part (count,) int, areas (count,) [m²]: Of the object's triangles; parts as in `wound_parts`.
    turned (n,) int: Its triangles that are lit from behind.
    unlit (count,) bool: Those that get hardly any light on either side, and so decide nothing.
    right (count,) bool: Those whose fronts are lit, and seen from afar. A part that shows many stays.
    """
    is_turned = np.zeros(item.count, dtype=bool)
    is_turned[turned] = True
    of_part = np.bincount(part, areas * is_turned)
    decided = np.bincount(part, areas * (is_turned | ~unlit))
    lit_in_front = np.bincount(part, areas * right)
    flips = (of_part > 0) & (of_part >= MOSTLY * decided) & (lit_in_front <= MAX_TURNED_SHARE * decided)
    flips = flips[part]
    weight = np.maximum(areas, NO_AREA * areas.max())
    most = np.bincount(item.polygon, weight * flips) > 0.5 * np.bincount(item.polygon, weight)
    return tuple(np.flatnonzero(most).tolist())


def front_irradiance(
    objects: Iterable[BakeObject], geometry: TexelGeometry, light: TexelLight, otherwise: Array
) -> Array:
    """Return (t,) [W/m²] of the brightest channel: each triangle's mean over its texels.

    Triangles without texels get their object's mean, those of objects without texels `otherwise`, (t,).
    """
    total, count = np.zeros(len(otherwise)), np.zeros(len(otherwise), dtype=np.int64)
    for rows in tiles(len(geometry)):
        triangle, where, texels = np.unique(geometry.triangle[rows], return_inverse=True, return_counts=True)
        arriving = (light.direct[rows] + light.indirect[rows]).max(axis=1)
        total[triangle] += np.bincount(where.reshape(-1), arriving)
        count[triangle] += texels
    front = otherwise.copy()
    for item in objects:
        texels = int(count[item.rows].sum())
        if texels:
            front[item.rows] = total[item.rows].sum() / texels
    return np.where(count > 0, total / np.maximum(count, 1), front)
