"""The best-fit Principled BSDF of a measurement, as a node that every exporter reads."""

from collections.abc import Mapping, Sequence
from typing import Any

import bpy

# The sockets of the node by the entries of a record's `principled`.
SOCKETS = {
    "base_color": "Base Color",
    "metallic": "Metallic",
    "roughness": "Roughness",
    "ior": "IOR",
    "specular_tint": "Specular Tint",
}


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
    for socket, value in principled_inputs(principled).items():
        colour = isinstance(value, list)
        node.inputs[socket].default_value = (*value, 1.0) if colour else value
    return node


def principled_inputs(principled: Mapping[str, Any]) -> dict[str, Any]:
    """The values of the node's sockets by their names."""
    return {socket: principled[name] for name, socket in SOCKETS.items()}
