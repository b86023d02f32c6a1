"""Emissive faces as lamps: exact unoccluded factor, samples in proportion to it."""

from __future__ import annotations

import numpy as np

from ...form_factors import point_to_polygon, ray_geometry_term, throughput
from ...numerics import (
    Array,
    directions_to_triangles,
    numbered,
    pick_in_rows,
    pick_in_runs,
    point_on_each_triangle,
    radiance_of_radiosity,
    run_starts,
    running_sums,
    triangle_areas,
)
from ...rays import RayCaster
from ...scene import Faces
from .emitter_tree import EmitterPairs, EmitterTree
from .merged_faces import merge_flat

CHUNK_PAIRS = 1 << 18
"""Point and face pairs evaluated at once; bounds the temporaries to about 50 MB a thread."""

MANY = 256
"""More faces than these are evaluated in groups where they are far."""

FEW = 32
"""Up to so many faces are evaluated exactly everywhere, …"""

FAR = 10.0
"""… of more only those that are nearer than this many of their radii, or cut by the horizon. The others send
like a disk of their area: of a face that looks this small the form factor is off by less than 1 %."""

BLOCK_PAIRS = 1 << 17
"""Point and face pairs evaluated in single precision at a time; their temporaries take some ten MB."""

CHUNK_POINTS = 1 << 14
"""Points that go down a tree of faces at once: each of them visits some hundred nodes."""

ROUNDED = 1e-5
"""Heights of single precision are right to this part of the distance."""

ENDS = 2.0
"""Surface offsets from an emissive face to where shadow rays end. Their starts are lifted by one, which
must not put their ends back on the face."""

NEAR_HORIZON = 1e-9
"""A corner may lie below the horizon by this share of the group's extent, by rounding, and still count."""


