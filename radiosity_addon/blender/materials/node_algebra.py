"""Arithmetic on what feeds shader sockets: constants are computed, the rest becomes nodes.

A *scalar* is a float or an output socket, a *color* is (3,) float64 or an output socket.
"""

from __future__ import annotations

from typing import TypeAlias

import bpy
import numpy as np

Scalar: TypeAlias = float | bpy.types.NodeSocket
NodeColor: TypeAlias = np.ndarray | bpy.types.NodeSocket

_COMPUTE = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "POWER": lambda a, b: max(a, 0.0) ** b,
    "MAXIMUM": lambda a, b: max(a, b),
}


def is_socket(value: Scalar | NodeColor) -> bool:
    """Return whether a value is only known where it is rendered."""
    return isinstance(value, bpy.types.NodeSocket)


class NodeAlgebra:
    """Adds and multiplies in one node tree.

    tree: Where nodes are added; None where all values are constants.
    """

    def __init__(self, tree: bpy.types.NodeTree | None) -> None:
        self._tree = tree

    def calculate(self, operation: str, a: Scalar, b: Scalar) -> Scalar:
        """Return the result of a Math node for two scalars."""
        if not is_socket(a) and not is_socket(b):
            return float(_COMPUTE[operation](a, b))
        node = self._new("ShaderNodeMath", operation)
        self._feed(node.inputs[0], a)
        self._feed(node.inputs[1], b)
        return node.outputs["Value"]

    def saturate(self, a: Scalar) -> Scalar:
        """Return a scalar, clamped to [0, 1]."""
        if not is_socket(a):
            return min(max(a, 0.0), 1.0)
        node = self._new("ShaderNodeMath", "ADD")
        node.use_clamp = True
        self._feed(node.inputs[0], a)
        node.inputs[1].default_value = 0.0
        return node.outputs["Value"]

    def complement(self, a: Scalar) -> Scalar:
        """Return 1 − a."""
        return self.calculate("SUBTRACT", 1.0, a)

    def add(self, a: NodeColor, b: NodeColor) -> NodeColor:
        """Return a + b."""
        if not is_socket(a) and not is_socket(b):
            return a + b
        if _is_zero(a):
            return b
        return a if _is_zero(b) else self._vector("ADD", a, b)

    def multiply(self, a: NodeColor, b: NodeColor) -> NodeColor:
        """Return a · b, channel by channel."""
        if not is_socket(a) and not is_socket(b):
            return a * b
        if _is_zero(a) or _is_zero(b):
            return np.zeros(3)
        return self._vector("MULTIPLY", a, b)

    def divide(self, a: NodeColor, b: NodeColor) -> NodeColor:
        """Return a / b, channel by channel, and 0 for division by 0."""
        if not is_socket(a) and not is_socket(b):
            return np.divide(a, b, out=np.zeros(3), where=b != 0)
        return self._vector("DIVIDE", a, b)

    def scale(self, a: NodeColor, factor: Scalar) -> NodeColor:
        """Return a color times a scalar."""
        if not is_socket(a) and not is_socket(factor):
            return a * factor
        if not is_socket(factor) and factor == 1.0:
            return a
        if _is_zero(a) or (not is_socket(factor) and factor == 0.0):
            return np.zeros(3)
        node = self._new("ShaderNodeVectorMath", "SCALE")
        self._feed(node.inputs["Vector"], a)
        self._feed(node.inputs["Scale"], factor)
        return node.outputs["Vector"]

    def square_root(self, a: NodeColor) -> NodeColor:
        """Return √a, channel by channel."""
        if not is_socket(a):
            return np.sqrt(np.maximum(a, 0.0))
        if self._tree is None:
            raise ValueError("sockets need a node tree to be combined in")
        node = self._tree.nodes.new("ShaderNodeGamma")
        self._feed(node.inputs["Color"], a)
        node.inputs["Gamma"].default_value = 0.5
        return node.outputs["Color"]

    def blend(self, share: Scalar, a: NodeColor, b: NodeColor) -> NodeColor:
        """Return a · (1 − share) + b · share; the share is a saturated one."""
        return self.add(self.scale(a, self.complement(share)), self.scale(b, share))

    def mean(self, a: NodeColor) -> Scalar:
        """Return the mean of the three channels."""
        if not is_socket(a):
            return float(a.mean())
        return self._vector("DOT_PRODUCT", a, np.full(3, 1 / 3), "Value")

    def _vector(
        self, operation: str, a: NodeColor, b: NodeColor, output: str = "Vector"
    ) -> bpy.types.NodeSocket:
        node = self._new("ShaderNodeVectorMath", operation)
        self._feed(node.inputs[0], a)
        self._feed(node.inputs[1], b)
        return node.outputs[output]

    def _new(self, kind: str, operation: str) -> bpy.types.Node:
        if self._tree is None:
            raise ValueError("sockets need a node tree to be combined in")
        node = self._tree.nodes.new(kind)
        node.operation = operation
        return node

    def _feed(self, target: bpy.types.NodeSocket, value: Scalar | NodeColor) -> None:
        if is_socket(value):
            target.id_data.links.new(value, target)
        else:
            target.default_value = value


def _is_zero(value: NodeColor) -> bool:
    return not is_socket(value) and not value.any()
