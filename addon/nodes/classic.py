"""The node group 'Classic Phong / Blinn-Phong': the reflection model of old renderers and games.

    I = k_a i_a + sum over lights (k_d (L.N) i_d + k_s (R.V)^s i_s)        Phong
                                  (k_d (L.N) i_d + k_s (N.H)^s' i_s)       Blinn-Phong

with R the mirrored light, H half-way between light and viewer, and each term only where its dot
product is positive, the specular one also only where the diffuse one is. Cycles' nodes never see
the lights, but the model knows no light but those of a list. So the lights are inputs, and what
comes of them is shown as emission: the formula itself, not an approximation. Neither the lamps of
the scene nor shadows change it.
"""

from typing import Any

import bpy

from .tree import NodeFormulas, Scalar, Vector, versioned_group

NAME = "Classic Phong / Blinn-Phong"
# Saved with the group, as that of the live group is: to be raised with any change of the formulas.
VERSION = 1
VERSION_KEY = "lobefit_classic_version"

LIGHTS = 4
# The exponent by which Blinn-Phong comes nearest to Phong over spheres, as lobefit.match_exponent
# finds it: within 2 % for exponents from 0.1 up, and 0.5 % from 1 up.
MATCH_SLOPE, MATCH_START, MATCH_RISE, MATCH_BEND = 3.5175, 0.27, 1.27, 1.25


def classic_group() -> bpy.types.ShaderNodeTree:
    """The group of this version in this file, made if it is not there yet."""
    return versioned_group(NAME, VERSION_KEY, VERSION, _fill)


def is_classic(node: bpy.types.Node) -> bool:
    """Whether the node is an instance of the group."""
    return node.type == "GROUP" and node.node_tree is not None and VERSION_KEY in node.node_tree


def light_socket(light: int, what: str) -> str:
    """The name of an input of the light (from 0): 'Direction', 'Diffuse' or 'Specular'."""
    return f"Light {light + 1} {what}"


def matched_exponent(exponent: Any) -> Any:
    """Blinn-Phong's exponent for one of Phong's, of numbers or node values alike."""
    bend = exponent * MATCH_RISE / (exponent + MATCH_BEND)
    return exponent * MATCH_SLOPE + (bend + MATCH_START)


def _fill(group: bpy.types.ShaderNodeTree) -> None:
    _add_sockets(group)
    formulas = NodeFormulas(group)
    with formulas.frame("Inputs"):
        surface = _Surface(formulas)
    colour = surface.ambient
    for light in range(LIGHTS):
        with formulas.frame(f"Light {light + 1}"):
            colour = colour + _reflected(surface, light)
    with formulas.frame("Emission"):
        emission = formulas.node("ShaderNodeEmission", Color=colour)
        output = formulas.node("NodeGroupOutput", Color=colour)
        group.links.new(emission.outputs[0], output.inputs["Emission"])
    formulas.tidy()


def _add_sockets(group: bpy.types.ShaderNodeTree) -> None:
    def add(name: str, kind: str, default: Any, panel: Any = None, way: str = "INPUT") -> Any:
        socket = group.interface.new_socket(
            name, in_out=way, socket_type=f"NodeSocket{kind}", parent=panel
        )
        if default is not None:
            socket.default_value = default
        return socket

    add("Emission", "Shader", None, way="OUTPUT")
    add("Color", "Color", None, way="OUTPUT")
    add("Ambient Color", "Color", (0.2, 0.2, 0.2, 1.0))
    add("Diffuse Color", "Color", (0.8, 0.8, 0.8, 1.0))
    add("Specular Color", "Color", (1.0, 1.0, 1.0, 1.0))
    exponent = add("Exponent", "Float", 20.0)
    exponent.min_value, exponent.max_value = 0.0, 1e5
    for name in ("Blinn-Phong", "Match Exponent"):
        factor = add(name, "Float", 0.0)
        factor.subtype, factor.min_value, factor.max_value = "FACTOR", 0.0, 1.0
    add("Normal", "Vector", None).hide_value = True
    add("Ambient Light", "Color", (0.2, 0.2, 0.2, 1.0))
    for light in range(LIGHTS):
        panel = group.interface.new_panel(f"Light {light + 1}", default_closed=light > 0)
        white = (1.0, 1.0, 1.0, 1.0) if light == 0 else (0.0, 0.0, 0.0, 1.0)
        add(light_socket(light, "Direction"), "Vector", (1.0, -1.0, 1.2), panel)
        add(light_socket(light, "Diffuse"), "Color", white, panel)
        add(light_socket(light, "Specular"), "Color", white, panel)


class _Surface:
    """What all lights meet: the material's inputs, the normal and the viewer."""

    def __init__(self, formulas: NodeFormulas) -> None:
        self.formulas = formulas
        self.outputs = formulas.node("NodeGroupInput").outputs
        # An unconnected Normal arrives as zero; the Bump node makes it the surface's normal.
        bump = formulas.node("ShaderNodeBump", Normal=self.vector("Normal"))
        self.normal = Vector(formulas, bump.outputs["Normal"]).normalised().named("N")
        self.viewer = Vector(formulas, formulas.node("ShaderNodeNewGeometry").outputs["Incoming"])
        self.ambient = self.vector("Ambient Color").times(self.vector("Ambient Light"))
        self.diffuse = self.vector("Diffuse Color")
        self.specular = self.vector("Specular Color")
        self.facing = self.viewer.dot(self.normal).named("N.V")
        self.blinn = self.scalar("Blinn-Phong").at_least(0.0).at_most(1.0)
        self.exponent = self.scalar("Exponent").at_least(0.0).named("s")
        match = self.scalar("Match Exponent").at_least(0.0).at_most(1.0)
        more = matched_exponent(self.exponent) - self.exponent
        self.blinn_exponent = (more * match + self.exponent).named("s'")

    def scalar(self, name: str) -> Scalar:
        return Scalar(self.formulas, self.outputs[name])

    def vector(self, name: str) -> Vector:
        return Vector(self.formulas, self.outputs[name])


def _reflected(surface: _Surface, light: int) -> Vector:
    """What the surface shows of a light."""
    direction, diffuse, specular = (
        surface.vector(light_socket(light, what)) for what in ("Direction", "Diffuse", "Specular")
    )
    direction = direction.normalised().named("L")
    incidence = direction.dot(surface.normal).named("N.L")
    # R.V by R = 2 (N.L) N - L.
    mirrored = incidence * surface.facing * 2 - direction.dot(surface.viewer)
    half = (direction + surface.viewer).normalised().named("H")
    phong = _power(mirrored.named("R.V"), surface.exponent)
    blinn = _power(half.dot(surface.normal).named("N.H"), surface.blinn_exponent)
    lobe = ((blinn - phong) * surface.blinn + phong) * incidence.is_over(0.0)
    shown = surface.diffuse.times(diffuse) * incidence.at_least(0.0)
    return shown + surface.specular.times(specular) * lobe


def _power(cosine: Scalar, exponent: Scalar) -> Scalar:
    """The power, cut where the cosine is not positive, also where the exponent is 0."""
    return cosine.at_least(0.0).power(exponent) * cosine.is_over(0.0)
