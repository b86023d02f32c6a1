"""Which pairs are linked: the bound of Oracle1, the pairs of faces, and RefinePatch."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import triangle_to_triangle
from radiosity_addon.solver import Scene
from radiosity_addon.solver.equations import refine_patch
from radiosity_addon.solver.equations.form_factor_oracle import oracle1, source_factor_bounds
from radiosity_addon.solver.equations.refine_patch import RefinePatch, facing_pairs
from radiosity_addon.solver.hierarchy.nodes import LEAF, Hierarchy
from tests.rooms import box_room, gray_scene, rectangle
from tests.unit.solved_rooms import furnished


def scene_of(triangles: np.ndarray, two_sided: bool = False) -> Scene:
    return gray_scene(triangles, 0.5, 1.0, two_sided=two_sided)


# --- the bound --------------------------------------------------------------------------------


def random_pairs(count: int, apart: float) -> tuple[Hierarchy, np.ndarray, np.ndarray]:
    """Random triangles of very different sizes, in pairs some of their own radii apart."""
    rng = np.random.default_rng(int(10 * apart))
    shapes = rng.normal(size=(2 * count, 3, 3))
    shapes[::2] *= np.exp(rng.normal(size=(count, 1, 1)))
    shapes -= shapes.mean(axis=1, keepdims=True)
    radius = np.linalg.norm(shapes, axis=2).max(axis=1)
    away = rng.normal(size=(count, 3))
    away *= (apart * (radius[::2] + radius[1::2]) / np.linalg.norm(away, axis=1))[:, None]
    shapes[1::2] += away[:, None]
    return Hierarchy(scene_of(shapes)), np.arange(0, 2 * count, 2), np.arange(1, 2 * count, 2)


@pytest.mark.parametrize("apart", [0.2, 0.7, 1.0, 1.3, 3.0, 10.0])
def test_no_pair_exchanges_more_than_the_bound(apart: float) -> None:
    """Crossing, touching and distant pairs alike; 0 just where the exact factor is 0."""
    hierarchy, one, other = random_pairs(400, apart)
    for receiver, source in ((one, other), (other, one)):
        exact = triangle_to_triangle(hierarchy.corners[source], hierarchy.corners[receiver])
        bound = source_factor_bounds(hierarchy, receiver, source)
        assert (exact > 0).sum() > 50
        assert (exact <= bound * (1 + 1e-6) + 3e-5 * (bound > 0)).all()
        assert (bound[exact == 0] == 0).mean() > 0.98  # but for what only just rises over a plane
        assert (bound <= np.minimum(1, hierarchy.area[receiver] / hierarchy.area[source]) + 1e-15).all()


def test_far_away_the_bound_is_the_factor() -> None:
    """It exceeds the factor by about the pair's size over its distance, and no more."""
    excess = []
    for apart in (20.0, 80.0):
        hierarchy, receiver, source = random_pairs(400, apart)
        exact = triangle_to_triangle(hierarchy.corners[source], hierarchy.corners[receiver])
        bound = source_factor_bounds(hierarchy, receiver, source)
        excess.append(bound.sum() / exact.sum() - 1)
    assert 0 < excess[0] < 0.3
    assert excess[1] < 0.3 * excess[0]


def test_the_bounds_are_reciprocal() -> None:
    """A_s F_sr = A_r F_rs holds for them too: the two directions have one bound."""
    hierarchy, one, other = random_pairs(300, 1.5)
    there, back = source_factor_bounds(hierarchy, one, other), source_factor_bounds(hierarchy, other, one)
    np.testing.assert_allclose(hierarchy.area[other] * there, hierarchy.area[one] * back, rtol=1e-12)


def test_touching_pairs_have_a_factor_however_small_they_get() -> None:
    """Beside an edge refinement ends by A_ε, never because the estimate has vanished."""
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))[:1]
    wall = rectangle((0, 0, 0), (0, 0, 1), (1, 0, 0))[1:]
    hierarchy = Hierarchy(scene_of(np.concatenate([floor, wall])))
    one, other = 0, 1
    for _ in range(10):
        # Their first children touch along half the edge again.
        assert source_factor_bounds(hierarchy, np.array([one]), np.array([other]))[0] == 1.0
        hierarchy.subdivide(np.array([one, other]))
        one, other = hierarchy.first_child[[one, other]].tolist()


