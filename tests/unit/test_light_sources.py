"""Sources of light that can be changed apart, their gains, and what was solved before."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.relight.light_groups import share_out
from radiosity_addon.base.errors import SceneError
from radiosity_addon.lightmap.transport.warm_start import MAX_SOLUTIONS, WarmStart
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.scene.faces import Faces
from radiosity_addon.solver import PointLight, Scene
from radiosity_addon.solver.emitters.light_sources import LightSources
from radiosity_addon.solver.gather.light_gains import LightGains
from tests.rooms import box_room, gray, gray_scene

RED, ORANGE, BLUE = (4.0, 0.0, 0.0), (8.0, 4.0, 0.0), (0.0, 0.0, 2.0)


def sources(emitter: np.ndarray | None = None) -> tuple[LightSources, Scene]:
    """A lamp; triangles 0 to 3 emit red, orange twice, and blue."""
    triangles, _ = box_room()
    emission = gray(12, 0.0)
    emission[:4] = RED, ORANGE, ORANGE, BLUE
    scene = gray_scene(triangles, 0.5, emission, lights=[PointLight((0.5, 0.5, 0.5), (3.0, 2.0, 1.0))])
    return LightSources(scene, Faces(scene), EmbreeCaster(triangles), emitter), scene


def test_every_color_is_a_source_if_nothing_distinguishes_them() -> None:
    found, scene = sources()
    assert sorted(map(tuple, found.strengths)) == sorted([(3.0, 2.0, 1.0), RED, ORANGE, BLUE])
    assert (found.emitter[4:] == -1).all()
    np.testing.assert_array_equal(found.strengths[1 + found.emitter[:4]], scene.emission[:4])
    np.testing.assert_array_equal(found.of_lamps(found.strengths)[1:], [g.strength for g in found.groups])


def test_a_source_of_one_color_takes_any_other() -> None:
    found, scene = sources()
    strengths = found.strengths.copy()
    row = 1 + found.emitter[3]
    strengths[row] = (5.0, 6.0, 0.0)
    emission = found.emission(scene.emission, np.arange(12), found.checked(strengths))
    np.testing.assert_allclose(emission[3], (5.0, 6.0, 0.0))
    np.testing.assert_array_equal(emission[[0, 1, 2]], scene.emission[[0, 1, 2]])
    assert not emission[4:].any()
    group = next(n for n, g in enumerate(found.groups) if (g.strength == BLUE).all())
    np.testing.assert_allclose(found.of_lamps(strengths)[1 + group], (5.0, 6.0, 0.0))


def test_a_material_of_two_colors_keeps_their_proportions() -> None:
    material = np.zeros(12, dtype=np.int32)
    material[3] = 1
    found, scene = sources(material)
    np.testing.assert_array_equal(found.strengths, [(3.0, 2.0, 1.0), (8.0, 4.0, 0.0), BLUE])
    strengths = found.checked(np.array([(0.0, 0, 0), (4.0, 8.0, 0.0), BLUE]))
    emission = found.emission(scene.emission, np.arange(12), strengths)
    np.testing.assert_allclose(emission[:4], [(2.0, 0, 0), (4.0, 8, 0), (4.0, 8, 0), BLUE])
    for before, after in zip(found.groups, found.of_lamps(strengths)[1:], strict=True):
        np.testing.assert_allclose(after, before.strength * (0.5, 2.0, 1.0))
    with pytest.raises(SceneError, match="several colors"):
        found.checked(np.array([(0.0, 0, 0), (4.0, 8.0, 1.0), BLUE]))


@pytest.mark.parametrize("part", [0.1, 0.9])
def test_gains_weigh_strengths_whether_few_points_are_reached_or_many(part: float) -> None:
    rng = np.random.default_rng(1)
    each = np.where(rng.random((3, 400)) < part, rng.random((3, 400)), 0.0)
    gains = LightGains(400)
    for number, gain in enumerate(each):
        gains.put(number, gain)
    strengths = rng.random((4, 3))
    strengths[1] = 0.0
    np.testing.assert_allclose(gains.irradiance(strengths), each.T @ strengths[:3], rtol=1e-6)
    assert gains.nbytes <= 3 * 400 * 4
    assert (gains.nbytes < 3 * 400 * 2) == (part == 0.1)


def test_mixtures_of_known_light_are_known() -> None:
    rng = np.random.default_rng(2)
    response = rng.random((3, 50))
    known = rng.random((2, 3, 3)) * np.array([1e3, 1e-2, 1.0])[:, None]

    def table(strengths: np.ndarray) -> np.ndarray:
        return np.asarray(response.T @ strengths, dtype=np.float32)

    earlier = WarmStart(known[0], table(known[0]))
    assert earlier.mixed(known[1]) is None
    earlier.add(known[1], table(known[1]))
    mixture = 0.3 * known[0] + known[1] * (1.0, 0.5, 2.0)
    found = earlier.mixed(mixture)
    assert found is not None
    np.testing.assert_allclose(found, table(mixture), rtol=1e-4)
    # A change of the dimmest source is no mixture, small as its number is.
    assert earlier.mixed(mixture + np.array([0, 1e-4, 0])[:, None]) is None


def test_the_first_light_is_never_forgotten() -> None:
    one = np.eye(20)[:, :, None] * np.ones(3)
    earlier = WarmStart(one[0], np.ones((1, 3), dtype=np.float32))
    for strengths in one[1:]:
        earlier.add(strengths, np.ones((1, 3), dtype=np.float32))
    known = [number for number in range(20) if earlier.mixed(one[number]) is not None]
    assert known == [0, *range(20 - MAX_SOLUTIONS + 1, 20)]


def test_parts_are_scaled_to_sum_to_the_whole() -> None:
    parts = np.array([[1.0, 0.0, -0.1, 0.0], [3.0, 2.0, 0.4, 0.0]])
    whole = np.array([5.0, 2.0, 0.2, 0.1])
    share_out(whole, list(parts))
    np.testing.assert_allclose(parts, [[1.25, 0, 0, 0], [3.75, 2, 0.2, 0.1]], rtol=1e-6)


def test_what_is_known_is_taken_off_and_nothing_falls_below_0() -> None:
    known = np.array([[4.0, 4.0, 0.0], [2.0, 0.0, 0.0]])
    earlier = WarmStart(known, np.array([[10.0, 20.0, 0.0]], dtype=np.float32))
    table, left = earlier.part_of(np.array([[3.0, 8.0, 1.0], [5.0, 1.0, 0.0]]))
    np.testing.assert_allclose(left, [[0.0, 0.0, 1.0], [3.5, 1.0, 0.0]])
    np.testing.assert_allclose(table, [[7.5, 40.0, 0.0]])
