"""Materials as radiosity sees them: one diffuse reflectance and one emission each.

Principled, Diffuse and Emission shaders, and mixes of them by constant factors, are
understood. Everything else gives a warning that names the material and the value used.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import bpy
import numpy as np

from ..bake_scene import BakeWarning
from ..solver.radiometry import radiosity_of_radiance
from ..solver.scene import MAX_REFLECTANCE
from .shader_nodes import NotConstantError, Stack, Value, default_rgb, evaluate, feed_of, output_node

DEFAULT_GREY = 0.8
"""Reflectance of a face without material, as in Cycles."""

_IGNORED_WEIGHTS = (  # Principled sockets that should be 0, and what we do instead
    ("Transmission Weight", "transmission is ignored: the surface is baked opaque"),
    ("Subsurface Weight", "subsurface scattering is ignored: the base colour is used"),
    ("Coat Weight", "the coat is ignored"),
    ("Sheen Weight", "the sheen is ignored"),
)
_TRANSPARENT = ("BSDF_TRANSPARENT", "HOLDOUT")
_COLOURED = (
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


@dataclass(frozen=True)
class Surface:
    """A material's constants.

    Parameters
    ----------
    reflectance : (3,) float64 in [0, 0.99]
    emission : (3,) float64
        Exitance of each side [W/m²].
    warnings : tuple of BakeWarning
    """

    reflectance: np.ndarray
    emission: np.ndarray
    warnings: tuple[BakeWarning, ...] = ()


@dataclass(frozen=True)
class _Shader:
    """What a shader socket comes to; `radiance` is emitted [W/m²/sr]."""

    reflectance: np.ndarray
    radiance: np.ndarray
    transparent: bool = False


_NOTHING = _Shader(np.zeros(3), np.zeros(3))


def read_material(material: bpy.types.Material | None) -> Surface:
    """Return what a material reflects and emits; None is Cycles' default grey."""
    if material is None:
        return Surface(np.full(3, DEFAULT_GREY), np.zeros(3))
    reader = _Reader(material.name, "material")
    if not uses_nodes(material):
        shader = _Shader(np.array(material.diffuse_color[:3], dtype=np.float64), np.zeros(3))
    else:
        shader = reader.material(material.node_tree)
    return Surface(
        reader.clamped_reflectance(shader.reflectance),
        radiosity_of_radiance(reader.not_negative("emission", shader.radiance)),
        tuple(reader.warnings),
    )


def read_radiance(
    owner: bpy.types.Light | bpy.types.World, kind: str
) -> tuple[np.ndarray, tuple[BakeWarning, ...]]:
    """Return the constant radiance that a lamp's or world's own node tree gives.

    Parameters
    ----------
    owner : bpy.types.Light or bpy.types.World
        One that has a node tree.
    kind : "lamp" or "world"

    Returns
    -------
    radiance : (3,) float64
    warnings : tuple of BakeWarning
    """
    reader = _Reader(owner.name, kind)
    output = output_node(owner.node_tree)
    if output is None:
        return np.zeros(3), ()
    shader = reader.shader(output.inputs["Surface"], ())
    if "Volume" in output.inputs and output.inputs["Volume"].is_linked:
        reader.warn("its volume is ignored")
    return reader.not_negative("strength", shader.radiance), tuple(reader.warnings)


def uses_nodes(owner: bpy.types.ID) -> bool:
    """Tell whether a material, lamp or world is rendered by its node tree."""
    if owner.node_tree is None:
        return False
    # Always true for materials and worlds from 5.0 on and for lamps a little later, gone in
    # 6.0; until then asking for it warns.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return bool(getattr(owner, "use_nodes", True))


