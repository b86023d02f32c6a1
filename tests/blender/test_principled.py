"""Principled comes to what Cycles bounces off it; what it does beyond is told."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.materials.gloss import Gloss
from radiosity_addon.blender.materials.materials import read_material
from tests.blender.scenes import shader_material
from tests.blender.test_materials import BLUE, RED, assert_surface, messages_of
from tests.wording import says


def test_principled_reflects_its_base_color_where_nothing_shines() -> None:
    surface = read_material(
        shader_material("M", "ShaderNodeBsdfPrincipled", Base_Color=RED, Specular_IOR_Level=0)
    )
    assert_surface(surface, RED[:3])
    assert surface.warnings == ()


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
def test_a_white_metal_loses_nothing_however_rough(roughness: float) -> None:
    inputs = {"Base_Color": (0.99, 0.99, 0.99, 1), "Metallic": 1, "Roughness": roughness}
    surface = read_material(shader_material("M", "ShaderNodeBsdfPrincipled", **inputs))
    np.testing.assert_allclose(surface.reflectance, 0.99, atol=0.015)


@pytest.mark.parametrize(
    ("metallic", "roughness", "base", "measured"),
    [
        # 1 − 1/L of a small matte square's light L = H/π inside a closed cube of the material
        # that emits 1 W/m²/sr: Cycles of Blender 5.0, 256 samples, 128 bounces.
        (0, 0.1, 0.8, 0.8163),
        (0, 0.1, 0.4, 0.4378),
        (0, 0.5, 0.8, 0.8111),
        (0, 0.5, 0.4, 0.4295),
        (0, 1.0, 0.8, 0.8049),
        (0, 1.0, 0.4, 0.4117),
        (1, 0.1, 0.8, 0.8088),
        (1, 0.1, 0.4, 0.4110),
        (1, 0.5, 0.8, 0.7843),
        (1, 0.5, 0.4, 0.3793),
        (1, 1.0, 0.8, 0.6207),
        (1, 1.0, 0.4, 0.2043),
    ],
)
def test_principled_bounces_what_cycles_measures_in_a_closed_room(
    metallic: float, roughness: float, base: float, measured: float
) -> None:
    """Diffuse and glossy together; what is left is documented in decision record 0022."""
    values = {"Base_Color": (base, base, base, 1), "Metallic": metallic, "Roughness": roughness}
    surface = read_material(shader_material("M", "ShaderNodeBsdfPrincipled", **values))
    np.testing.assert_allclose(surface.reflectance, measured, atol=0.017)


@pytest.mark.parametrize(
    ("filtered", "metallic", "roughness", "base", "measured"),
    [
        # The same in Cycles of Blender 5.0 with Filter Glossy, 1,024 samples.
        (1, 0, 0.1, 0.8, 0.7765),
        (1, 0, 0.5, 0.8, 0.7947),
        (1, 0, 0.1, 0.4, 0.4121),
        (1, 0, 0.5, 0.4, 0.4174),
        (1, 0, 1.0, 0.4, 0.4110),
        (1, 1, 0.1, 0.8, 0.5842),
        (1, 1, 0.5, 0.8, 0.6415),
        (1, 1, 0.9, 0.8, 0.6681),
        (1, 1, 0.1, 0.4, 0.2948),
        (4, 0, 0.1, 0.8, 0.7749),
        (4, 1, 0.1, 0.8, 0.5622),
        (4, 1, 0.5, 0.4, 0.2948),
    ],
)
def test_filter_glossy_takes_what_it_takes_in_cycles(
    filtered: float, metallic: float, roughness: float, base: float, measured: float
) -> None:
    values = {"Base_Color": (base, base, base, 1), "Metallic": metallic, "Roughness": roughness}
    material = shader_material("M", "ShaderNodeBsdfPrincipled", **values)
    surface = read_material(material, gloss=Gloss(filtered=filtered))
    np.testing.assert_allclose(surface.reflectance, measured, atol=0.017)


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
def test_without_reflective_caustics_gloss_is_left_out(roughness: float) -> None:
    """Cycles then bounces base colors, which nothing covers, and no metal: 0.7997, 0.3999 and 0.0000."""
    values = {"Base_Color": RED, "Roughness": roughness}
    lacquer = shader_material("Lacquer", "ShaderNodeBsdfPrincipled", **values)
    metal = shader_material("Metal", "ShaderNodeBsdfPrincipled", Metallic=1, **values)
    mirror = shader_material("Mirror", "ShaderNodeBsdfGlossy", Color=RED, Roughness=roughness)
    none = Gloss(reflective=False)
    np.testing.assert_allclose(read_material(lacquer, gloss=none).reflectance, RED[:3], rtol=1e-6)
    assert not read_material(metal, gloss=none).reflectance.any()
    assert not read_material(mirror, gloss=none).reflectance.any()


def test_gloss_is_filtered_as_a_new_scene_says() -> None:
    assert Gloss.of(bpy.context.scene) == Gloss(reflective=True, filtered=1.0)


def test_principled_emits_strength_times_color() -> None:
    surface = read_material(
        shader_material(
            "M",
            "ShaderNodeBsdfPrincipled",
            Base_Color=RED,
            Specular_IOR_Level=0,
            Emission_Color=BLUE,
            Emission_Strength=2.0,
        )
    )
    assert_surface(surface, RED[:3], 2 * math.pi * np.array(BLUE[:3]))


@pytest.mark.parametrize(
    ("socket", "value", "word"),
    [
        ("Subsurface_Weight", 0.3, "subsurface"),
        ("Coat_Weight", 0.3, "coat"),
        ("Sheen_Weight", 0.3, "sheen"),
    ],
)
def test_what_principled_does_beyond_diffuse_warns(socket: str, value: float, word: str) -> None:
    inputs = {"Base_Color": RED, "Specular_IOR_Level": 0, socket: value}
    surface = read_material(shader_material("Odd", "ShaderNodeBsdfPrincipled", **inputs))
    assert_surface(surface, RED[:3])
    assert says(messages_of(surface), "Odd", word)


def test_what_is_transmitted_is_not_reflected_and_warns() -> None:
    inputs = {"Base_Color": RED, "Specular_IOR_Level": 0, "Transmission_Weight": 0.75}
    surface = read_material(shader_material("Glass", "ShaderNodeBsdfPrincipled", **inputs))
    assert_surface(surface, 0.25 * np.array(RED[:3]))
    assert surface.opacity == 1
    assert says(messages_of(surface), "Glass", "transmission", "opaque")


def test_alpha_is_opacity_and_leaves_the_color() -> None:
    inputs = {"Base_Color": RED, "Specular_IOR_Level": 0, "Alpha": 0.25, "Emission_Strength": 2.0}
    surface = read_material(shader_material("Thin", "ShaderNodeBsdfPrincipled", **inputs))
    assert_surface(surface, RED[:3], np.full(3, 2 * math.pi))
    assert surface.opacity == pytest.approx(0.25)
    assert surface.warnings == ()
