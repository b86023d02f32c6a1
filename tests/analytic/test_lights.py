"""Lamps against closed forms: falloff, flux, horizons, and rays that integrate to the same."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.form_factors.formulas import cap_cosine, point_to_ellipse, point_to_polygon
from radiosity_addon.lights.sun_and_sky import (
    AreaLight,
    EnvironmentLight,
    Lamp,
    Light,
    PointLight,
    SpotLight,
    SunLight,
)
from radiosity_addon.numerics.sampling import points_on_triangles, stratified_square
from tests.vectors import unit_rows

DOWN = (0.0, 0.0, -1.0)

LAMPS: dict[str, Lamp] = {
    "point": PointLight((0.3, 0.2, 1.0), 10.0),
    "point with a radius": PointLight((0.3, 0.2, 0.6), 10.0, radius=0.5),
    "sphere": PointLight((0.3, 0.2, 0.6), 10.0, radius=0.5, soft_falloff=False),
    "spot": SpotLight((0.3, 0.2, 1.0), (-0.3, 0.5, -0.9), 10.0, angle=1.2, blend=0.4),
    "spot with a radius": SpotLight(
        (0.3, 0.2, 1.0), (-0.3, 0.5, -0.9), 10.0, angle=1.2, blend=0.4, radius=0.3
    ),
    "sphere spot": SpotLight(
        (0.3, 0.2, 1.0), DOWN, 10.0, angle=1.5, blend=1.0, radius=0.2, soft_falloff=False
    ),
    "sun": SunLight((0.3, -0.5, -0.4), 3.0),
    "wide sun": SunLight((0.3, -0.5, -0.4), 3.0, angle=2.0),
    "rectangle": AreaLight((0.3, 0.2, 0.8), (1.0, 0.1, 0.2), (0.0, -0.6, 0.1), 10.0),
    "ellipse": AreaLight((0.3, 0.2, 0.8), (1.0, 0.1, 0.2), (0.0, -0.6, 0.1), 10.0, shape="ellipse"),
    "narrow rectangle": AreaLight((0.3, 0.2, 0.8), (1.0, 0.1, 0.2), (0.0, -0.6, 0.1), 10.0, spread=1.2),
    "narrow ellipse": AreaLight(
        (0.3, 0.2, 0.8), (1.0, 0.1, 0.2), (0.0, -0.6, 0.1), 10.0, shape="ellipse", spread=1.2
    ),
}


def below(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return points below the lamps and normals, most of them upwards."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.5, 1.5, size=(count, 3)) * [1, 1, 0.1] - [0, 0, 0.15]
    normals = unit_rows(rng, count) + np.array([0, 0, 1.5])
    return points, normals / np.linalg.norm(normals, axis=1)[:, None]


def box_flux(lamp: Lamp, half: float, cells: int = 48) -> float:
    """Integrate a lamp's unit irradiance over the inside of a cube around the origin."""
    nodes, weights = np.polynomial.legendre.leggauss(cells)
    x, y = (axis.ravel() for axis in np.meshgrid(nodes * half, nodes * half))
    weight = np.outer(weights, weights).ravel() * half * half
    total = 0.0
    for axis in range(3):
        for side in (-half, half):
            points = np.insert(np.stack([x, y], axis=-1), axis, side, axis=1)
            normals = np.zeros_like(points)
            normals[:, axis] = -np.sign(side)
            total += float(lamp.unit_irradiance(points, normals) @ weight)
    return total


# --- point and spot ---------------------------------------------------------------------------


def test_inverse_square_and_cosine() -> None:
    lamp = PointLight((1, 2, 3), 8 * np.pi)
    away = np.array([[0.0, 0, -1], [0, 0, -2], [0, 0, -4]])
    tilted = np.tile([[np.sin(0.7), 0, np.cos(0.7)]], (3, 1))
    irradiance = lamp.unit_irradiance(away + lamp.position, tilted) * lamp.strength[0]
    np.testing.assert_allclose(irradiance, 2 * np.cos(0.7) / np.array([1, 4, 16]), rtol=1e-14)
    assert lamp.unit_irradiance(away + lamp.position, -tilted) == pytest.approx(np.zeros(3), abs=0)


def test_point_flux_through_a_box_is_its_power() -> None:
    assert box_flux(PointLight((0.3, -0.2, 0.4), 5.0), 1.0) == pytest.approx(1.0, abs=1e-9)


