"""Images of reflectance, emission and opacity: look-ups, area means, and what is refused."""

import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.numerics.radiometry import MAX_REFLECTANCE
from radiosity_addon.numerics.triangles import WHOLE_TRIANGLE, split_in_four
from radiosity_addon.scene.scene import Scene
from radiosity_addon.scene.textures import SurfaceImages, where_there

LOWER, UPPER = [[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]


def images_of(values, uv=(LOWER, UPPER), textured=(True, True)):
    """Two triangles that show the lower and the upper half of an image."""
    return SurfaceImages(values, np.array(uv, dtype=float), np.array(textured))


def noise(height, width, seed=0):
    return np.random.default_rng(seed).random((height, width, 7)) * 0.9


def test_no_channel_reflects_and_passes_more_than_arrives():
    chance = np.random.default_rng(2)
    passes = chance.random((8, 8, 3))
    values = np.ones((8, 8, 7))
    values[..., :3] = chance.random((8, 8, 3))
    values[..., 6] = 1 - passes.mean(axis=2)
    uv, all_ = np.array((LOWER, UPPER), dtype=float), np.ones(2, bool)
    images = SurfaceImages(values, uv, all_, passes, all_)
    left = MAX_REFLECTANCE * (1 - passes) / values[..., 6:]
    np.testing.assert_allclose(images.values[..., :3], np.minimum(values[..., :3], left), rtol=1e-5)
    assert (values[..., :3] > left).any(axis=(0, 1)).all()
    # Interpolated as well.
    points = chance.dirichlet((1, 1, 1), 200)[:, 1:]
    rows = np.zeros(200, int)
    lost = 1 - images.at(rows, points)[:, :3] - images.passes_at(rows, points)
    assert (lost > -1e-6).all()


def test_texel_centers_hold_their_own_values():
    values = noise(4, 8)
    images = images_of(values)
    row, column = np.divmod(np.arange(32), 8)
    u, v = (column + 0.5) / 8, (row + 0.5) / 4
    lower = v <= u
    # Lower: (u, v) = b1 (1, 0) + b2 (1, 1); upper: b1 (1, 1) + b2 (0, 1).
    weights = np.where(lower[:, None], np.stack([u - v, v], 1), np.stack([u, v - u], 1))
    found = images.at(np.where(lower, 0, 1), weights)
    exact = values[row, column]
    exact[:, :6] *= exact[:, 6:]
    assert found == pytest.approx(exact, abs=1e-6)
    reflectance, emission = where_there(found)
    assert np.concatenate([reflectance, emission], 1) == pytest.approx(values[row, column, :6], abs=1e-5)
    assert images.opacity_at(np.where(lower, 0, 1), weights) == pytest.approx(
        values[row, column, 6], abs=1e-6
    )


def test_looking_up_a_linear_image_is_exact_between_its_texels():
    row, column = np.mgrid[:16, :16]
    values = np.ones((16, 16, 7))
    values[..., 0] = (column + 0.5) / 16 * 0.9
    values[..., 3] = (row + 0.5) / 16
    points = np.random.default_rng(1).dirichlet((2, 2, 2), 200)[:, 1:] * 0.8 + 0.07
    found = images_of(values).at(np.zeros(200, int), points)
    assert found[:, 0] == pytest.approx(0.9 * (points[:, 0] + points[:, 1]), abs=1e-6)
    assert found[:, 3] == pytest.approx(points[:, 1], abs=1e-6)


def test_area_means_of_a_linear_image_are_its_values_at_the_centroids():
    row, column = np.mgrid[:64, :64]
    values = np.ones((64, 64, 7))
    values[..., 0], values[..., 4] = column / 80, row
    images = images_of(values)
    part = np.array([[0.1, 0.1], [0.7, 0.15], [0.2, 0.6]])
    mean = images.area_means(np.array([1]), part[None])
    # Each sample takes the texel it lies in: steps of 1, that cancel out.
    exact = images.at(np.array([1]), part.mean(axis=0)[None])
    np.testing.assert_allclose(mean * (80, 1, 1, 1, 1, 1, 1), exact * (80, 1, 1, 1, 1, 1, 1), atol=0.003)


def test_the_mean_of_both_halves_is_the_mean_of_the_image():
    values = noise(32, 32)
    means = images_of(values).area_means(np.arange(2), np.stack([WHOLE_TRIANGLE] * 2))
    exact = np.concatenate([values[..., :6] * values[..., 6:], values[..., 6:]], axis=2).mean(axis=(0, 1))
    assert means.mean(axis=0) == pytest.approx(exact, rel=0.01)


def test_a_part_is_the_mean_of_its_quarters():
    images = images_of(noise(32, 32))
    corners = np.concatenate([WHOLE_TRIANGLE, np.zeros((3, 1))], axis=1)
    quarters = split_in_four(corners[None])[0, :, :, :2]
    whole = images.area_means(np.array([0]), WHOLE_TRIANGLE[None])
    assert images.area_means(np.zeros(4, int), quarters).mean(axis=0) == pytest.approx(whole[0], rel=1e-6)


def test_only_triangles_that_meet_a_hole_are_cut_out():
    values = np.ones((8, 8, 7)) * 0.5
    values[..., 6] = 1.0
    values[1, 6, 6] = 0.0
    uv = [[[0, 0], [0.4, 0], [0, 0.4]], [[0.6, 0.1], [1, 0], [1, 0.4]], [[0.6, 0.1], [1, 0], [1, 0.4]]]
    images = images_of(values, uv, (True, True, False))
    assert images.cut_out.tolist() == [False, True, False]


def test_what_textures_say_replaces_a_scenes_constants():
    values = np.full((2, 2, 7), 0.5)
    values[..., :3] = 1.0
    values[..., 3:6] = 8.0
    images = images_of(values, textured=(False, True))
    scene = Scene(
        np.random.default_rng(0).random((2, 3, 3)), np.full((2, 3), 0.3), np.zeros((2, 3)), images=images
    )
    assert scene.reflectance == pytest.approx(np.array([[0.3] * 3, [0.5 * MAX_REFLECTANCE] * 3]))
    assert scene.emission == pytest.approx(np.array([[0.0] * 3, [4.0] * 3]))
    assert scene.opacity.tolist() == [1.0, 0.5]


def test_what_cannot_be_is_refused_and_the_triangle_named():
    good = np.full((4, 4, 7), 0.5)
    with pytest.raises(SceneError, match="shape"):
        images_of(good[..., :6])
    with pytest.raises(SceneError, match="shape"):
        SurfaceImages(good, np.zeros((2, 2)), np.array([True, True]))
    with pytest.raises(SceneError, match="triangle 1"):
        images_of(good, (LOWER, [[0, 0], [1.5, 1], [0, 1]]))
    for channel, bad, complaint in ((2, -0.1, "negative"), (4, np.nan, "NaN"), (6, 1.5, "above 1")):
        values = good.copy()
        values[3, 0, channel] = bad
        with pytest.raises(SceneError, match=f"triangle 1 meets a texel .*{complaint}"):
            images_of(values, ([[0, 0], [0.5, 0], [0.5, 0.5]], UPPER))
        # Texels that no triangle shows may hold anything.
        images_of(values, ([[0, 0], [0.5, 0], [0.5, 0.5]], UPPER), (True, False))
    with pytest.raises(SceneError, match=r"2 triangles.* 1"):
        Scene(np.zeros((1, 3, 3)), np.zeros((1, 3)), np.zeros((1, 3)), images=images_of(good))
