"""The light of a known scene, followed by particles: what a bake's may not exceed.

Every particle starts on an emissive face and carries its share of the emitted power. Where emissive faces lie
in one place, or within `TOGETHER` of each other, only the outermost one sends particles out: only it is seen.
Rays are met by brute force, in double precision: there are few triangles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

from .random_scenes import Known

PARTICLES = 6000
BOUNCES = 40
TOGETHER = 1e-6
"""Meters within which parallel emissive faces are one emitter; or so many spacings of their coordinates."""

SPACINGS = 8
HAIR = 1e-3
"""Meters within which light between emissive faces may be held in: rays start above surfaces."""


@dataclass(frozen=True)
class Triangles:
    """All triangles of a scene, in the order of its objects.

    Attributes
    ----------
    corners : (n, 3, 3) float64
    owner : (n,) int
        Index into `names`.
    names : list of str
    """

    corners: np.ndarray
    owner: np.ndarray
    names: list[str]

    @property
    def normals(self) -> np.ndarray:
        """Return (n, 3) normals as long as twice the area."""
        edges = self.corners[:, 1:] - self.corners[:, :1]
        return np.cross(edges[:, 0], edges[:, 1])


@dataclass(frozen=True)
class Arrived:
    """What the particles say.

    Attributes
    ----------
    emitted : float
        Power [W] of all faces, but for those that lie together.
    leaving : float
        The part of it that leaves: of faces with no other one within `HAIR` above them.
    deviation, leaving_deviation : float
        The standard deviations of `emitted` and of `leaving`.
    front : dict of str to two arrays (3,)
        For each object: power that arrives on front sides, and its standard deviation.
    """

    emitted: float
    leaving: float
    deviation: float
    leaving_deviation: float
    front: dict[str, tuple[np.ndarray, np.ndarray]]
    area: dict[str, float]

    @property
    def hair(self) -> bool:
        """Whether parallel emissive faces are less than `HAIR` apart, and yet not together."""
        return self.leaving < self.emitted


def triangles_of(scene: bpy.types.Scene) -> Triangles:
    """Return the triangles of a scene's meshes, without those that have no area."""
    corners, owner, names = [], [], []
    for obj in scene.objects:
        if obj.type != "MESH" or not obj.data.polygons:
            continue
        obj.data.calc_loop_triangles()
        place = np.array(obj.matrix_world)
        points = np.array([vertex.co for vertex in obj.data.vertices]) @ place[:3, :3].T + place[:3, 3]
        rows = np.array([triangle.vertices[:] for triangle in obj.data.loop_triangles])
        corners.append(points[rows])
        owner += [len(names)] * len(rows)
        names.append(obj.name)
    made = Triangles(np.concatenate(corners), np.array(owner), names)
    good = np.linalg.norm(made.normals, axis=1) > 1e-12
    return Triangles(made.corners[good], made.owner[good], names)


def follow(triangles: Triangles, known: Known, seed: int) -> Arrived:
    """Send the particles out."""
    random = np.random.default_rng(seed)
    normals = triangles.normals
    length = np.linalg.norm(normals, axis=1)
    area, unit = length / 2, normals / length[:, None]
    strength = np.array([known.emission.get(name, 0.0) for name in triangles.names])[triangles.owner]
    reflectance = np.array([known.reflectance[name] for name in triangles.names])[triangles.owner]
    exitance = math.pi * strength
    total = 2 * float(exitance @ area)
    chosen = random.choice(len(area), PARTICLES, p=exitance * area / (exitance @ area))
    side = np.where(random.random(PARTICLES) < 0.5, 1.0, -1.0)
    start = _points(triangles.corners[chosen], random)
    share, leaves = _share(triangles.corners, unit, strength > 0, chosen, side, start)
    weight = np.repeat((share * total / PARTICLES)[:, None], 3, axis=1)
    emitted, leaving = float(weight[:, 0].sum()), float(weight[leaves, 0].sum())
    arrived = np.zeros((len(triangles.names), PARTICLES, 3))
    direction = _cosine(unit[chosen] * side[:, None], random)
    origin = start + 1e-7 * unit[chosen] * side[:, None]
    alive = np.flatnonzero(share > 0)
    for _ in range(BOUNCES):
        if not len(alive):
            break
        hit, distance = _meet(triangles.corners, unit, origin[alive], direction[alive])
        alive, hit, distance = alive[hit >= 0], hit[hit >= 0], distance[hit >= 0]
        front = np.einsum("ij,ij->i", direction[alive], unit[hit]) < 0
        np.add.at(arrived, (triangles.owner[hit[front]], alive[front]), weight[alive[front]])
        weight[alive] *= reflectance[hit]
        facing = unit[hit] * np.where(front, 1.0, -1.0)[:, None]
        origin[alive] = origin[alive] + distance[:, None] * direction[alive] + 1e-7 * facing
        direction[alive] = _cosine(facing, random)
        alive = alive[weight[alive].max(axis=1) > 1e-4 * total / PARTICLES]
    deviation = arrived.std(axis=1) * math.sqrt(PARTICLES)
    found = {
        name: (arrived[number].sum(axis=0), deviation[number]) for number, name in enumerate(triangles.names)
    }
    sums = np.bincount(triangles.owner, area, len(triangles.names))
    doubts = [total * float(each.std()) / math.sqrt(PARTICLES) for each in (share, share * leaves)]
    areas = dict(zip(triangles.names, sums.tolist(), strict=True))
    return Arrived(emitted, leaving, doubts[0], doubts[1], found, areas)