def test_sphere_flux_through_a_box_is_its_power_and_a_soft_disk_sends_less() -> None:
    """A sphere's radiance I/(π r²) over its whole surface adds up to the power."""
    assert box_flux(PointLight((0.2, 0, 0), 5.0, radius=0.3, soft_falloff=False), 1.0) == pytest.approx(
        1, abs=1e-6
    )
    lamp = PointLight((0, 0, 0), 5.0, radius=0.3)
    directions = unit_rows(np.random.default_rng(0), 500)
    on_sphere = lamp.unit_irradiance(2 * directions, -directions) * 4 * np.pi * 4
    np.testing.assert_allclose(on_sphere, 4 / (4 + 0.09), rtol=1e-12)


def test_radius_on_the_axis_and_inside() -> None:
    up, origin = np.array([[0.0, 0, 1]]), np.zeros((1, 3))
    for distance in (0.0, 0.1, 0.5, 3.0):
        soft = PointLight((0, 0, distance), 4 * np.pi, radius=0.5)
        hard = PointLight((0, 0, distance), 4 * np.pi, radius=0.5, soft_falloff=False)
        if distance > 0:
            assert soft.unit_irradiance(origin, up) * 4 * np.pi == pytest.approx(1 / (distance**2 + 0.25))
        assert hard.unit_irradiance(origin, up) * 4 * np.pi == pytest.approx(1 / max(distance, 0.5) ** 2)


def test_a_lamp_exactly_at_the_point_stays_finite() -> None:
    up, origin = np.array([[0.0, 0, 1]]), np.zeros((1, 3))
    u = np.full((1, 4, 2), 0.3)
    for lamp in (
        PointLight((0, 0, 0), 1.0),
        PointLight((0, 0, 0), 1.0, 0.1),
        PointLight((0, 0, 0), 1.0, 0.1, False),
    ):
        assert np.isfinite(lamp.unit_irradiance(origin, up)).all()
        assert all(np.isfinite(part).all() for part in lamp.shadow_rays(origin, up, u))


@pytest.mark.parametrize("soft", [True, False])
def test_setting_behind_the_horizon_is_continuous(soft: bool) -> None:
    """As the receiver turns away, irradiance falls to 0 without a jump, also for sphere and disk."""
    lamp = PointLight((0, 0, 1), 1.0, radius=0.4, soft_falloff=soft)
    angle = np.linspace(0, np.pi, 20001)
    normals = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=-1)
    irradiance = lamp.unit_irradiance(np.zeros_like(normals), normals)
    assert np.abs(np.diff(irradiance)).max() < 1.1 * irradiance[0] * angle[1]
    assert (np.diff(irradiance) <= 1e-17).all()
    assert irradiance[-1] == 0
    assert irradiance[10000] > 0  # half of it is still up at 90°


@pytest.mark.parametrize("blend", [0.0, 0.15, 1.0])
@pytest.mark.parametrize("angle", [0.3, 1.5, np.pi])
def test_spot_cone_is_the_smoothstep_of_the_cosine(angle: float, blend: float) -> None:
    lamp = SpotLight((0, 0, 0), (0, 0, -2), 4 * np.pi, angle=angle, blend=blend)
    edge = np.cos(angle / 2)
    theta = np.linspace(0, np.pi, 400)
    directions = np.stack([np.sin(theta), np.zeros_like(theta), -np.cos(theta)], axis=-1)
    step = np.clip((np.cos(theta) - edge) / max((1 - edge) * blend, 1e-12), 0, 1)
    expected = step * step * (3 - 2 * step)
    assert lamp.unit_irradiance(directions, -directions) * 4 * np.pi == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("blend", [0.0, 0.15, 1.0])
@pytest.mark.parametrize("angle", [0.3, 1.5, np.pi])
def test_spot_flux_is_what_arrives_around_it(angle: float, blend: float) -> None:
    lamp = SpotLight((0, 0, 0), DOWN, (1.0, 2.0, 4.0), angle=angle, blend=blend)
    edge = np.cos(angle / 2)
    cosine = edge + (1 - edge) * (np.arange(20000) + 0.5) / 20000
    directions = np.stack([np.sqrt(1 - cosine**2), np.zeros_like(cosine), -cosine], axis=-1)
    arriving = lamp.unit_irradiance(directions, -directions).mean() * 2 * np.pi * (1 - edge)
    np.testing.assert_allclose(lamp.flux, arriving * lamp.strength, rtol=1e-6)


