"""What each shader node reflects, emits and lets through, said once for constants and for nodes.

`materials.py` reads constants by it; `surface_rewiring.py` builds nodes that Cycles evaluates.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, TypeVar

import bpy
import numpy as np

from . import glossy_albedo
from .node_algebra import Color, NodeAlgebra, Scalar
from .shader_nodes import default_rgb

Place = TypeVar("Place")
"""Which node group a walk is in."""

COLORED = (
    "BSDF_GLOSSY",
    "BSDF_METALLIC",
    "BSDF_ANISOTROPIC",
    "BSDF_TOON",
    "BSDF_SHEEN",
    "BSDF_VELVET",
    "BSDF_TRANSLUCENT",
    "SUBSURFACE_SCATTERING",
    "BSDF_HAIR",
    "BSDF_HAIR_PRINCIPLED",
    "BSDF_RAY_PORTAL",
    "EEVEE_SPECULAR",
)
"""Shaders that are taken as diffuse ones of their color."""

_IGNORED_WEIGHTS = (  # Principled sockets that should be 0, and what we do instead
    ("Transmission Weight", "transmission is ignored: the surface is baked opaque"),
    ("Subsurface Weight", "subsurface scattering is ignored: the base color is used"),
    ("Coat Weight", "the coat is ignored"),
    ("Sheen Weight", "the sheen is ignored"),
)


@dataclass(frozen=True)
class Terms:
    """What a shader comes to, of all that falls on it.

    Parameters
    ----------
    reflected : color
        The share of light that it sends back, however it is spread.
    radiance : color
        What it sends out of its own [W/m²/sr].
    passed : color
        The share of light that goes straight through.
    """

    reflected: Color
    radiance: Color
    passed: Color


def nothing() -> Terms:
    """Return the terms of a black surface."""
    return Terms(np.zeros(3), np.zeros(3), np.zeros(3))


class ShaderTerms(ABC, Generic[Place]):
    """Comes from shader nodes to their terms; what their sockets hold is for others to say."""

    @abstractmethod
    def shader(self, socket: bpy.types.NodeSocket, place: Place) -> Terms:
        """Return what feeds a shader socket comes to."""

    @abstractmethod
    def color(self, socket: bpy.types.NodeSocket, place: Place) -> Color:
        """Return what a color socket holds."""

    @abstractmethod
    def scalar(self, socket: bpy.types.NodeSocket, place: Place) -> Scalar:
        """Return what a number socket holds."""

    @abstractmethod
    def algebra(self, place: Place, /) -> NodeAlgebra:
        """Return where a place's values are combined."""

    @abstractmethod
    def warn(self, message: str) -> None:
        """Tell that something is not taken as it is."""

    @abstractmethod
    def not_understood(self, node: bpy.types.Node, /) -> Terms:
        """Return what stands for a shader that is none of the known ones."""

    def glow(self, color: Color) -> Terms:
        """Return what a color comes to where a shader is asked for: emission of strength 1, as in Cycles."""
        return Terms(np.zeros(3), color, np.zeros(3))

    def terms(self, node: bpy.types.Node, place: Place) -> Terms:
        """Return what a shader node comes to."""
        if node.type == "BSDF_PRINCIPLED":
            return self._principled(node, place)
        if node.type == "BSDF_DIFFUSE":
            self._normal_map(node)
            return Terms(self.color(node.inputs["Color"], place), np.zeros(3), np.zeros(3))
        if node.type in ("EMISSION", "BACKGROUND"):
            strength = self.scalar(node.inputs["Strength"], place)
            radiance = self.algebra(place).scale(self.color(node.inputs["Color"], place), strength)
            return Terms(np.zeros(3), radiance, np.zeros(3))
        if node.type == "BSDF_TRANSPARENT":
            return Terms(np.zeros(3), np.zeros(3), self.color(node.inputs["Color"], place))
        if node.type == "HOLDOUT":
            return nothing()
        if node.type == "MIX_SHADER":
            return self._mixed(node, place)
        if node.type == "ADD_SHADER":
            return self._added(node, place)
        color = node.inputs.get("Color") or node.inputs.get("Base Color")
        if node.type in COLORED and color is not None:
            return self._as_diffuse(node, self.color(color, place))
        return self.not_understood(node)

    def _principled(self, node: bpy.types.Node, place: Place) -> Terms:
        self._normal_map(node)
        for name, message in _IGNORED_WEIGHTS:
            socket = node.inputs.get(name)
            if socket is not None and (socket.is_linked or socket.default_value > 0):
                self.warn(message)
        algebra = self.algebra(place)
        alpha = algebra.saturate(self.scalar(node.inputs["Alpha"], place))
        return Terms(
            algebra.scale(self._principled_albedo(node, place), alpha),
            algebra.scale(self._principled_radiance(node, place), alpha),
            algebra.scale(np.ones(3), algebra.complement(alpha)),
        )

    def _principled_radiance(self, node: bpy.types.Node, place: Place) -> Color:
        strength, color = node.inputs["Emission Strength"], node.inputs["Emission Color"]
        if not strength.is_linked and strength.default_value == 0:
            return np.zeros(3)
        if not color.is_linked and not default_rgb(color).any():
            return np.zeros(3)
        return self.algebra(place).scale(self.color(color, place), self.scalar(strength, place))

    def _principled_albedo(self, node: bpy.types.Node, place: Place) -> Color:
        """Return metallic · metal + (1 − metallic) · (shine + (1 − shine) (1 − transmission) base)."""
        algebra, inputs = self.algebra(place), node.inputs
        base = self.color(inputs["Base Color"], place)
        metallic = algebra.saturate(self.scalar(inputs["Metallic"], place))
        transmission = algebra.saturate(self.scalar(inputs["Transmission Weight"], place))
        roughness = self.scalar(inputs["Roughness"], place)
        ior, level = (self.scalar(inputs[name], place) for name in ("IOR", "Specular IOR Level"))
        shine = algebra.scale(
            self.color(inputs["Specular Tint"], place),
            glossy_albedo.dielectric(algebra, ior, level, roughness),
        )
        under = algebra.scale(base, algebra.complement(transmission))
        kept = algebra.add(np.ones(3), algebra.scale(shine, -1.0))
        matte = algebra.add(shine, algebra.multiply(kept, under))
        if metallic == 0.0:
            return matte
        multiple = node.distribution == "MULTI_GGX"
        return algebra.blend(metallic, matte, glossy_albedo.metal(algebra, base, roughness, multiple))

    def _mixed(self, node: bpy.types.Node, place: Place) -> Terms:
        first, second = (self.shader(socket, place) for socket in node.inputs[1:3])
        algebra = self.algebra(place)
        share = algebra.saturate(self.scalar(node.inputs[0], place))
        return Terms(
            algebra.blend(share, first.reflected, second.reflected),
            algebra.blend(share, first.radiance, second.radiance),
            algebra.blend(share, first.passed, second.passed),
        )

    def _added(self, node: bpy.types.Node, place: Place) -> Terms:
        first, second = (self.shader(socket, place) for socket in node.inputs[:2])
        algebra = self.algebra(place)
        return Terms(
            algebra.add(first.reflected, second.reflected),
            algebra.add(first.radiance, second.radiance),
            algebra.add(first.passed, second.passed),
        )

    def _as_diffuse(self, node: bpy.types.Node, color: Color) -> Terms:
        self.warn(f"{node.bl_label} is baked as diffuse; its color is used")
        return Terms(color, np.zeros(3), np.zeros(3))

    def _normal_map(self, node: bpy.types.Node) -> None:
        if node.inputs["Normal"].is_linked:
            self.warn("its normal map is ignored: the mesh's own normals are used")
