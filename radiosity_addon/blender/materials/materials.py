"""Materials as radiosity sees them: reflectance, emission and opacity, read as constants.

Where something varies over the surface the material says so (`Surface.varies`), and
`surface_evaluation.py` has Cycles evaluate it; what is read here is then the fallback.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...base import BakeWarning
from ...numerics import MAX_REFLECTANCE, most_reflectance, radiosity_of_radiance
from .gloss import ALL, Gloss
from .node_algebra import NodeAlgebra
from .shader_nodes import (
    MissingImageError,
    NotConstantError,
    Stack,
    Value,
    default_rgb,
    evaluate,
    feed_of,
    output_node,
    shadow_ray,
)
from .shader_terms import ROUGH, ShaderTerms, Terms, nothing
from .shading_inputs import LIGHT_PATHS, asks_light_path
from .surface_terms import LEAST_COLOR, passing_color, surface_of_terms

PASSING_RAYS = ("Is Shadow Ray", "Is Diffuse Ray")
"""Rays for which shaders of glass are mixed with transparency."""

DEFAULT_GRAY = 0.8
"""Reflectance of a face without material, as in Cycles."""


@dataclass(frozen=True)
class Surface:
    """A material's constants.

    Parameters
    ----------
    reflectance : (3,) float64 in [0, 0.99]
        Where the surface is there.
    emission : (3,) float64
        Exitance of each side [W/m²], where the surface is there.
    opacity : float in [0, 1]
        The share of light that does not go straight through.
    warnings : tuple of BakeWarning
    varies : bool
        Something it is made of varies over the surface, and means or defaults stand for it.
    fallbacks : tuple of BakeWarning
        Which; reported unless the material is evaluated.
    is_volume : bool
        It has a volume and no surface: fog, through which all light goes.
    passed : (3,) float64 or None
        The share of each channel that goes straight through, of mean 1 − opacity; None where all have the
        same.
    glass : bool
        Light goes through it by color; where it reflects and emits nothing, it is glass and nothing else.
    """

    reflectance: np.ndarray
    emission: np.ndarray
    opacity: float = 1.0
    warnings: tuple[BakeWarning, ...] = ()
    varies: bool = False
    fallbacks: tuple[BakeWarning, ...] = ()
    is_volume: bool = False
    passed: np.ndarray | None = None
    glass: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether its reflectance and emission say it all."""
        return not self.varies and self.opacity == 1.0

    @property
    def is_clear(self) -> bool:
        """Whether it is glass and nothing else, as far as constants tell."""
        return self.glass and not self.reflectance.any() and not self.emission.any()


def read_material(
    material: bpy.types.Material | None, lets_through: bool = False, gloss: Gloss = ALL
) -> Surface:
    """Return what a material reflects, emits and covers; None is Cycles' default gray.

    lets_through: Light goes through glass; else it is opaque, and what goes through the rest is gray.
    gloss: What is left of gloss after a diffuse bounce.
    """
    if material is None:
        return Surface(np.full(3, DEFAULT_GRAY), np.zeros(3))
    reader = _Reader(material.name, "material", lets_through, gloss)
    if not uses_nodes(material):
        terms = Terms(np.array(material.diffuse_color[:3], dtype=np.float64), np.zeros(3), np.zeros(3))
    else:
        terms = reader.material(material.node_tree)
    reflectance, radiance, opacity = surface_of_terms(
        terms.reflected[None], terms.radiance[None], terms.passed[None]
    )
    passed = passing_color(terms.passed, opacity[0]) if reader.is_glass else None
    return Surface(
        reader.clamped_reflectance(reflectance[0], opacity[0], passed),
        radiosity_of_radiance(reader.not_negative("emission", radiance[0])),
        float(opacity[0]),
        tuple(reader.warnings),
        reader.varies,
        tuple(reader.fallbacks),
        reader.is_volume,
        passed,
        reader.is_glass,
    )


