"""Node trees written as formulas.

A `NodeFormulas` wraps a node tree; its `Scalar` and `Vector` values are output sockets with
Python's arithmetic, and each operation is one Math or Vector Math node. Plain numbers stay plain
numbers, so constants fold before they become nodes; a repeated operation is the node that is
already there.
Nodes are collapsed and laid out from left to right, frame by frame, and named in the order of the
source: the same source always makes the same tree.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Self

import bpy

COLUMN_WIDTH = 180.0
NODE_WIDTH = 150.0
ROW_HEIGHT = 50.0
OPEN_HEIGHT = 350.0
FRAME_GAP = 80.0


Curve = Sequence[Sequence[float]]  # points [place, value]


class Value:
    """An output socket of a tree under construction."""

    def __init__(self, formulas: "NodeFormulas", socket: bpy.types.NodeSocket) -> None:
        self.formulas = formulas
        self.socket = socket

    def named(self, label: str) -> Self:
        """Labels the node that makes this value."""
        self.socket.node.label = label
        return self


class Scalar(Value):
    """A float, with the arithmetic of the Math node (division by 0 gives 0).

    A sum with a product is one Multiply Add node; the product's own node goes if nothing else
    uses it.
    """

    factors: "tuple[Scalar | float, Scalar | float] | None" = None

    def __add__(self, other: "Scalar | float") -> "Scalar":
        if self.factors:
            return self._math("MULTIPLY_ADD", *self.factors, other)
        if isinstance(other, Scalar) and other.factors:
            return self._math("MULTIPLY_ADD", *other.factors, self)
        return self._math("ADD", self, other)

    __radd__ = __add__

    def __sub__(self, other: "Scalar | float") -> "Scalar":
        if isinstance(other, Scalar):
            return self._math("SUBTRACT", self, other)
        return self + -other

    def __rsub__(self, other: float) -> "Scalar":
        return self._math("SUBTRACT", other, self)

    def __mul__(self, other: "Scalar | float") -> "Scalar":
        product = self._math("MULTIPLY", self, other)
        product.factors = (self, other)
        return product

    __rmul__ = __mul__

    def __truediv__(self, other: "Scalar | float") -> "Scalar":
        return self._math("DIVIDE", self, other)

    def __rtruediv__(self, other: float) -> "Scalar":
        return self._math("DIVIDE", other, self)

    def sqrt(self) -> "Scalar":
        return self._math("SQRT", self)

    def inverse_sqrt(self) -> "Scalar":
        return self._math("INVERSE_SQRT", self)

    def exp(self) -> "Scalar":
        return self._math("EXPONENT", self)

    def power(self, exponent: "Scalar | float") -> "Scalar":
        return self._math("POWER", self, exponent)

    def at_least(self, other: "Scalar | float") -> "Scalar":
        return self._math("MAXIMUM", self, other)

    def at_most(self, other: "Scalar | float") -> "Scalar":
        return self._math("MINIMUM", self, other)

    def is_over(self, other: "Scalar | float") -> "Scalar":
        """1 where this is greater than the other, else 0."""
        return self._math("GREATER_THAN", self, other)

    def _math(self, operation: str, *operands: "Scalar | float") -> "Scalar":
        socket = self.formulas.operation("ShaderNodeMath", operation, operands, "Value")
        return Scalar(self.formulas, socket)


class Vector(Value):
    """Three floats, with the arithmetic of the Vector Math node."""

    def __add__(self, other: "Vector | tuple[float, float, float]") -> "Vector":
        return Vector(self.formulas, self._math("ADD", self, other))

    def __sub__(self, other: "Vector | tuple[float, float, float]") -> "Vector":
        return Vector(self.formulas, self._math("SUBTRACT", self, other))

    def __mul__(self, factor: Scalar | float) -> "Vector":
        # The factor is the fourth input of the node.
        return Vector(self.formulas, self._math("SCALE", self, None, None, factor))

    def times(self, other: "Vector | tuple[float, float, float]") -> "Vector":
        """The product of each component with that of the other."""
        return Vector(self.formulas, self._math("MULTIPLY", self, other))

    def times_plus(self, factor: Scalar | float, addend: "Vector") -> "Vector":
        """This times a factor plus another vector, in one node."""
        factor = (factor,) * 3 if isinstance(factor, float) else factor
        return Vector(self.formulas, self._math("MULTIPLY_ADD", self, factor, addend))

    def dot(self, other: "Vector") -> Scalar:
        return Scalar(self.formulas, self._math("DOT_PRODUCT", self, other, output="Value"))

    def length(self) -> Scalar:
        return Scalar(self.formulas, self._math("LENGTH", self, output="Value"))

    def normalised(self) -> "Vector":
        return Vector(self.formulas, self._math("NORMALIZE", self))

    def _math(self, operation: str, *operands: Any, output: str = "Vector") -> bpy.types.NodeSocket:
        return self.formulas.operation("ShaderNodeVectorMath", operation, operands, output)


class NodeFormulas:
    """Writes formulas into a node tree. Make all nodes inside a `frame`, then call `tidy` once."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self.tree = tree
        self._frames: list[tuple[bpy.types.Node, list[bpy.types.Node]]] = []
        self._operations: dict[tuple[Any, ...], bpy.types.NodeSocket] = {}

    @contextmanager
    def frame(self, label: str) -> Iterator[None]:
        """Puts the nodes made in this block into one frame."""
        frame = self.tree.nodes.new("NodeFrame")
        frame.label = frame.name = label
        self._frames.append((frame, []))
        yield

    def node(self, idname: str, **inputs: Any) -> bpy.types.Node:
        """A node; `inputs` are values or constants by input name, spaces written as underscores."""
        node = self.tree.nodes.new(idname)
        frame, nodes = self._frames[-1]
        node.parent = frame
        nodes.append(node)
        for name, value in inputs.items():
            self._set(node.inputs[name.replace("_", " ")], value)
        return node

    def operation(
        self, idname: str, operation: str, operands: tuple[Any, ...], output: str
    ) -> bpy.types.NodeSocket:
        """The result of a Math or Vector Math node; operands are values, constants or None."""
        sources = tuple(
            item.socket.as_pointer() if isinstance(item, Value) else item for item in operands
        )
        key = (idname, operation, sources)
        if key not in self._operations:
            node = self.node(idname)
            node.operation = operation
            node.hide = True
            for socket, value in zip(node.inputs, operands, strict=False):
                if value is not None:
                    self._set(socket, value)
            self._operations[key] = node.outputs[output]
        return self._operations[key]

    def rgb_curves(self, label: str, place: Scalar, curves: Sequence[Curve]) -> Vector:
        """Three curves seen at `place`, in [0, 1], by one RGB Curve node."""
        node = self.node("ShaderNodeRGBCurve", Color=place)
        node.label = label
        for mapped, curve in zip(node.mapping.curves, curves, strict=False):
            set_points(node.mapping, mapped, curve)
        node.mapping.update()
        return Vector(self, node.outputs[0])

    def _set(self, socket: bpy.types.NodeSocket, value: Any) -> None:
        if isinstance(value, Value):
            self.tree.links.new(value.socket, socket)
        else:
            socket.default_value = value

    def tidy(self) -> None:
        """Removes operations that nothing uses, numbers the nodes and lays them out."""
        for _, nodes in reversed(self._frames):
            for node in reversed(nodes):
                if node.hide and not any(socket.is_linked for socket in node.outputs):
                    nodes.remove(node)
                    self.tree.nodes.remove(node)
        x = 0.0
        for frame, nodes in self._frames:
            frame.location = (x, 0.0)
            x += self._lay_out(nodes) * COLUMN_WIDTH + FRAME_GAP
            for index, node in enumerate(nodes):
                node.name = f"{frame.label} {index + 1}"

    def _lay_out(self, nodes: list[bpy.types.Node]) -> int:
        """Puts each node one column right of what it depends on; returns the number of columns."""
        columns: dict[bpy.types.Node, int] = {}
        heights: dict[int, float] = {}
        for node in nodes:
            before = [link.from_node for socket in node.inputs for link in socket.links]
            column = 1 + max((columns.get(other, -1) for other in before), default=-1)
            columns[node] = column
            y = heights.get(column, 0.0)
            node.location, node.width = (column * COLUMN_WIDTH, y), NODE_WIDTH
            heights[column] = y - (ROW_HEIGHT if node.hide else OPEN_HEIGHT)
        return len(heights)


