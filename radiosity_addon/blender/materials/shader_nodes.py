"""Walk shader node trees: from a socket to the node or the constant that feeds it.

Reroutes, muted nodes and links, and node groups at any depth are seen through; of links in
a circle, those are dropped that Blender marks. Values
are constants only: what varies over the surface is replaced by its mean (images, checkers) or
refused (`NotConstantError`), and the caller falls back on the socket's own default.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..datablocks.image_values import image_mean
from .shading_inputs import LIGHT_PATHS

Stack = tuple[bpy.types.Node, ...]
"""The group nodes a walk has entered, outermost first."""

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_MAX_STEPS = 1000  # a tree with an invalid cycle must not hang us


_shadow_ray: list[float] = []
"""What Is Shadow Ray is while it is known."""


@contextmanager
def shadow_ray(value: float) -> Iterator[None]:
    """Have Is Shadow Ray be a constant, 0 or 1, as long as this lasts."""
    _shadow_ray.append(value)
    try:
        yield
    finally:
        _shadow_ray.pop()


class NotConstantError(Exception):
    """What feeds a socket varies over the surface; the message names it."""


class MissingImageError(NotConstantError):
    """An image that feeds a socket has no pixels."""


@dataclass(frozen=True)
class Feed:
    """What feeds a socket: a node's output, or (node None) the default of `socket`."""

    node: bpy.types.Node | None
    socket: bpy.types.NodeSocket
    stack: Stack


@dataclass(frozen=True)
class Value:
    """A constant a socket comes to.

    rgb (3,).
    notes: The textures whose means went into it, as the user knows them.
    """

    rgb: np.ndarray
    notes: tuple[str, ...] = field(default=())

    @property
    def scalar(self) -> float:
        """The value as Cycles turns a color into a float: its luminance."""
        return float(self.rgb @ _LUMINANCE)


def feed_of(socket: bpy.types.NodeSocket, stack: Stack = (), enter_groups: bool = True) -> Feed:
    """Follow an input socket to the node that computes it, or to the constant it ends at.

    Without `enter_groups` a group node, or the node of a group's inputs, is where it ends. Where muted
    nodes and reroutes lead to nothing, the value is that of the socket that reads them, as in Cycles.
    """
    reader = socket
    for _ in range(_MAX_STEPS):
        links = [link for link in socket.links if is_followed(link)]
        if not links:
            break
        node, output = links[0].from_node, links[0].from_socket
        if node.type == "SHADERTORGB":  # Cycles does not know it, and drops its links
            break
        if node.mute or node.type == "REROUTE":
            inner = passed_through(node, output)
            if inner is None:
                break
            socket = inner
        elif enter_groups and node.type == "GROUP" and node.node_tree is not None:
            inside = group_output(node.node_tree, output.identifier)
            if inside is None:
                break
            socket, stack = inside, (*stack, node)
            reader = socket
        elif enter_groups and node.type == "GROUP_INPUT" and stack:
            outside = by_identifier(stack[-1].inputs, output.identifier)
            if outside is None:
                break
            socket, stack = outside, stack[:-1]
            reader = socket
        else:
            return Feed(node, output, stack)
    return Feed(None, reader, stack)


def is_followed(link: bpy.types.NodeLink) -> bool:
    """Whether a walk follows a link: no muted one, and none that closes a cycle."""
    # Blender marks these as invalid, but not those of a node to itself.
    return link.is_valid and not link.is_muted and link.from_node != link.to_node