def ray_doubts(material: bpy.types.Material, surface: Surface) -> list[str]:
    """Say what Cycles has otherwise because it is a matter of what a ray is for."""
    said = []
    passes = surface.opacity < 1.0 or (surface.varies and _may_pass(material.node_tree))
    if passes and not getattr(material, "use_transparent_shadow", True):
        said.append(
            "Transparent Shadows is off, which is ignored: lamps shine through where it is transparent"
        )
    if surface.emission.any() and asks_light_path(material.node_tree, tuple(LIGHT_PATHS)):
        said.append(
            "its emission depends on Is Diffuse Ray, which is always on here, in Cycles only for some rays"
        )
    return said


def _may_pass(tree: bpy.types.NodeTree) -> bool:
    """Return whether a tree has what could let light through."""
    for node in tree.nodes:
        alpha = node.inputs.get("Alpha") if node.type == "BSDF_PRINCIPLED" else None
        if node.type == "BSDF_TRANSPARENT" or (alpha is not None and alpha.is_linked):
            return True
        if node.type == "GROUP" and node.node_tree is not None and _may_pass(node.node_tree):
            return True
    return False


def is_volume(output: bpy.types.Node | None) -> bool:
    """Return whether a material's output has a volume and no surface."""
    if output is None or feed_of(output.inputs["Surface"]).node is not None:
        return False
    return feed_of(output.inputs["Volume"]).node is not None


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
    terms = reader.shader(output.inputs["Surface"], ())
    if "Volume" in output.inputs and output.inputs["Volume"].is_linked:
        reader.warn("its volume is ignored")
    radiance = reader.not_negative("strength", terms.radiance)
    return radiance, (*reader.fallbacks, *reader.warnings)


def uses_nodes(owner: bpy.types.ID) -> bool:
    """Return whether a material, lamp or world is rendered by its node tree."""
    if owner.node_tree is None:
        return False
    # Always true for materials and worlds from 5.0 on and for lamps a little later, gone in
    # 6.0; until then asking for it warns.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return bool(getattr(owner, "use_nodes", True))