def set_points(mapping: bpy.types.CurveMapping, mapped: bpy.types.CurveMap, curve: Curve) -> None:
    """Makes the curve of a node go in straight lines through these points."""
    # Clipping would cut values outside of [0, 1] as the points are set.
    mapping.use_clip = False
    mapping.extend = "HORIZONTAL"
    points = curve if len(curve) > 1 else [(0.0, curve[0][1]), (1.0, curve[0][1])]
    while len(mapped.points) < len(points):
        mapped.points.new(0.0, 0.0)
    for point, (place, value) in zip(mapped.points, points, strict=True):
        point.location = (place, value)
        point.handle_type = "VECTOR"


def versioned_group(
    name: str, key: str, version: int, fill: Callable[[bpy.types.ShaderNodeTree], None]
) -> bpy.types.ShaderNodeTree:
    """The file's own group that holds this version under the key, made by `fill` if there is none.

    A file's group is used again only if it is the same group.
    """
    for group in bpy.data.node_groups:
        if group.library is None and group.get(key) == version:
            return group
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group[key] = version
    fill(group)
    return group


def empty_shader_tree(owner: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """The node tree of a material or a world, with no node in it."""
    if owner.node_tree is None:
        # Both have a tree from the start since Blender 5.0, where this property is deprecated.
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def show_grey(tree: bpy.types.NodeTree, shader: str, output: str, value: float) -> None:
    """Adds a shader node of one grey Color and the output node that shows it, by their types."""
    grey = tree.nodes.new(shader)
    grey.inputs["Color"].default_value = (value, value, value, 1.0)
    tree.links.new(grey.outputs[0], tree.nodes.new(output).inputs["Surface"])
