"""Baked node groups: a few closures whose parameters are curves of the view angle.

The group shows an entry of a record's `closures`: a diffuse closure and some bent, anisotropic GGX
or Beckmann ones (native/closures/closure_set.h computes the same in C++). One RGB Curve node with
the cosine of the view angle in all three channels holds a closure's roughness, anisotropy and
bend, a second one its weight; curves that hardly vary are constants on the sockets, and what is
black is left out. The curves' points stand on the entries of the tables of 256 steps through which
Blender and Cycles read a curve, so that nothing is lost.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import bpy

from .tree import Curve, NodeFormulas, Scalar, Vector, set_points

# Added to the tangent: at normal incidence, where closures are isotropic, nothing else tells it
# from the normal, and Cycles makes NaN of a tangent along the normal. Its direction is one that no
# modelled surface faces.
TINY_TANGENT = (3.7e-7, 5.9e-7, 7.1e-7)


def baked_group(name: str, closures: Mapping[str, Any]) -> bpy.types.ShaderNodeTree:
    """A new group, called `name`, with the inputs Tint, Strength and Normal."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    _add_sockets(group)
    _Group(group).add(closures)
    return group


def is_baked(node: bpy.types.Node) -> bool:
    """Whether a node is an instance of a baked group."""
    return [socket.name for socket in node.inputs] == ["Tint", "Strength", "Normal"]


def is_black(weight: Sequence[Curve]) -> bool:
    """Whether a closure with this weight would show nothing at any view angle."""
    return all(value <= 0 for curve in weight for _, value in curve)


def _add_sockets(group: bpy.types.ShaderNodeTree) -> None:
    add = group.interface.new_socket
    add("Tint", in_out="INPUT", socket_type="NodeSocketColor").default_value = (1.0, 1.0, 1.0, 1.0)
    strength = add("Strength", in_out="INPUT", socket_type="NodeSocketFloat")
    strength.default_value, strength.min_value, strength.max_value = 1.0, 0.0, 1e9
    add("Normal", in_out="INPUT", socket_type="NodeSocketVector").hide_value = True
    add("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")


class _Group:
    """The nodes of one group under construction."""

    def __init__(self, group: bpy.types.ShaderNodeTree) -> None:
        self.formulas = NodeFormulas(group)

    def add(self, closures: Mapping[str, Any]) -> None:
        with self.formulas.frame("View"):
            self._view()
        shaders = []
        for index, specular in enumerate(closures["specular"]):
            if not is_black(specular["weight"]):
                with self.formulas.frame(f"Lobe {index + 1}"):
                    shaders.append(self._specular(specular))
        if not is_black(closures["diffuse"]) or not shaders:
            with self.formulas.frame("Diffuse"):
                shaders.append(self._diffuse(closures["diffuse"]))
        with self.formulas.frame("Sum"):
            self._sum(shaders)
        self.formulas.tidy()

    def _view(self) -> None:
        formulas = self.formulas
        outputs = formulas.node("NodeGroupInput").outputs
        tint, strength = Vector(formulas, outputs["Tint"]), Scalar(formulas, outputs["Strength"])
        self.tint = (tint * strength).named("tint")
        # An unconnected Normal arrives as zero; the Bump node makes it the surface's normal.
        bump = formulas.node("ShaderNodeBump", Normal=Vector(formulas, outputs["Normal"]))
        self.normal = Vector(formulas, bump.outputs["Normal"]).normalised().named("normal")
        geometry = formulas.node("ShaderNodeNewGeometry")
        incoming = Vector(formulas, geometry.outputs["Incoming"])
        self.cosine = incoming.dot(self.normal).named("cos theta")
        self.incoming = incoming
        self.tangent = (incoming + TINY_TANGENT).named("tangent")

    def _specular(self, specular: Mapping[str, Any]) -> bpy.types.NodeSocket:
        names = ("roughness", "anisotropy", "bend")
        roughness, anisotropy, bend = self._curves(
            ", ".join(names), [specular[name] for name in names]
        )
        normal = self.normal
        if isinstance(bend, Scalar) or bend != 0.0:
            normal = self.incoming.times_plus(bend, self.normal).named("bent normal")
        inputs = {"Roughness": roughness, "Anisotropy": anisotropy, "Normal": normal}
        if isinstance(anisotropy, Scalar) or anisotropy != 0.0:
            inputs["Tangent"] = self.tangent
        color = self._color("weight", specular["weight"])
        node = self.formulas.node("ShaderNodeBsdfAnisotropic", Color=color, **inputs)
        node.distribution = specular["distribution"].upper()
        return node.outputs[0]

    def _diffuse(self, weight: Sequence[Curve]) -> bpy.types.NodeSocket:
        color = self._color("weight", weight)
        node = self.formulas.node("ShaderNodeBsdfDiffuse", Color=color, Normal=self.normal)
        return node.outputs[0]

    def _color(self, label: str, weight: Sequence[Curve]) -> Vector:
        if all(len(curve) == 1 for curve in weight):
            return self.tint.times(tuple(curve[0][1] for curve in weight)).named(label)
        if weight[0] == weight[1] == weight[2]:
            return (self.tint * self._float_curve(label, weight[0])).named(f"tinted {label}")
        curves = self.formulas.rgb_curves(label, self.cosine, weight)
        return self.tint.times(curves).named(f"tinted {label}")

    def _curves(self, label: str, curves: Sequence[Curve]) -> list[Scalar | float]:
        """The values of three curves at the view angle; numbers for those that are constant."""
        varying = [index for index, curve in enumerate(curves) if len(curve) > 1]
        values: list[Scalar | float] = [curve[0][1] for curve in curves]
        if len(varying) == 1:
            values[varying[0]] = self._float_curve(label, curves[varying[0]])
        elif varying:
            vector = self.formulas.rgb_curves(label, self.cosine, curves)
            separate = self.formulas.node("ShaderNodeSeparateXYZ", Vector=vector)
            for index in varying:
                values[index] = Scalar(self.formulas, separate.outputs[index])
        return values

    def _float_curve(self, label: str, curve: Curve) -> Scalar:
        node = self.formulas.node("ShaderNodeFloatCurve", Value=self.cosine)
        node.label = label
        set_points(node.mapping, node.mapping.curves[0], curve)
        node.mapping.update()
        return Scalar(self.formulas, node.outputs[0])

    def _sum(self, shaders: Sequence[bpy.types.NodeSocket]) -> None:
        links, total = self.formulas.tree.links, shaders[0]
        for shader in shaders[1:]:
            both = self.formulas.node("ShaderNodeAddShader")
            links.new(total, both.inputs[0])
            links.new(shader, both.inputs[1])
            total = both.outputs[0]
        links.new(total, self.formulas.node("NodeGroupOutput").inputs[0])