class _Reader(ShaderTerms[Stack]):
    """Reads one node tree as constants and collects its warnings."""

    def __init__(self, name: str, kind: str, lets_through: bool = False, gloss: Gloss = ALL) -> None:
        self.name = name
        self.kind = kind
        self.lets_through, self.gloss = lets_through, gloss
        self.is_glass = False
        self.warnings: list[BakeWarning] = []
        self.fallbacks: list[BakeWarning] = []
        self.varies = False
        self.is_volume = False

    def warn(self, message: str) -> None:
        self._add(self.warnings, message)

    def algebra(self, _: Stack) -> NodeAlgebra:
        return NodeAlgebra(None)

    def material(self, tree: bpy.types.NodeTree) -> Terms:
        output = output_node(tree)
        self.is_volume = is_volume(output)
        if self.is_volume:
            self.warn("its volume is ignored: light goes straight through")
            return Terms(np.zeros(3), np.zeros(3), np.ones(3))
        if output is None or feed_of(output.inputs["Surface"]).node is None:
            self.warn(f"it has no surface shader; reflectance {_text(np.zeros(3))} is used")
            return nothing()
        for socket in ("Volume", "Displacement"):
            if output.inputs[socket].is_linked:
                self.warn(f"its {socket.lower()} is ignored")
        if not asks_light_path(tree, PASSING_RAYS):
            return self.shader(output.inputs["Surface"], ())
        # Shadow rays are lamps' light, for which what passes counts alone.
        with shadow_ray(1.0):
            passed = self.shader(output.inputs["Surface"], ()).passed
        with shadow_ray(0.0):
            terms = replace(self.shader(output.inputs["Surface"], ()), passed=passed)
        # A pane by the usual trick, whatever it is for other rays.
        clear = not terms.reflected.any() and not terms.radiance.any() and passed.any()
        self.is_glass |= self.lets_through and bool(clear)
        return terms

    def meets_glass(self, roughness: bpy.types.NodeSocket, place: Stack) -> None:
        self.is_glass = True
        frosted = self._known(roughness, place)
        if frosted is None or Value(frosted).scalar >= ROUGH:
            self.warn("its glass is rough, but light goes straight through it")

    def _transparent(self, node: bpy.types.Node, place: Stack) -> Terms:
        terms = super()._transparent(node, place)
        if self.lets_through:
            # A pane of color, such as shaders for shadow rays mix with glass.
            color = self._known(node.inputs["Color"], place)
            self.is_glass |= color is None or bool(np.ptp(color) > LEAST_COLOR)
        return terms

    def _known(self, socket: bpy.types.NodeSocket, place: Stack) -> np.ndarray | None:
        """Return a socket's constant (3,); None where it varies."""
        try:
            value = evaluate(socket, place)
        except NotConstantError:
            return None
        return None if value.notes else value.rgb

    def shader(self, socket: bpy.types.NodeSocket, place: Stack) -> Terms:
        feed = feed_of(socket, place)
        return self.fed_by(feed, socket, place, feed.stack)

    def color(self, socket: bpy.types.NodeSocket, place: Stack) -> np.ndarray:
        """Return a socket's constant (3,), with a note where it stands for something else."""
        try:
            value = evaluate(socket, place)
        except MissingImageError as reason:
            default = default_rgb(socket)
            self.warn(f"{socket.name} comes from {reason}; {_text(default)} is used")
            return default
        except NotConstantError as reason:
            default = default_rgb(socket)
            self._varying(f"{socket.name} comes from {reason}; {_text(default)} is used")
            return default
        if value.notes:
            self._varying(
                f"{socket.name} comes from {', '.join(value.notes)}; the mean {_text(value.rgb)} is used"
            )
        return value.rgb

    def scalar(self, socket: bpy.types.NodeSocket, place: Stack) -> float:
        """Return a number socket's constant, noting as `color` does."""
        return Value(self.color(socket, place)).scalar

    def not_understood(self, node: bpy.types.Node) -> Terms:
        what = "reflectance" if self.kind == "material" else "radiance"
        self.warn(f"{node.bl_label} is not supported; {what} {_text(np.zeros(3))} is used")
        return nothing()

    def clamped_reflectance(
        self, reflectance: np.ndarray, opacity: np.ndarray, passed: np.ndarray | None
    ) -> np.ndarray:
        """Keep a reflectance where the light in a closed room still dies away.

        passed (3,): What goes through a surface of this opacity by color; None if that is gray.
        """
        most = MAX_REFLECTANCE if passed is None else most_reflectance(opacity, passed)
        clamped = np.clip(np.nan_to_num(reflectance), 0.0, most)
        # The margin is what single-precision colors round by.
        if (np.abs(clamped - reflectance) > 1e-6).any():
            why = "" if passed is None else f", for it also passes {_text(passed)}"
            self.warn(f"reflectance {_text(reflectance)} is clamped to {_text(clamped)}{why}")
        return clamped

    def not_negative(self, what: str, values: np.ndarray) -> np.ndarray:
        """Replace negative, infinite and NaN values by 0."""
        possible = np.where(np.isfinite(values) & (values >= 0), values, 0.0)
        if (possible != values).any():
            self.warn(f"{what} {_text(values)} is not possible; {_text(possible)} is used")
        return possible

    def _varying(self, message: str) -> None:
        self.varies = True
        self._add(self.fallbacks, message)

    def _add(self, to: list[BakeWarning], message: str) -> None:
        warning = BakeWarning(self.name, f"{self.kind} '{self.name}': {message}")
        if warning not in to:
            to.append(warning)


def _text(rgb: np.ndarray) -> str:
    return "({})".format(", ".join(f"{component:.3g}" for component in rgb))
