"""The quantities of light follow from one another as their integrals say."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics.radiometry import (
    HEMISPHERE,
    SPHERE,
    brdf_of_reflectance,
    cone_projected_solid_angle,
    cone_solid_angle,
    flux_of_intensity,
    flux_of_radiance,
    intensity_of_flux,
    irradiance_from_point,
    irradiance_under_sky,
    radiance_of_disc,
    radiance_of_flux,
    radiance_of_radiosity,
    radiosity_of_radiance,
    reflected_radiance,
    sphere_area,
)
from radiosity_addon.solver import AreaLight, EnvironmentLight, PointLight, SpotLight, SunLight

UP = np.array([[0.0, 0.0, 1.0]])


def polar_integral(values, largest: float) -> float:
    """∫ values(θ) dω over the directions within `largest` of the axis, by Gauss and Legendre."""
    node, weight = np.polynomial.legendre.leggauss(64)
    theta = 0.5 * largest * (node + 1)
    return float(np.pi * largest * (weight * np.sin(theta) * values(theta)).sum())


def test_solid_angles_are_integrals_over_directions() -> None:
    assert polar_integral(np.ones_like, np.pi) == pytest.approx(SPHERE, rel=1e-12)
    assert polar_integral(np.cos, np.pi / 2) == pytest.approx(HEMISPHERE, rel=1e-12)
    for half in (1e-3, 0.3, 1.2):
        assert polar_integral(np.ones_like, half) == pytest.approx(
            cone_solid_angle(1 - np.cos(half)), rel=1e-9
        )
        assert polar_integral(np.cos, half) == pytest.approx(cone_projected_solid_angle(half), rel=1e-9)
    assert cone_projected_solid_angle(2.0) == HEMISPHERE
    assert cone_solid_angle(2.0) == SPHERE


def test_a_matte_surface_sends_pi_times_its_radiance() -> None:
    """(1.6) with L the same in all directions is (2.11)."""
    radiance = np.array([0.2, 1.0, 7.0])
    expected = [polar_integral(lambda theta, one=one: one * np.cos(theta), np.pi / 2) for one in radiance]
    np.testing.assert_allclose(radiosity_of_radiance(radiance), expected, rtol=1e-12)
    np.testing.assert_allclose(irradiance_under_sky(radiance), expected, rtol=1e-12)
    np.testing.assert_allclose(radiance_of_radiosity(radiosity_of_radiance(radiance)), radiance, rtol=1e-15)


def test_all_that_a_point_lamp_sends_arrives_on_a_sphere_and_half_on_a_plane() -> None:
    """Φ = 4πI (1.8, 1.9), H = I cosθ/r² (1.10)."""
    intensity = intensity_of_flux(12.0)
    assert flux_of_intensity(intensity) == pytest.approx(12.0, rel=1e-15)
    for radius in (0.1, 3.0):
        arriving = irradiance_from_point(intensity, 1.0, radius) * sphere_area(radius)
        assert arriving == pytest.approx(12.0, rel=1e-14)
    # The plane at height h: s = h tanθ, dA = 2π s ds.
    height, (node, weight) = 0.7, np.polynomial.legendre.leggauss(64)
    theta = 0.25 * np.pi * (node + 1)
    ring = 2 * np.pi * height**2 * np.tan(theta) / np.cos(theta) ** 2
    irradiance = irradiance_from_point(intensity, np.cos(theta), height / np.cos(theta))
    assert 0.25 * np.pi * (weight * ring * irradiance).sum() == pytest.approx(6.0, rel=1e-12)


def test_flat_lamps_send_their_power() -> None:
    radiance = radiance_of_flux(np.array([30.0, 20.0, 10.0]), 2.5)
    np.testing.assert_allclose(flux_of_radiance(radiance, 2.5), [30, 20, 10], rtol=1e-15)
    # A disc of intensity I, seen face on from a distance d, fills a cone of tanα = r/d.
    intensity, radius, distance = 3.0, 0.4, 1.1
    arriving = radiance_of_disc(intensity, radius) * cone_projected_solid_angle(np.arctan2(radius, distance))
    assert arriving == pytest.approx(intensity / (distance**2 + radius**2), rel=1e-14)


def test_the_lambert_brdf_reflects_its_reflectance() -> None:
    """ρ = ∫∫ f cosθ_i cosθ_r dω_i dω_r / ∫ cosθ_i dω_i, (2.9) with the cosine it lacks."""
    brdf = brdf_of_reflectance(0.6)
    cosines = polar_integral(np.cos, np.pi / 2)
    assert brdf * cosines * cosines / cosines == pytest.approx(0.6, rel=1e-12)
    # Reflected radiance over the hemisphere is ρH (2.10 – 2.13).
    irradiance = np.array([1.0, 4.0])
    np.testing.assert_allclose(
        radiosity_of_radiance(reflected_radiance(brdf, irradiance)), 0.6 * irradiance, rtol=1e-15
    )


def test_light_finds_the_same_way_back_over_a_matte_surface() -> None:
    """f(i → r) = f(r → i) (2.3) of what a surface reflects, measured as (2.1) has it: L_r over H."""

    def measured(toward_lamp: float, toward_eye: float) -> float:
        """f between two cosines, of one lamp and of what B = πL sends to the eye."""
        arriving = irradiance_from_point(2.0, toward_lamp, 3.0)
        sent = radiance_of_radiosity(0.6 * arriving) * toward_eye  # per projected area of the surface
        return float(sent / toward_eye / arriving)

    for one, other in [(0.9, 0.2), (1.0, 0.05), (0.5, 0.6)]:
        assert measured(one, other) == pytest.approx(measured(other, one), rel=1e-14)
        assert measured(one, other) == pytest.approx(brdf_of_reflectance(0.6), rel=1e-14)


def irradiance(light: PointLight | SpotLight | SunLight | AreaLight, point: tuple[float, ...]) -> np.ndarray:
    return light.unit_irradiance(np.array([point]), UP) * light.strength


def test_lamps_are_made_of_these_quantities() -> None:
    """A lamp of intensity I or radiance L gives what the formulas say."""
    power = flux_of_intensity(2.0)
    cosine, distance = 3 / 5, 5.0
    expected = irradiance_from_point(2.0, cosine, distance)
    for light in (PointLight((0, 0, 3), power), SpotLight((0, 0, 3), (0, 0, -1), power, np.pi, blend=0.0)):
        np.testing.assert_allclose(irradiance(light, (4, 0, 0)), expected, rtol=1e-12)
    # Inside a sphere, and right under a wide area lamp, its radiance is all that is seen.
    lamp = PointLight((0, 0, 0.1), power, radius=0.5, soft_falloff=False)
    assert irradiance(lamp, (0, 0, 0))[0] == pytest.approx(
        irradiance_under_sky(radiance_of_disc(2.0, 0.5)), rel=1e-12
    )
    wide = AreaLight((0, 0, 1e-4), (2, 0, 0), (0, -2, 0), flux_of_radiance(5.0, 4.0))
    assert irradiance(wide, (0, 0, 0))[0] == pytest.approx(irradiance_under_sky(5.0), rel=1e-4)


def test_a_sky_of_equal_radiance_lights_like_a_sun_that_fills_it() -> None:
    sky = EnvironmentLight(0.8)
    sun = SunLight((0, 0, -1), 0.8 * cone_projected_solid_angle(np.pi / 2), angle=np.pi)
    np.testing.assert_allclose(irradiance(sun, (0, 0, 0)), irradiance_under_sky(sky.strength), rtol=1e-12)