def passed_through(node: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the input that a muted node, or a reroute, passes on at an output; None where it is nothing.

    Blender decides which: of a muted Mix Shader the first shader, or the second where that alone is linked;
    of shaders that only emit or scatter none, so that they are black.
    """
    if node.type == "REROUTE":
        return node.inputs[0]
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def evaluate(socket: bpy.types.NodeSocket, stack: Stack = ()) -> Value:
    """Compute the constant an input socket comes to.

    Raises NotConstantError if a node on the way is not understood.
    """
    feed = feed_of(socket, stack)
    if feed.node is None:
        return Value(default_rgb(feed.socket))
    compute = _COMPUTE.get(feed.node.type)
    if compute is None:
        raise NotConstantError(f"node '{feed.node.bl_label}'")
    return compute(feed.node, feed.socket, feed.stack)


def default_rgb(socket: bpy.types.NodeSocket) -> np.ndarray:
    """Return a socket's own value as (3,) float64; zero for one without a value."""
    value = getattr(socket, "default_value", 0.0)
    if isinstance(value, (int, float)):
        return np.full(3, float(value))
    return np.array([float(component) for component in value[:3]])


def output_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """Return the output that Cycles would render: its own, or the one for all engines."""
    return tree.get_output_node("CYCLES") or tree.get_output_node("ALL")


def group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    """Return the socket inside a group that feeds its output of that identifier."""
    outputs = [node for node in tree.nodes if node.type == "GROUP_OUTPUT"]
    active = [node for node in outputs if node.is_active_output] or outputs
    return by_identifier(active[0].inputs, identifier) if active else None


def by_identifier(sockets: bpy.types.bpy_prop_collection, identifier: str) -> bpy.types.NodeSocket | None:
    """Find a socket where several share a name; None where there is none."""
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def _constant(_: bpy.types.Node, output: bpy.types.NodeSocket, _stack: Stack) -> Value:
    return Value(default_rgb(output))


def _image(node: bpy.types.Node, output: bpy.types.NodeSocket, _stack: Stack) -> Value:
    image = node.image
    if image is None:
        raise MissingImageError("an image texture without an image")
    mean = image_mean(image, equirectangular=node.type == "TEX_ENVIRONMENT")
    if mean is None:
        raise MissingImageError(
            f"image '{image.name}', which has no pixels and is shown in magenta (is its file missing?)"
        )
    rgb = np.full(3, mean[3]) if output.name == "Alpha" else mean[:3]
    return Value(rgb, (f"image '{image.name}'",))


def _checker(node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    # Half of its cells each; the one texture whose mean takes no sampling.
    note = (f"node '{node.bl_label}'",)
    if output.name != "Color":
        return Value(np.full(3, 0.5), note)
    one, other = (evaluate(node.inputs[name], stack) for name in ("Color1", "Color2"))
    return Value(0.5 * (one.rgb + other.rgb), _merge(note, one.notes, other.notes))


def _light_path(_: bpy.types.Node, output: bpy.types.NodeSocket, _stack: Stack) -> Value:
    if output.name == "Is Shadow Ray" and _shadow_ray:
        return Value(np.full(3, _shadow_ray[-1]))
    if not output.name.startswith("Is ") or output.name == "Is Shadow Ray":
        raise NotConstantError(f"Light Path '{output.name}'")
    return Value(np.full(3, LIGHT_PATHS.get(output.name, 0.0)))


def _mix(node: bpy.types.Node, _: bpy.types.NodeSocket, stack: Stack) -> Value:
    if node.type == "MIX":
        kind = {"RGBA": "Color", "FLOAT": "Float", "VECTOR": "Vector"}.get(node.data_type)
        if kind is None or (kind == "Vector" and node.factor_mode != "UNIFORM"):
            raise NotConstantError(f"node '{node.bl_label}'")
        names = ("Factor_Float", f"A_{kind}", f"B_{kind}")
        sockets = [by_identifier(node.inputs, name) for name in names]
        blend = node.blend_type if kind == "Color" else "MIX"
        clamp = kind == "Color" and node.clamp_result
    else:
        sockets, blend, clamp = list(node.inputs[:3]), node.blend_type, node.use_clamp
    factor, a, b = (evaluate(socket, stack) for socket in sockets)
    if blend not in _BLEND:
        raise NotConstantError(f"node '{node.bl_label}' ({blend.lower()})")
    share = min(max(factor.scalar, 0.0), 1.0)
    rgb = (1 - share) * a.rgb + share * _BLEND[blend](a.rgb, b.rgb)
    return Value(np.clip(rgb, 0, 1) if clamp else rgb, _merge(factor.notes, a.notes, b.notes))


def _math(node: bpy.types.Node, _: bpy.types.NodeSocket, stack: Stack) -> Value:
    operation = _MATH.get(node.operation)
    if operation is None:
        raise NotConstantError(f"node '{node.bl_label}' ({node.operation.lower()})")
    a, b = (evaluate(socket, stack) for socket in node.inputs[:2])
    result = operation(a.scalar, b.scalar)
    if node.use_clamp:
        result = min(max(result, 0.0), 1.0)
    return Value(np.full(3, result), _merge(a.notes, b.notes))


def _merge(*notes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(note for group in notes for note in group))


_BLEND = {
    "MIX": lambda _, b: b,
    "MULTIPLY": lambda a, b: a * b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
}
_MATH = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "MAXIMUM": lambda a, b: max(a, b),
    "MINIMUM": lambda a, b: min(a, b),
}
_COMPUTE = {
    "RGB": _constant,
    "VALUE": _constant,
    "TEX_IMAGE": _image,
    "TEX_ENVIRONMENT": _image,
    "TEX_CHECKER": _checker,
    "LIGHT_PATH": _light_path,
    "MIX": _mix,
    "MIX_RGB": _mix,
    "MATH": _math,
}