class EmitterGroup:
    """Faces of one emission, lit points see them as one lamp.

    Parameters
    ----------
    corners : (m, 3, 3) float64
    normals : (m, 3) float64
    strength : (3,) float64
        Exitance [W/m²].
    offset : float
        Shadow rays end this far off the surface, so that they do not meet it: `ENDS` times as far as
        they start off theirs.
    level : (m,) float64 or None
        What part of `strength` each face emits; None for all of it.
    """

    STORED = ("strength",)

    def __init__(
        self, corners: Array, normals: Array, strength: Array, offset: float, level: Array | None = None
    ) -> None:
        self._corners, self._normals, self._offset = corners, normals, offset
        self._areas = triangle_areas(corners)
        self.strength = strength
        self._level = np.ones(len(corners)) if level is None else level
        # From a corner of theirs: heights over planes far from the origin would be rounded off.
        self._origin = corners[0, 0]
        self._outlines = corners - self._origin
        self._reach = float(np.abs(self._outlines).max())
        center = self._outlines.mean(axis=1)
        radius = np.linalg.norm(self._outlines - center[:, None], axis=2).max(axis=1)
        # One row a coordinate.
        self._center, self._facing = center.T.astype(np.float32), normals.T.astype(np.float32)
        self._radius, self._size = radius.astype(np.float32), self._areas.astype(np.float32)
        self._tree = None
        if len(corners) > MANY:
            self._tree = EmitterTree(corners, normals, self._areas * self._level, offset / ENDS)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """(3,) float64 twice: the lower and upper corner of the box around all faces [m]."""
        corners = self._corners.reshape(-1, 3)
        return corners.min(axis=0), corners.max(axis=0)

    @property
    def is_distant(self) -> bool:
        """False: its light differs from place to place."""
        return False

    def same_as(self, other: EmitterGroup) -> bool:
        """Whether the other's faces are where these are."""
        return self._corners.shape == other._corners.shape and bool((self._corners == other._corners).all())

    @staticmethod
    def of_faces(faces: Faces, caster: RayCaster, among: Array | None = None) -> list[EmitterGroup]:
        """Group the emissive faces, if given those of a (f,) mask, by color: visibility cannot mix it up."""
        shines = faces.emission.max(axis=1, initial=0.0) > 0
        rows = np.flatnonzero(shines if among is None else shines & among)
        if len(rows) == 0:
            return []
        rows, corners, level = _uncovered(faces, rows)
        colors, group = np.unique(faces.exitance[rows], axis=0, return_inverse=True)
        group = group.reshape(-1)
        offset = end_offset(caster)
        lamps = []
        for number, color in enumerate(colors):
            in_group = group == number
            whole, dim = np.flatnonzero(in_group & (level == 1.0)), np.flatnonzero(in_group & (level < 1.0))
            merged, first = merge_flat(corners[whole])
            normals = faces.normal[rows[whole][first]]
            if len(dim) == 0:
                lamps.append(EmitterGroup(merged, normals, color, offset))
                continue
            merged = np.concatenate([merged, corners[dim]])
            normals = np.concatenate([normals, faces.normal[rows[dim]]])
            levels = np.concatenate([np.ones(len(first)), level[dim]])
            lamps.append(EmitterGroup(merged, normals, color, offset, levels))
        return lamps

    def unit_irradiance(self, points: Array, normals: Array) -> Array:
        """Return (n,) the unoccluded irradiance per unit of exitance: Σ_m F(point → face m) · level."""
        gain = np.empty(len(points))
        if self._tree is not None:
            for first in range(0, len(points), CHUNK_POINTS):
                rows = slice(first, first + CHUNK_POINTS)
                pairs = self._tree.ask(points[rows], normals[rows])
                gain[rows] = np.bincount(pairs.row, pairs.factor, minlength=len(points[rows]))
            return gain
        step = max(CHUNK_PAIRS // len(self._corners), 1)
        for first in range(0, len(points), step):
            rows = slice(first, first + step)
            gain[rows] = self.factors(points[rows], normals[rows]).sum(axis=1)
        return gain

    def is_near(self, points: Array, reach: Array) -> Array:
        """Whether the box around one of the faces is within `reach` (n,) [m] of points, (n,) bool."""
        low, high = self._corners.min(axis=1), self._corners.max(axis=1)
        close = _box_distance(points, low.min(axis=0), high.max(axis=0)) <= reach
        rows = np.flatnonzero(close)
        step = max(CHUNK_PAIRS // len(self._corners), 1)
        for first in range(0, len(rows), step):
            chunk = rows[first : first + step]
            apart = _box_distance(points[chunk, None], low, high)
            close[chunk] = (apart <= reach[chunk, None]).any(axis=1)
        return np.asarray(close)

    def shadow_rays(self, points: Array, normals: Array, u: Array) -> tuple[Array, Array, Array]:
        """Aim (n, k) rays at the faces in proportion to their factors.

        The weights distinguish only the rays to one face; every face weighs as much as it has rays.
        Otherwise, so near a large face that no ray finds the spot that most light comes from, the few
        rays to a far and perhaps hidden face would decide.

        Returns
        -------
        directions : (n, k, 3), distances : (n, k), weights : (n, k)
        """
        if self._tree is not None:
            starts = range(0, max(len(points), 1), CHUNK_POINTS)
            chunks = [slice(first, first + CHUNK_POINTS) for first in starts]
            found = [self._rays_by_tree(self._tree, points[rows], normals[rows], u[rows]) for rows in chunks]
            directions, distances, weights = (np.concatenate(each) for each in zip(*found, strict=True))
            return directions, distances, weights
        directions, (distances, weights) = np.empty((*u.shape[:2], 3)), np.empty((2, *u.shape[:2]))
        step = max(BLOCK_PAIRS // len(self._corners), 1)
        for first in range(0, len(points), step):
            rows = slice(first, first + step)
            factors = self.factors(points[rows], normals[rows])
            face, along = pick_in_rows(factors, u[rows, :, 0])
            chosen = np.take_along_axis(factors, face, axis=1)
            inside = np.stack([along, u[rows, :, 1]], axis=-1)
            directions[rows], distances[rows], thrown = self._rays_to(
                points[rows], normals[rows], face, inside
            )
            # A uniform point of a face stands for what the whole face would send, were it all there.
            thrown *= self._level[face] * self._areas[face]
            sent = np.where(chosen > 0, radiance_of_radiosity(thrown) / np.maximum(chosen, 1e-300), 0.0)
            weights[rows] = _balanced(sent, face, len(self._corners))
        return directions, distances, weights

    def rays_from(self, points: Array, normals: Array, u: Array) -> tuple[Array, Array, Array]:
        """Aim a ray from each of (n, 3) points by (n, 2) numbers, in proportion to what the faces send there.

        For points next to a face: most of its light comes from a small spot of it, which uniform ones miss.

        Returns directions (n, 3), distances (n,), and weights (n,): their mean is the unoccluded irradiance
            per unit of exitance.
        """
        directions, (distances, weights) = np.empty((len(points), 3)), np.empty((2, len(points)))
        step = CHUNK_POINTS if self._tree is not None else max(BLOCK_PAIRS // len(self._corners), 1)
        for first in range(0, len(points), step):
            rows = slice(first, first + step)
            face, along, chance = self._choose_faces(points[rows], normals[rows], u[rows, 0])
            corners, facing = self._corners[face] - points[rows, None], self._normals[face]
            inside = np.stack([along, u[rows, 1]], axis=1)
            directions[rows], solid_angle = directions_to_triangles(corners, inside)
            rise = np.einsum("nk,nk->n", directions[rows], normals[rows])
            ahead = -np.einsum("nk,nk->n", directions[rows], facing)
            seen = (rise > 0.0) & (ahead > 0.0) & (chance > 0.0)
            sent = rise * solid_angle * self._level[face] / np.pi
            weights[rows] = np.where(seen, sent / np.where(seen, chance, 1.0), 0.0)
            reach = -np.einsum("nk,nk->n", corners[:, 0], facing) / np.where(seen, ahead, 1.0)
            ends = directions[rows] * reach[:, None] + self._offset * facing
            distances[rows] = np.linalg.norm(ends, axis=1)
            directions[rows] = ends / np.maximum(distances[rows], 1e-300)[:, None]
        return directions, distances, weights

    def _choose_faces(self, points: Array, normals: Array, u: Array) -> tuple[Array, Array, Array]:
        """Return (n,) a face for each point, u (n,) within it, and the probability of the choice or 0."""
        if self._tree is None:
            factors = self.factors(points, normals)
            face, along = (part[:, 0] for part in pick_in_rows(factors, u[:, None]))
            chosen = np.take_along_axis(factors, face[:, None], axis=1)[:, 0]
            return face, along, chosen / np.maximum(factors.sum(axis=1), 1e-300)
        tree, pairs = self._tree, self._tree.ask(points, normals)
        face, (along, chance) = np.zeros(len(points), dtype=np.int64), np.zeros((2, len(points)))
        lit, *picked = _pick_by_tree(tree, pairs, points, u[:, None])
        which, node, slot, within, below = (part[:, 0] for part in picked)
        total = np.bincount(pairs.row, pairs.factor, len(points))[lit]
        # Sums over all faces may round off what the faces of a node add.
        whole = tree.running[tree.end[node]] - tree.running[tree.begin[node]]
        part = np.diff(tree.running)[slot] / np.maximum(whole, 1e-300)
        chance[lit] = pairs.factor[which] / total * below * part
        face[lit], along[lit] = tree.order[slot], within
        return face, along, chance

    def _rays_by_tree(
        self, tree: EmitterTree, points: Array, normals: Array, u: Array
    ) -> tuple[Array, Array, Array]:
        """Aim (n, k) rays at nodes by what they send, and at faces of a node by their weights."""
        pairs = tree.ask(points, normals)
        directions, (distances, weights) = np.zeros((*u.shape[:2], 3)), np.zeros((2, *u.shape[:2]))
        directions[..., 2] = 1.0
        lit, which, node, slot, along, chance = _pick_by_tree(tree, pairs, points, u[..., 0])
        inside = np.stack([along, u[lit, :, 1]], axis=-1)
        directions[lit], distances[lit], thrown = self._rays_to(
            points[lit], normals[lit], tree.order[slot], inside
        )
        # A point of a node's faces stands for what the whole node would send, were it all there.
        held = tree.running[tree.end[node]] - tree.running[tree.begin[node]]
        sent = radiance_of_radiosity(thrown * held / chance)
        weights[lit] = _balanced(sent / np.maximum(pairs.factor[which], 1e-300), which, len(pairs.row))
        return directions, distances, weights

    def _rays_to(
        self, points: Array, normals: Array, face: Array, inside: Array
    ) -> tuple[Array, Array, Array]:
        """Return directions, distances and throughput per area of rays to places on faces (n, k)."""
        corners = self._corners[face]
        targets = point_on_each_triangle(corners, inside)
        along = targets + self._offset * self._normals[face] - points[:, None]
        distances = np.linalg.norm(along, axis=2)
        directions = along / np.maximum(distances, 1e-300)[..., None]
        cos_r = np.einsum("nkc,nc->nk", directions, normals)
        cos_s = -np.einsum("nkc,nkc->nk", directions, self._normals[face])
        return directions, distances, throughput(ray_geometry_term(cos_r, cos_s, distances), 1.0, 1.0)

    def factors(self, points: Array, normals: Array) -> Array:
        """Return (n, m) form factors from points to faces, times the faces' levels.

        0 where not even the start of a ray, lifted off the surface, is in front of a face.
        """
        factors = np.empty((len(points), len(self._corners)))
        step = max(BLOCK_PAIRS // len(self._corners), 1)
        for first in range(0, len(points), step):
            rows = slice(first, first + step)
            factors[rows], open_pairs = self._from_afar(points[rows], normals[rows])
            point, face = np.nonzero(open_pairs)
            factors[rows][point, face] = self._from_near(points[rows], normals[rows], point, face)
        factors *= self._level
        return factors

    def _from_afar(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Return (n, m) float32 factors of faces that look small, and which pairs need a closed form."""
        apart = (points - self._origin).astype(np.float32)
        x, y, z = (self._center[axis] - apart[:, axis, None] for axis in range(3))
        up = normals.astype(np.float32)
        rise = x * up[:, :1] + y * up[:, 1:2] + z * up[:, 2:]
        ahead = -(x * self._facing[0] + y * self._facing[1] + z * self._facing[2])
        # What may be above the horizon, and in front, for all that rounding and the lift of rays' starts do.
        slack = np.float32(self._offset + ROUNDED * np.abs(apart).max(initial=0.0))
        seen = (rise > -(self._radius + slack)) & (ahead > -slack)
        if len(self._corners) <= FEW:
            return np.zeros_like(rise), seen
        square = x * x + y * y + z * z
        simple = (square > (FAR * self._radius) ** 2) & (rise > self._radius)
        factor = rise * np.maximum(ahead, 0.0) * self._size
        divisor = square * (np.float32(np.pi) * square + self._size)
        factor = np.divide(factor, divisor, out=np.zeros_like(factor), where=simple)
        return factor, seen & ~simple

    def _from_near(self, points: Array, normals: Array, point: Array, face: Array) -> Array:
        """Return (p,) the factors of pairs in closed form."""
        # A point of a footprint is rounded off its plane: a hair behind, it would see all of its own back.
        apart, up, facing = points[point] - self._origin, normals[point], self._normals[face]
        height = np.einsum("pc,pc->p", apart - self._outlines[face, 0], facing)
        height += (self._offset / ENDS) * np.einsum("pc,pc->p", up, facing)
        # What is below the horizon, corner by corner, needs no closed form.
        rises = np.einsum("pkc,pc->pk", self._outlines[face], up).max(axis=1)
        horizon = np.einsum("pc,pc->p", apart, up) - NEAR_HORIZON * self._reach
        seen = np.flatnonzero((height > 0.0) & (rises > horizon))
        point, face = point[seen], face[seen]
        factors = np.zeros(len(height))
        # Among the faces may be the back of the one the point is on.
        factors[seen] = point_to_polygon(points[point], normals[point], self._corners[face], contact=False)
        return factors


def _pick_by_tree(
    tree: EmitterTree, pairs: EmitterPairs, points: Array, u: Array
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Choose nodes for points by what they send, and faces of the nodes by their weights, by (n, k) numbers.

    Returns lit (l,) the points that get light, and (l, k) each: the pair, the node below it, the place of the
        face in the tree's order, what is left of the number, and the probability of that node below it.
    """
    count = np.bincount(pairs.row, minlength=len(points))
    lit = np.flatnonzero(count)
    if len(lit) == 0:
        none = np.zeros((0, u.shape[1]), dtype=np.int64)
        return lit, none, none, none, none.astype(float), none + 1.0
    first = run_starts(count)[lit, None]
    which, along = pick_in_runs(running_sums(pairs.factor), u[lit], first, first + count[lit, None])
    toward = np.repeat(points[lit], u.shape[1], axis=0)
    found = tree.descend(toward, pairs.node[which].ravel(), along.ravel())
    node, along, chance = (each.reshape(which.shape) for each in found)
    slot, along = pick_in_runs(tree.running, along, tree.begin[node], tree.end[node])
    return lit, which, node, slot, along, chance


def _uncovered(faces: Faces, rows: Array) -> tuple[Array, Array, Array]:
    """Return what other faces leave of some: whose it is, corners (m, 3, 3), and what shows of it (m,)."""
    if faces.own is None:
        return rows, faces.corners[rows], np.ones(len(rows))
    row, weights, level = faces.own.parts_of(faces.side[rows])
    face = rows[row]
    return face, corners_of_parts(faces, face, upright(faces, face, weights)), level


def upright(faces: Faces, face: Array, weights: Array) -> Array:
    """Return parts (m, 3, 2) of triangles the way round that is counter-clockwise as seen from the face."""
    return np.where(faces.front[face, None, None], weights, weights[:, [0, 2, 1]])


def corners_of_parts(faces: Faces, face: Array, weights: Array) -> Array:
    """Return the corners (m, 3, 3) of parts in weights of their triangle's second and third corner."""
    corner = np.where(faces.front[face, None, None], faces.corners[face], faces.corners[face][:, [0, 2, 1]])
    return np.asarray(corner[:, :1] + np.einsum("pcw,pwk->pck", weights, corner[:, 1:] - corner[:, :1]))


def end_offset(caster: RayCaster) -> float:
    """Return how far off an emissive face shadow rays end [m]."""
    return ENDS * caster.surface_offset


def _box_distance(points: Array, low: Array, high: Array) -> Array:
    """Return (…) how far points (…, 3) are from boxes [m], 0 inside."""
    outside = np.maximum(np.maximum(low - points, points - high), 0.0)
    return np.asarray(np.sqrt(np.einsum("...c,...c->...", outside, outside)))


def _balanced(weights: Array, face: Array, faces: int) -> Array:
    """Scale (n, k) weights so that in every row the rays to one face have 1 on average."""
    keys = (np.arange(len(face))[:, None] * faces + face).ravel()
    number = numbered(keys)
    mean = np.bincount(number, weights.ravel()) / np.bincount(number)
    return np.asarray(weights / np.maximum(mean[number].reshape(weights.shape), 1e-300))
