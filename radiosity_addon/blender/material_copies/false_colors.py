"""Colors for signed values: materials send out no negative light."""

from __future__ import annotations

import bpy


def false_colors(tree: bpy.types.NodeTree, values: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Wire nodes that turn the mean of signed RGB into red where positive, blue where negative.

    tree: Of a material; the nodes go below the one that `values` comes from.
    values: A color output; the channels' mean is shown.
    Returns color: (mean, 0, 0) or (0, 0, −mean), none of it negative.
    """
    x, y = values.node.location

    def add(kind: str, operation: str | None, column: int, row: int) -> bpy.types.Node:
        node = tree.nodes.new(kind)
        if operation is not None:
            node.operation = operation
        node.location = (x + 180 * column, y - 300 - 150 * row)
        return node

    mean = add("ShaderNodeVectorMath", "DOT_PRODUCT", 0, 0)
    mean.inputs[1].default_value = (1 / 3, 1 / 3, 1 / 3)
    tree.links.new(values, mean.inputs[0])
    combined = add("ShaderNodeCombineXYZ", None, 3, 0)
    for row, (sign, channel) in enumerate(((1.0, "X"), (-1.0, "Z"))):
        signed = add("ShaderNodeMath", "MULTIPLY", 1, row)
        signed.inputs[1].default_value = sign
        tree.links.new(mean.outputs["Value"], signed.inputs[0])
        above = add("ShaderNodeMath", "MAXIMUM", 2, row)
        above.inputs[1].default_value = 0.0
        tree.links.new(signed.outputs["Value"], above.inputs[0])
        tree.links.new(above.outputs["Value"], combined.inputs[channel])
    return combined.outputs["Vector"]
