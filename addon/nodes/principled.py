"""The best-fit Principled BSDF of a measurement, as a node that every exporter reads."""

from collections.abc import Mapping, Sequence
from typing import Any

import bpy


def principled_node(
    tree: bpy.types.NodeTree,
    principled: Mapping[str, Any],
    location: Sequence[float] = (0.0, 0.0),
) -> bpy.types.ShaderNodeBsdfPrincipled:
    """Add a Principled BSDF with the sockets of a record's `principled` entry to a shader tree.

    `principled` holds `base_color` and `specular_tint` (three linear numbers in [0, 1] each),
    `metallic` and `roughness` (in [0, 1]) and `ior` (at least 1). The values are set on the
    sockets, with nothing linked, so that the glTF and USD exporters find them. The distribution is
    single-scattering GGX: the fit is made for it.
    """
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.location = location
    node.distribution = "GGX"
    node.inputs["Base Color"].default_value = (*principled["base_color"], 1.0)
    node.inputs["Metallic"].default_value = principled["metallic"]
    node.inputs["Roughness"].default_value = principled["roughness"]
    node.inputs["IOR"].default_value = principled["ior"]
    node.inputs["Specular Tint"].default_value = (*principled["specular_tint"], 1.0)
    return node