class _Reader:
    """Reads one node tree and collects its warnings."""

    def __init__(self, name: str, kind: str) -> None:
        self.name = name
        self.kind = kind
        self.warnings: list[BakeWarning] = []

    def warn(self, message: str) -> None:
        warning = BakeWarning(self.name, f"{self.kind} '{self.name}': {message}")
        if warning not in self.warnings:
            self.warnings.append(warning)

    def material(self, tree: bpy.types.NodeTree) -> _Shader:
        output = output_node(tree)
        if output is None or feed_of(output.inputs["Surface"]).node is None:
            self.warn(f"it has no surface shader; reflectance {_text(np.zeros(3))} is used")
            return _NOTHING
        for socket in ("Volume", "Displacement"):
            if output.inputs[socket].is_linked:
                self.warn(f"its {socket.lower()} is ignored")
        return self.shader(output.inputs["Surface"], ())

    def shader(self, socket: bpy.types.NodeSocket, stack: Stack) -> _Shader:
        """Return what a shader socket comes to."""
        feed = feed_of(socket, stack)
        node = feed.node
        if node is None:
            return _NOTHING
        if node.type == "BSDF_PRINCIPLED":
            return self._principled(node, feed.stack)
        if node.type == "BSDF_DIFFUSE":
            self._normal_map(node)
            return _Shader(self.value(node.inputs["Color"], feed.stack), np.zeros(3))
        if node.type in ("EMISSION", "BACKGROUND"):
            strength = self.scalar(node.inputs["Strength"], feed.stack)
            return _Shader(np.zeros(3), strength * self.value(node.inputs["Color"], feed.stack))
        if node.type == "MIX_SHADER":
            return self._mix(node, feed.stack)
        if node.type == "ADD_SHADER":
            first, second = (self.shader(socket, feed.stack) for socket in node.inputs[:2])
            return _Shader(first.reflectance + second.reflectance, first.radiance + second.radiance)
        return self._not_understood(node, feed.stack)

    def value(self, socket: bpy.types.NodeSocket, stack: Stack) -> np.ndarray:
        """Return a socket's constant (3,), with a warning where it stands for something else."""
        try:
            value = evaluate(socket, stack)
        except NotConstantError as reason:
            default = default_rgb(socket)
            self.warn(f"{socket.name} comes from {reason}; {_text(default)} is used")
            return default
        if value.notes:
            self.warn(
                f"{socket.name} comes from {', '.join(value.notes)}; the mean {_text(value.rgb)} is used"
            )
        return value.rgb

    def scalar(self, socket: bpy.types.NodeSocket, stack: Stack) -> float:
        """Return a number socket's constant, warning as `value` does."""
        return Value(self.value(socket, stack)).scalar

    def clamped_reflectance(self, reflectance: np.ndarray) -> np.ndarray:
        """Keep a reflectance where the light in a closed room still dies away."""
        clamped = np.clip(np.nan_to_num(reflectance), 0.0, MAX_REFLECTANCE)
        # The margin is what single-precision colours round by.
        if (np.abs(clamped - reflectance) > 1e-6).any():
            self.warn(f"reflectance {_text(reflectance)} is clamped to {_text(clamped)}")
        return clamped

    def not_negative(self, what: str, values: np.ndarray) -> np.ndarray:
        """Replace negative, infinite and NaN values by 0."""
        mended = np.where(np.isfinite(values) & (values >= 0), values, 0.0)
        if (mended != values).any():
            self.warn(f"{what} {_text(values)} is not possible; {_text(mended)} is used")
        return mended

    def _principled(self, node: bpy.types.Node, stack: Stack) -> _Shader:
        self._normal_map(node)
        for name, message in _IGNORED_WEIGHTS:
            socket = node.inputs.get(name)
            if socket is not None and (socket.is_linked or socket.default_value > 0):
                self.warn(message)
        alpha = node.inputs["Alpha"]
        if alpha.is_linked or alpha.default_value < 1:
            self.warn("alpha is ignored: the surface is baked opaque")
        radiance = np.zeros(3)
        strength = node.inputs["Emission Strength"]
        if strength.is_linked or strength.default_value != 0:
            colour = node.inputs["Emission Color"]
            if colour.is_linked or default_rgb(colour).any():
                radiance = self.scalar(strength, stack) * self.value(colour, stack)
        return _Shader(self.value(node.inputs["Base Color"], stack), radiance)

    def _mix(self, node: bpy.types.Node, stack: Stack) -> _Shader:
        first, second = (self.shader(socket, stack) for socket in node.inputs[1:3])
        if first.transparent != second.transparent:
            self.warn("transparency is ignored: the surface is baked opaque with its other shader")
            return second if first.transparent else first
        share = min(max(self.scalar(node.inputs[0], stack), 0.0), 1.0)
        return _Shader(
            (1 - share) * first.reflectance + share * second.reflectance,
            (1 - share) * first.radiance + share * second.radiance,
            first.transparent,
        )

    def _not_understood(self, node: bpy.types.Node, stack: Stack) -> _Shader:
        label = node.bl_label
        if node.type in _TRANSPARENT:
            if not stack and self.kind == "material" and _feeds_output(node):
                self.warn(f"{label} is baked opaque; reflectance {_text(np.zeros(3))} is used")
            return _Shader(np.zeros(3), np.zeros(3), transparent=True)
        colour = node.inputs.get("Color") or node.inputs.get("Base Color")
        if node.type in _COLOURED and colour is not None:
            reflectance = self.value(colour, stack)
            self.warn(f"{label} is baked as diffuse; reflectance {_text(reflectance)} is used")
            return _Shader(reflectance, np.zeros(3))
        what = "reflectance" if self.kind == "material" else "radiance"
        self.warn(f"{label} is not understood; {what} {_text(np.zeros(3))} is used")
        return _NOTHING

    def _normal_map(self, node: bpy.types.Node) -> None:
        if node.inputs["Normal"].is_linked:
            self.warn("its normal map is ignored: the mesh's own normals are used")


def _feeds_output(node: bpy.types.Node) -> bool:
    """Tell whether a shader goes straight to a material output."""
    return any(link.to_node.type == "OUTPUT_MATERIAL" for socket in node.outputs for link in socket.links)


def _text(rgb: np.ndarray) -> str:
    return "({})".format(", ".join(f"{component:.3g}" for component in rgb))