def test_a_spread_of_nothing_is_a_parallel_beam() -> None:
    """Below a lamp of a square meter and a watt lies a square meter with 1 W/m², and darkness around it."""
    lamp = AreaLight((0, 0, 2.0), (1, 0, 0), (0, -1, 0), 1.0, spread=0.0)
    points = np.array([[0.0, 0, 0], [0.49, 0.49, 0], [0.51, 0, 0], [0, -0.51, 0]])
    light = lamp.unit_irradiance(points, np.tile([[0.0, 0, 1]], (4, 1)))
    np.testing.assert_allclose(light, [1, 1, 0, 0], rtol=3e-3)


def test_a_spot_with_a_radius_softens_its_edge_about_the_point_spot() -> None:
    """Across the cone's edge a hard spot's irradiance is the share of its disk that lights."""
    lamp = SpotLight((0, 0, 1), DOWN, 1.0, angle=np.pi / 2, blend=0.0, radius=0.1)
    point = SpotLight((0, 0, 1), DOWN, 1.0, angle=np.pi / 2, blend=0.0)
    x = np.array([0.5, 0.85, 0.95, 1.0, 1.05, 1.15, 1.5])
    points = np.stack([x, 0 * x, 0 * x], axis=-1)
    up = np.tile([[0.0, 0, 1]], (len(x), 1))
    plain = PointLight((0, 0, 1), 1.0, radius=0.1).unit_irradiance(points, up)
    share = lamp.unit_irradiance(points, up) / plain
    assert share[0] == share[1] == 1
    assert share[-1] == share[-2] == 0
    assert 1 > share[2] > share[3] > share[4] > 0
    assert share[3] == pytest.approx(0.5, abs=0.05)
    assert (point.unit_irradiance(points, up) > 0).tolist() == (x < 1).tolist()


# --- sun and area -----------------------------------------------------------------------------


def test_sun_gives_its_irradiance_to_what_faces_it_whatever_its_angle() -> None:
    directions = unit_rows(np.random.default_rng(1), 50)
    for angle in (0.0, 0.01, 1.0, np.pi):
        for direction in directions[:5]:
            lamp = SunLight(3 * direction, (1.0, 2.0, 3.0), angle=angle)
            assert lamp.unit_irradiance(np.zeros((1, 3)), -direction[None]) == pytest.approx(1.0, abs=1e-12)
            cosine = -(directions @ direction)
            up = cosine > np.sin(angle / 2)
            irradiance = lamp.unit_irradiance(np.zeros((50, 3)), directions)
            np.testing.assert_allclose(irradiance[up], cosine[up], atol=1e-12)
            np.testing.assert_allclose(irradiance, cap_cosine(cosine, np.sin(angle / 2)), atol=1e-15)
            assert (irradiance[cosine < -np.sin(angle / 2)] == 0).all()


def test_area_irradiance_is_radiance_times_projected_solid_angle() -> None:
    lamp = AreaLight((0, 0, 2), (1.5, 0, 0), (0, -1, 0), 6.0)
    radiance = 6.0 / (np.pi * 1.5)
    corners = np.array([[-0.75, 0.5, 2], [0.75, 0.5, 2], [0.75, -0.5, 2], [-0.75, -0.5, 2]])
    points, normals = below(200)
    expected = np.pi * radiance * point_to_polygon(points, normals, np.broadcast_to(corners, (200, 4, 3)))
    assert (expected > 0).all()
    np.testing.assert_allclose(lamp.unit_irradiance(points, normals) * lamp.strength[0], expected, rtol=1e-12)
    above = points + np.array([0, 0, 5])
    assert not lamp.unit_irradiance(above, -normals).any()


def test_ellipse_irradiance_on_its_axis() -> None:
    """A disk of radius r at distance d: H = π L r²/(d² + r²) = P / (π (d² + r²))."""
    lamp = AreaLight((0, 0, 2), (1, 0, 0), (0, -1, 0), 6.0, shape="ellipse")
    assert lamp.area == pytest.approx(np.pi / 4)
    irradiance = lamp.unit_irradiance(np.zeros((1, 3)), np.array([[0.0, 0, 1]])) * 6
    assert irradiance == pytest.approx(6 / (np.pi * (4 + 0.25)), rel=1e-9)
    points, normals = below(50)
    factors = point_to_ellipse(points, normals, (0, 0, 2), (0.5, 0, 0), (0, -0.5, 0))
    np.testing.assert_allclose(lamp.unit_irradiance(points, normals), factors / lamp.area, rtol=1e-12)