@pytest.mark.parametrize(
    ("bound", "area_to", "area_of", "accepted"),
    [(0.1, 9, 9, False), (0.0999, 9, 9, True), (0.5, 0.9, 0.9, True), (0.5, 0.9, 1.0, False),
     (0.5, 1.0, 0.9, False), (0.0, 9, 9, True)],
)  # fmt: skip
def test_oracle1(bound: float, area_to: float, area_of: float, accepted: bool) -> None:
    """A_s < A_ε and A_r < A_ε, or F_sr < F_ε; here A_ε = 1 and F_ε = 0.1."""
    given = oracle1(np.array([bound]), np.array([area_to]), np.array([area_of]), 0.1, 1.0)
    assert given.tolist() == [accepted]


def test_oracle1_never_accepts_by_factor_at_zero() -> None:
    assert not oracle1(np.zeros(1), np.ones(1), np.ones(1), 0.0, 0.5).any()


# --- first pairs ------------------------------------------------------------------------------


def test_facing_pairs_are_those_with_a_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ways, never a face with itself, in blocks or not; fronts and backs are faces of their own."""
    wall = rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1))
    triangles = np.concatenate(
        [box_room((2, 1, 1))[0], wall, np.random.default_rng(1).normal(size=(20, 3, 3))]
    )
    hierarchy = Hierarchy(scene_of(triangles + np.array([1e4, 0, -3e3]), two_sided=True))
    count = len(hierarchy.faces)
    receiver, source = facing_pairs(hierarchy)
    every = np.stack(np.divmod(np.arange(count * count), count))
    bound = source_factor_bounds(hierarchy, *every)
    expected = every[:, (bound > 0) & (every[0] != every[1])]
    np.testing.assert_array_equal(np.stack([receiver, source]), expected)
    assert set(zip(receiver.tolist(), source.tolist(), strict=True)) == set(
        zip(source.tolist(), receiver.tolist(), strict=True)
    )
    monkeypatch.setattr(refine_patch, "BLOCK_PAIRS", 3 * count)
    np.testing.assert_array_equal(np.stack(facing_pairs(hierarchy)), expected)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_faces_have_no_pairs(count: int) -> None:
    triangles = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))[:count]
    receiver, source = facing_pairs(Hierarchy(scene_of(triangles)))
    assert len(receiver) == len(source) == 0


# --- RefinePatch ------------------------------------------------------------------------------


def literal_refine_patch(hierarchy: Hierarchy, error: float, min_area: float) -> set[tuple[str, str]]:
    """The handout's recursion, word for word: RefinePatch(s, r, F_ε) on every pair of distinct faces."""
    links: set[tuple[str, str]] = set()

    def subdiv(element: int) -> bool:
        if hierarchy.first_child[element] != LEAF:
            return True
        if hierarchy.area[element] < 4 * min_area:
            return False
        hierarchy.subdivide(np.array([element]))
        return True

    def refine(s: int, r: int) -> None:
        factor = source_factor_bounds(hierarchy, np.array([r]), np.array([s]))[0]
        if factor == 0:
            return
        if (hierarchy.area[s] < min_area and hierarchy.area[r] < min_area) or factor < error:
            links.add((path(hierarchy, r), path(hierarchy, s)))
        elif subdiv(r):
            for child in range(4):
                refine(s, hierarchy.first_child[r] + child)
        elif subdiv(s):
            for child in range(4):
                refine(hierarchy.first_child[s] + child, r)
        else:
            links.add((path(hierarchy, r), path(hierarchy, s)))

    for s in range(len(hierarchy.faces)):
        for r in range(len(hierarchy.faces)):
            if s != r:
                refine(s, r)
    return links


def path(hierarchy: Hierarchy, element: int) -> str:
    """Name an element by its face and the quarters that lead to it, whatever its number."""
    steps = ""
    while hierarchy.parent[element] != LEAF:
        parent = int(hierarchy.parent[element])
        steps = str(element - int(hierarchy.first_child[parent])) + steps
        element = parent
    return f"{element}:{steps}"


