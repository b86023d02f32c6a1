"""What each shader node reflects, emits and lets through, said once for constants and for nodes.

`materials.py` reads constants by it; `surface_rewiring.py` builds nodes that Cycles evaluates.
`ShaderWalk` is what they share with display (`material_copies/surface_nodes.py`): which nodes there are.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, TypeVar

import bpy
import numpy as np

from . import glossy_albedo
from .gloss import ALL
from .node_algebra import NodeAlgebra, NodeColor, Scalar
from .shader_nodes import Feed, default_rgb

Place = TypeVar("Place")
"""Which node group a walk is in."""

Seen = TypeVar("Seen")
"""What a walk returns for a shader."""

DIFFUSE = (
    "BSDF_DIFFUSE",
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
"""Shaders that are diffuse, or are taken as diffuse ones of their color."""

MIRRORS = ("BSDF_GLOSSY", "BSDF_METALLIC", "BSDF_ANISOTROPIC")
"""Those of them that reflect like mirrors."""

GLASS = ("BSDF_GLASS", "BSDF_REFRACTION")
"""Shaders that light passes by their color."""

ROUGH = 0.05
"""Glass of this roughness, or more, is frosted."""

_IGNORED_WEIGHTS = (  # Principled sockets that should be 0, and what we do instead
    ("Transmission Weight", "transmission is ignored: the surface is baked opaque"),
    ("Subsurface Weight", "subsurface scattering is ignored: the base color is used"),
    ("Coat Weight", "the coat is ignored in bounces of light; it is still shown"),
    ("Sheen Weight", "the sheen is ignored in bounces of light; it is still shown"),
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

    reflected: NodeColor
    radiance: NodeColor
    passed: NodeColor


def nothing() -> Terms:
    """Return the terms of a black surface."""
    return Terms(np.zeros(3), np.zeros(3), np.zeros(3))


class ShaderWalk(ABC, Generic[Place, Seen]):
    """Distinguishes shader nodes, for baking and for display; subclasses define the result of each."""

    @abstractmethod
    def shader(self, socket: bpy.types.NodeSocket, place: Place) -> Seen:
        """Return the result for what feeds a shader socket."""

    @abstractmethod
    def _nothing(self) -> Seen:
        """Return what a black surface comes to."""

    @abstractmethod
    def _glow(self, socket: bpy.types.NodeSocket, place: Place, /) -> Seen:
        """Return what a color comes to where a shader is expected: emission of strength 1, as in Cycles."""

    @abstractmethod
    def _principled(self, node: bpy.types.Node, place: Place, /) -> Seen:
        """Return what a Principled BSDF comes to."""

    @abstractmethod
    def _diffuse(self, node: bpy.types.Node, color: bpy.types.NodeSocket, place: Place, /) -> Seen:
        """Return what a shader comes to that is diffuse, or is taken as diffuse, of a color."""

    @abstractmethod
    def _emission(self, node: bpy.types.Node, place: Place, /) -> Seen:
        """Return what a shader with Color and Strength emits."""

    @abstractmethod
    def _transparent(self, node: bpy.types.Node, place: Place, /) -> Seen:
        """Return what a Transparent BSDF comes to."""

    def _glass(self, node: bpy.types.Node, _: Place, /) -> Seen:
        """Return what a Glass or Refraction BSDF comes to."""
        return self.not_understood(node)

    @abstractmethod
    def _mixed(self, node: bpy.types.Node, place: Place, /) -> Seen:
        """Return what a Mix Shader comes to."""

    @abstractmethod
    def _added(self, node: bpy.types.Node, place: Place, /) -> Seen:
        """Return what an Add Shader comes to."""

    @abstractmethod
    def not_understood(self, node: bpy.types.Node, /) -> Seen:
        """Return what stands for a shader that is none of the known ones."""

    def fed_by(self, feed: Feed, socket: bpy.types.NodeSocket, place: Place, inside: Place) -> Seen:
        """Return what the feed of a shader socket comes to; `inside` is where the node that feeds it is."""
        if feed.socket.type != "SHADER":
            return self._glow(socket, place)
        return self._nothing() if feed.node is None else self.node(feed.node, inside)

    def node(self, node: bpy.types.Node, place: Place) -> Seen:
        """Return what a shader node comes to."""
        match node.type:
            case "BSDF_PRINCIPLED":
                return self._principled(node, place)
            case "EMISSION" | "BACKGROUND":
                return self._emission(node, place)
            case "BSDF_TRANSPARENT":
                return self._transparent(node, place)
            case "HOLDOUT":
                return self._nothing()
            case "MIX_SHADER":
                return self._mixed(node, place)
            case "ADD_SHADER":
                return self._added(node, place)
        if node.type in GLASS:
            return self._glass(node, place)
        color = node.inputs.get("Color") or node.inputs.get("Base Color")
        if node.type in DIFFUSE and color is not None:
            return self._diffuse(node, color, place)
        return self.not_understood(node)


class ShaderTerms(ShaderWalk[Place, Terms]):
    """Comes from shader nodes to their terms; what their sockets hold is for others to say.

    lets_through: Light goes straight through glass, and Fresnel's equations take nothing of it; else glass
        is opaque.
    gloss: What is left of gloss after a diffuse bounce.
    """

    lets_through = False
    gloss = ALL

    @abstractmethod
    def color(self, socket: bpy.types.NodeSocket, place: Place) -> NodeColor:
        """Return what a color socket holds."""

    @abstractmethod
    def scalar(self, socket: bpy.types.NodeSocket, place: Place) -> Scalar:
        """Return what a number socket holds."""

    @abstractmethod
    def algebra(self, place: Place, /) -> NodeAlgebra:
        """Return where a place's values are combined."""

    @abstractmethod
    def warn(self, message: str) -> None:
        """Report something that is not baked as it is."""

    def _nothing(self) -> Terms:
        return nothing()

    def _glow(self, socket: bpy.types.NodeSocket, place: Place) -> Terms:
        return Terms(np.zeros(3), self.color(socket, place), np.zeros(3))

    def _diffuse(self, node: bpy.types.Node, color: bpy.types.NodeSocket, place: Place) -> Terms:
        if node.type == "BSDF_DIFFUSE":
            self._normal_map(node)
        reflected = self.color(color, place)
        if node.type in MIRRORS:
            reflected = self._mirrored(reflected, self.scalar(node.inputs["Roughness"], place), place)
        if node.type != "BSDF_DIFFUSE":
            self.warn(f"{node.bl_label} is baked as diffuse; its color is used")
        return Terms(reflected, np.zeros(3), np.zeros(3))

    def _emission(self, node: bpy.types.Node, place: Place) -> Terms:
        strength = self.scalar(node.inputs["Strength"], place)
        radiance = self.algebra(place).scale(self.color(node.inputs["Color"], place), strength)
        return Terms(np.zeros(3), radiance, np.zeros(3))

    def _transparent(self, node: bpy.types.Node, place: Place) -> Terms:
        return Terms(np.zeros(3), np.zeros(3), self.color(node.inputs["Color"], place))

    def _glass(self, node: bpy.types.Node, place: Place) -> Terms:
        if not self.lets_through:
            return self.not_understood(node)
        self.meets_glass(node.inputs["Roughness"], place)
        return Terms(np.zeros(3), np.zeros(3), self.color(node.inputs["Color"], place))

    def meets_glass(self, roughness: bpy.types.NodeSocket, place: Place, /) -> None:
        """Note that there is glass, of a roughness."""

    def _principled(self, node: bpy.types.Node, place: Place) -> Terms:
        self._normal_map(node)
        for name, message in _IGNORED_WEIGHTS:
            socket = node.inputs.get(name)
            ignored = not (self.lets_through and name == "Transmission Weight")
            if ignored and socket is not None and (socket.is_linked or socket.default_value > 0):
                self.warn(message)
        algebra = self.algebra(place)
        alpha = algebra.saturate(self.scalar(node.inputs["Alpha"], place))
        return Terms(
            algebra.scale(self._principled_albedo(node, place), alpha),
            algebra.scale(self._principled_radiance(node, place), alpha),
            self._principled_passed(node, place, alpha),
        )

    def _principled_passed(self, node: bpy.types.Node, place: Place, alpha: Scalar) -> NodeColor:
        """Return (1 − α) + α transmission (1 − metallic) √base.

        The root is Cycles': a solid, which is crossed twice, has the base color.
        """
        algebra, inputs = self.algebra(place), node.inputs
        past = algebra.scale(np.ones(3), algebra.complement(alpha))
        transmission = algebra.saturate(self.scalar(inputs["Transmission Weight"], place))
        metallic = algebra.saturate(self.scalar(inputs["Metallic"], place))
        if not self.lets_through or transmission == 0.0 or metallic == 1.0:
            return past
        self.meets_glass(inputs["Roughness"], place)
        share = algebra.calculate("MULTIPLY", transmission, algebra.complement(metallic))
        color = algebra.square_root(self.color(inputs["Base Color"], place))
        return algebra.add(past, algebra.scale(algebra.scale(color, share), alpha))

    def _principled_radiance(self, node: bpy.types.Node, place: Place) -> NodeColor:
        strength, color = node.inputs["Emission Strength"], node.inputs["Emission Color"]
        if not strength.is_linked and strength.default_value == 0:
            return np.zeros(3)
        if not color.is_linked and not default_rgb(color).any():
            return np.zeros(3)
        return self.algebra(place).scale(self.color(color, place), self.scalar(strength, place))

    def _mirrored(self, color: NodeColor, roughness: Scalar, place: Place) -> NodeColor:
        """Return what is left of what a mirror reflects after a diffuse bounce."""
        if not self.gloss.reflective:
            return np.zeros(3)
        if self.gloss.least_roughness == 0.0:
            return color
        algebra, rougher = self.algebra(place), self._rougher(roughness, place)
        return algebra.scale(color, glossy_albedo.kept_if_rougher(algebra, roughness, rougher))

    def _rougher(self, roughness: Scalar, place: Place) -> Scalar:
        """Return the roughness of gloss after a diffuse bounce."""
        least = self.gloss.least_roughness
        return self.algebra(place).calculate("MAXIMUM", roughness, least) if least else roughness

    def _principled_albedo(self, node: bpy.types.Node, place: Place) -> NodeColor:
        """Return metallic · metal + (1 − metallic) · (shine + (1 − shine) (1 − transmission) base).

        Where light goes through glass, what is transmitted has no shine either. Of metal and of the first
        shine counts what is left after a diffuse bounce.
        """
        algebra, inputs = self.algebra(place), node.inputs
        base = self.color(inputs["Base Color"], place)
        metallic = algebra.saturate(self.scalar(inputs["Metallic"], place))
        transmission = algebra.saturate(self.scalar(inputs["Transmission Weight"], place))
        roughness = self.scalar(inputs["Roughness"], place)
        ior, level = (self.scalar(inputs[name], place) for name in ("IOR", "Specular IOR Level"))
        under = base if self.lets_through else algebra.scale(base, algebra.complement(transmission))
        matte, rougher = under, self._rougher(roughness, place)
        if self.gloss.reflective:
            tint = self.color(inputs["Specular Tint"], place)
            over, shine = (
                algebra.scale(tint, glossy_albedo.dielectric(algebra, ior, level, rough))
                for rough in (roughness, rougher)
            )
            below = algebra.multiply(algebra.add(np.ones(3), algebra.scale(over, -1.0)), under)
            matte = algebra.add(shine, below)
        if self.lets_through:
            matte = algebra.scale(matte, algebra.complement(transmission))
        if metallic == 0.0:
            return matte
        multiple = node.distribution == "MULTI_GGX"
        metal = glossy_albedo.metal(algebra, base, roughness, multiple, rougher)
        return algebra.blend(metallic, matte, metal if self.gloss.reflective else np.zeros(3))

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

    def _normal_map(self, node: bpy.types.Node) -> None:
        if node.inputs["Normal"].is_linked:
            self.warn("its normal map is ignored: the mesh's own normals are used")