@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
def test_area_flux_through_a_box_is_its_power(shape: str) -> None:
    lamp = AreaLight((0.1, 0.0, 0.2), (0.6, 0.1, 0), (0, 0.4, 0.3), 6.0, shape=shape)
    assert box_flux(lamp, 1.0) == pytest.approx(1.0, abs=2e-3)
    assert lamp.flux == pytest.approx(np.full(3, 6.0))


def test_lamps_far_away_are_point_lamps() -> None:
    points, normals = below(100)
    far = np.array([300.0, -200.0, 500.0])
    toward = -far / np.linalg.norm(far)
    reference = PointLight(far, 1.0).unit_irradiance(points, normals)
    for lamp in (
        PointLight(far, 1.0, radius=0.1),
        PointLight(far, 1.0, radius=0.1, soft_falloff=False),
        SpotLight(far, toward, 1.0, angle=0.5, radius=0.1),
    ):
        np.testing.assert_allclose(lamp.unit_irradiance(points, normals), reference, rtol=1e-5)
    # A flat lamp faces the origin: four times a sphere's intensity, P/π against P/4π.
    side = np.cross(toward, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    for shape in ("rectangle", "ellipse"):
        lamp = AreaLight(far, side, np.cross(toward, side), 1.0, shape=shape)
        np.testing.assert_allclose(lamp.unit_irradiance(points, normals), 4 * reference, rtol=1e-4)


# --- shadow rays ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LAMPS)
def test_shadow_ray_weights_add_up_to_the_irradiance(name: str) -> None:
    lamp = LAMPS[name]
    points, normals = below(64, seed=3)
    u = stratified_square(np.arange(64), 4096)
    directions, distances, weights = lamp.shadow_rays(points, normals, u)
    expected = lamp.unit_irradiance(points, normals)
    assert (expected > 0).sum() > 10
    np.testing.assert_allclose(weights.sum(axis=1), expected, atol=4e-3 * expected.max())
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1.0, atol=1e-9)
    assert (weights >= 0).all()
    assert directions.shape == (64, 4096, 3)
    assert distances.shape == weights.shape == (64, 4096)
    level = np.einsum("ikj,ij->ik", directions, normals)
    assert (weights[level < -1e-12] == 0).all()
    assert np.isinf(distances).all() == isinstance(lamp, SunLight)


@pytest.mark.parametrize("name", ["point", "point with a radius", "sphere", "rectangle", "ellipse"])
def test_shadow_rays_end_on_the_lamp(name: str) -> None:
    lamp = LAMPS[name]
    points, normals = below(20)
    directions, distances, _ = lamp.shadow_rays(points, normals, stratified_square(np.arange(20), 64))
    offsets = points[:, None] + distances[..., None] * directions - np.asarray(lamp.position)
    reach = np.linalg.norm(offsets, axis=2)
    if isinstance(lamp, AreaLight):
        frame = np.stack([lamp.edge_u, lamp.edge_v, np.cross(lamp.edge_u, lamp.edge_v)])
        across = offsets @ np.linalg.inv(frame)
        assert np.abs(across[..., 2]).max() < 1e-12
        size = np.linalg.norm(across[..., :2], axis=2) if lamp.shape == "ellipse" else np.abs(across[..., :2])
        assert size.max() <= 0.5 + 1e-12
        assert size.max() > 0.45
    elif lamp.soft_falloff:
        assert reach.max() <= lamp.radius + 1e-12
        center = np.asarray(lamp.position) - points
        assert np.abs(np.einsum("ikj,ij->ik", offsets, center)).max() < 1e-12  # a disk that faces the point
    else:
        np.testing.assert_allclose(reach, lamp.radius, atol=1e-9)


def test_half_covered_disk_has_half_its_visibility() -> None:
    """Σ w v / Σ w against the closed form of the half of the lamp a blocker leaves."""
    lamp = AreaLight((0, 0, 1), (1, 0, 0), (0, -1, 0), 1.0)
    half = AreaLight((0.25, 0, 1), (0.5, 0, 0), (0, -1, 0), 1.0)
    point, normal = np.array([[0.4, 0.1, 0.0]]), np.array([[0.0, 0, 1]])
    directions, distances, weights = lamp.shadow_rays(point, normal, stratified_square([0], 4096))
    visible = (point[:, None] + distances[..., None] * directions)[..., 0] > 0
    expected = 0.5 * half.unit_irradiance(point, normal) / lamp.unit_irradiance(point, normal)
    assert (weights * visible).sum() / weights.sum() == pytest.approx(expected[0], abs=1e-3)


