"""Spots whose cone is stretched, as uneven scale makes it: shape, power and rays."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.numerics.sampling import stratified_square
from radiosity_addon.solver import SpotLight

DOWN = (0.0, 0.0, -1.0)

STRETCHED = np.diag([0.5, 1.4, 1.0]) @ [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]
"""Where the cone is round."""


def all_around() -> np.ndarray:
    """Return directions spread evenly over the sphere, along a spiral."""
    count = 200_000
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


def test_a_stretched_spot_lights_an_ellipse() -> None:
    """A meter below, its edge is tan(angle/2) away where directions were turned to, and the power fits."""
    lamp = SpotLight((0, 0, 0), DOWN, 4 * np.pi, angle=1.2, blend=0.0, round_from_world=STRETCHED)
    turn = np.linspace(0, 2 * np.pi, 100)
    rim = np.tan(0.6) * np.stack([np.cos(turn), np.sin(turn)], axis=-1) @ np.linalg.inv(STRETCHED[:2, :2]).T
    up = np.tile([[0.0, 0, 1]], (len(turn), 1))
    for part, lit in ((0.99, True), (1.01, False)):
        points = np.insert(part * rim, 2, -1.0, axis=1)
        distance = np.linalg.norm(points, axis=1)
        expected = 1 / (4 * np.pi * distance**3) if lit else 0.0
        np.testing.assert_allclose(lamp.unit_irradiance(points, up), expected, rtol=1e-12)
    tangents = np.linalg.norm(rim, axis=1)
    np.testing.assert_allclose(np.tan(lamp.half_angles), [tangents.min(), tangents.max()], rtol=2e-3)


@pytest.mark.parametrize("blend", [0.0, 0.4])
def test_a_stretched_spots_flux_is_what_arrives_around_it(blend: float) -> None:
    lamp = SpotLight((0, 0, 0), DOWN, 5.0, angle=1.2, blend=blend, round_from_world=STRETCHED)
    directions = all_around()
    arriving = lamp.unit_irradiance(directions, -directions).mean() * 4 * np.pi
    np.testing.assert_allclose(lamp.flux, 5.0 * arriving, rtol=2e-3)


def test_rays_from_a_stretched_spot_stand_for_its_power() -> None:
    """Of what it sends out, the same part goes to the left as arrives there."""
    lamp = SpotLight((0, 0, 0), DOWN, 5.0, angle=1.2, blend=0.4, round_from_world=STRETCHED)
    unit = stratified_square(np.zeros(1, int), 40_000, 3)[0]
    _, rays, shares = lamp.emit(unit, unit)
    even = all_around()
    arriving = lamp.unit_irradiance(even, -even)
    wide = np.array([0.6, -0.8, 0.0])
    sent_there = shares[rays @ wide > 0.2].sum() / shares.sum()
    assert 0.01 < sent_there < 0.5
    assert sent_there == pytest.approx(arriving[even @ wide > 0.2].sum() / arriving.sum(), rel=0.01)


def test_where_a_stretched_cones_edge_crosses_a_wide_lamp_it_is_averaged() -> None:
    """The closed form is the mean of the shadow rays, at points all over the floor below."""
    spot = SpotLight((0, 0, 1), DOWN, 1.0, angle=1.2, blend=0.1, radius=0.15, round_from_world=STRETCHED)
    x, y = np.meshgrid(np.linspace(-1.6, 1.6, 17), np.linspace(-1.6, 1.6, 17))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    up = np.tile([[0.0, 0, 1]], (x.size, 1))
    u = stratified_square(np.arange(x.size), 4096, 5)
    weights = spot.shadow_rays(points, up, u)[2].sum(axis=1)
    exact = spot.unit_irradiance(points, up)
    np.testing.assert_allclose(weights, exact, atol=0.01 * exact.max())


def test_a_stretched_spot_needs_an_extent() -> None:
    with pytest.raises(SceneError, match="scale"):
        SpotLight((0, 0, 0), DOWN, 1.0, angle=1.2, round_from_world=np.diag([1.0, 0.0, 1.0]))