def _points(corners: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a random point of each triangle."""
    root, second = np.sqrt(random.random(len(corners))), random.random(len(corners))
    weights = np.stack([1 - root, root * (1 - second), root * second], axis=1)
    return np.einsum("ij,ijk->ik", weights, corners)


def _share(
    corners: np.ndarray,
    unit: np.ndarray,
    emits: np.ndarray,
    chosen: np.ndarray,
    side: np.ndarray,
    start: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return each point's share, and whether no other face is a hair above it.

    It is 0 where a parallel emissive face lies just above it, else 1 / the number that lie in its place.
    """
    rows = np.flatnonzero(emits)
    together = max(TOGETHER, SPACINGS * float(np.spacing(np.float32(np.abs(corners).max()))))
    up = unit[chosen] * side[:, None]
    height = np.einsum("ijk,ik->ij", corners[rows, 0][None] - start[:, None], up)
    parallel = np.abs(np.einsum("jk,ik->ij", unit[rows], up)) > 1 - 1e-9
    inside = np.ones_like(parallel)
    for corner in range(3):
        a, b = corners[rows, corner], corners[rows, (corner + 1) % 3]
        inwards = np.cross(unit[rows], b - a)
        inside &= np.einsum("ijk,jk->ij", start[:, None] - a[None], inwards) >= 0
    over = parallel & inside & (rows[None] != chosen[:, None])
    exact = 1e-10
    above = (over & (height > exact) & (height <= together)).any(axis=1)
    same = (over & (np.abs(height) <= exact)).sum(axis=1)
    hair = (over & (height > together) & (height < HAIR)).any(axis=1)
    return np.where(above, 0.0, 1.0 / (1 + same)), ~hair


def _meet(
    corners: np.ndarray, unit: np.ndarray, origin: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first triangle that each ray meets, or -1, and how far away it is."""
    nearest, found = np.full(len(origin), np.inf), np.full(len(origin), -1)
    for number in range(len(corners)):
        slope = direction @ unit[number]
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (corners[number, 0] - origin) @ unit[number] / slope
        near = np.flatnonzero((distance > 0) & (distance < nearest))
        point = origin[near] + distance[near, None] * direction[near]
        inside = np.ones(len(near), dtype=bool)
        for corner in range(3):
            a, b = corners[number, corner], corners[number, (corner + 1) % 3]
            inside &= (point - a) @ np.cross(unit[number], b - a) >= 0
        nearest[near[inside]], found[near[inside]] = distance[near[inside]], number
    return found, nearest


def _cosine(normal: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a direction about each normal, by Lambert's law."""
    ball = random.normal(size=normal.shape)
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    made = normal + ball * (1 - 1e-9)
    return made / np.linalg.norm(made, axis=1)[:, None]


def lightmap_of(obj: bpy.types.Object) -> bpy.types.Image | None:
    """Return the lightmap that an object's first material shows."""
    trees = [slot.material.node_tree for slot in obj.material_slots[:1] if slot.material is not None]
    for tree in trees:
        for node in tree.nodes:
            if node.type == "GROUP" and node.node_tree is not None:
                trees.append(node.node_tree)
            elif node.type == "TEX_IMAGE" and node.image is not None:
                return node.image
    return None