@pytest.mark.parametrize("name", ["point", "spot", "sphere spot", "rectangle", "ellipse"])
def test_emitted_rays_carry_the_flux_the_irradiance_collects(name: str) -> None:
    """The share of rays that meet a triangle against the integral of the irradiance over it."""
    lamp = LAMPS[name]
    triangle = np.array([[[-1.0, -1.0, -0.5], [1.5, -0.6, -0.4], [0.1, 1.6, -0.6]]])
    cross = np.cross(triangle[0, 1] - triangle[0, 0], triangle[0, 2] - triangle[0, 0])
    area, normal = np.linalg.norm(cross) / 2, cross / np.linalg.norm(cross)
    points = points_on_triangles(triangle, stratified_square([0], 1 << 14).astype(float))[0]
    arriving = lamp.unit_irradiance(points, np.broadcast_to(normal, points.shape)).mean() * area

    u, v = stratified_square([0], 1 << 15, seed=1)[0], stratified_square([0], 1 << 15, seed=2)[0]
    origins, directions, shares = lamp.emit(u, v)
    reach = ((triangle[0, 0] - origins) @ normal) / (directions @ normal)
    corners = np.linalg.solve(triangle[0].T, (origins + reach[:, None] * directions).T)
    hit = (reach > 0) & (corners > 0).all(axis=0)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-9)
    collected = (shares * hit).sum() / shares.sum() * lamp.flux[0] / lamp.strength[0]
    assert collected == pytest.approx(arriving, rel=5e-3)


# --- values -----------------------------------------------------------------------------------


def test_strengths_are_rgb_and_read_only() -> None:
    assert PointLight((0, 0, 0), 3).strength.tolist() == [3, 3, 3]
    assert EnvironmentLight((1, 2, 3)).strength.tolist() == [1, 2, 3]
    assert SunLight(DOWN, [1, 0, 0]).strength.tolist() == [1, 0, 0]
    power = np.array([1.0, 2.0, 3.0])
    lamp = AreaLight((0, 0, 0), (1, 0, 0), (0, 1, 0), power)
    power[0] = 9
    assert lamp.flux.tolist() == [1, 2, 3]
    with pytest.raises(ValueError, match="read-only"):
        lamp.strength[0] = 5


GOOD: dict[type[Light], dict[str, object]] = {
    PointLight: {"position": (0, 0, 0), "power": 1.0},
    SpotLight: {"position": (0, 0, 0), "direction": DOWN, "power": 1.0, "angle": 1.0},
    SunLight: {"direction": DOWN, "irradiance": 1.0},
    AreaLight: {"position": (0, 0, 0), "edge_u": (1, 0, 0), "edge_v": (0, 1, 0), "power": 1.0},
    EnvironmentLight: {"radiance": 1.0},
}


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (PointLight, "position", (0, np.nan, 0)),
        (PointLight, "position", (0, 0)),
        (PointLight, "power", -1.0),
        (PointLight, "power", (1, 2)),
        (PointLight, "radius", -0.1),
        (PointLight, "radius", np.inf),
        (SpotLight, "direction", (0, 0, 0)),
        (SpotLight, "angle", 0.0),
        (SpotLight, "angle", 4.0),
        (SpotLight, "angle", np.nan),
        (SpotLight, "blend", 1.5),
        (SpotLight, "power", (1, np.inf, 0)),
        (SunLight, "direction", (0, 0, 0)),
        (SunLight, "irradiance", np.nan),
        (SunLight, "angle", -0.1),
        (AreaLight, "edge_v", (2, 0, 0)),
        (AreaLight, "edge_u", (np.inf, 0, 0)),
        (AreaLight, "shape", "disk"),
        (AreaLight, "power", (-1, 0, 0)),
        (EnvironmentLight, "radiance", -2.0),
    ],
)
def test_bad_values_name_the_lamp_and_the_field(kind: type[Light], field: str, value: object) -> None:
    kind(**GOOD[kind])
    with pytest.raises(SceneError) as caught:
        kind(**{**GOOD[kind], field: value, "name": "Key"})
    message = str(caught.value)
    assert "'Key'" in message
    assert ("area" if field == "edge_v" else field) in message
    assert "; " in message
    assert "\n" not in message