def refined(scene: Scene, error: float, min_area: float, max_links: int = 10**9) -> RefinePatch:
    refinement = RefinePatch(Hierarchy(scene), error, min_area, max_links)
    while refinement.generation():
        pass
    return refinement


@pytest.mark.parametrize(
    ("error", "min_area"), [(0.3, 0.02), (0.05, 0.1), (0.0, 0.3), (1.1, 0.01), (0.02, 9.0)]
)
def test_generations_make_the_links_of_the_recursion(error: float, min_area: float) -> None:
    """In a room with a box, whose faces see parts of each other, and of several sizes."""
    scene = furnished()
    refinement = refined(scene, error, min_area)
    receiver, source = refinement.pairs()
    names = [path(refinement.hierarchy, element) for element in range(refinement.hierarchy.n_elements)]
    made = {(names[r], names[s]) for r, s in zip(receiver, source, strict=True)}
    assert len(made) == len(receiver)
    literal = Hierarchy(scene)
    assert made == literal_refine_patch(literal, error, min_area)
    assert sorted(names) == sorted(path(literal, element) for element in range(literal.n_elements))


def test_every_two_points_are_linked_once() -> None:
    """In a convex room the pairs' products of areas are those of their faces."""
    refinement = refined(scene_of(box_room()[0]), 0.05, 0.01)
    hierarchy = refinement.hierarchy
    receiver, source = refinement.pairs()
    covered = np.zeros((12, 12))
    products = hierarchy.area[receiver] * hierarchy.area[source]
    np.add.at(covered, (hierarchy.face[receiver], hierarchy.face[source]), products)
    faces = hierarchy.faces
    apart = np.abs(faces.normal @ faces.normal.T - 1) > 1e-9
    np.testing.assert_allclose(covered, np.where(apart, np.outer(faces.area, faces.area), 0.0), rtol=1e-12)


def test_sources_split_only_where_the_receiver_may_not() -> None:
    """Receiver first: beside a large source the receiver is exhausted before the source splits."""
    min_area = 0.004
    refinement = refined(furnished(), 0.01, min_area)
    hierarchy = refinement.hierarchy
    receiver, source = refinement.pairs()
    split = hierarchy.level[source] > 0
    assert 0.3 < split.mean() < 1
    assert (hierarchy.area[receiver[split]] < 4 * min_area).all()


def test_without_a_limit_to_area_no_source_ever_splits() -> None:
    """Consequence of receiver first: a small receiver takes little of what a whole face sends."""
    refinement = refined(furnished(), 0.02, 1e-9)
    hierarchy = refinement.hierarchy
    receiver, source = refinement.pairs()
    assert (hierarchy.level[source] == 0).all()
    assert hierarchy.level[receiver].max() >= 3


def test_the_budget_serves_the_largest_factors_first() -> None:
    budget = 3000
    refinement = refined(furnished(), 0.01, 0.03, max_links=budget)
    assert budget - 4 < len(refinement.pairs()[0]) <= budget
    bound = source_factor_bounds(refinement.hierarchy, *refinement.unrefined.T)
    assert (bound >= 0.01).all()
    whole = refined(furnished(), 0.01, 0.03)
    assert len(whole.pairs()[0]) > 3 * budget
    assert len(whole.unrefined) == 0
    # In the first generation: room to split nine of the pairs of faces.
    first = RefinePatch(Hierarchy(furnished()), 0.01, 0.03, 0)
    pairs = np.stack([first.receiver, first.source], axis=1)
    bound = source_factor_bounds(first.hierarchy, *pairs.T)
    first.max_links = len(pairs) + 3 * 9 + 2
    assert first.generation()
    assert first.linked == len(pairs) - 9
    left = np.isin(pairs @ [1000, 1], first.unrefined @ [1000, 1])
    assert left.sum() == (bound >= 0.01).sum() - 9
    assert bound[left].max() <= bound[(bound >= 0.01) & ~left].min()
