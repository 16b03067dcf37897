"""The inputs of a material's nodes that a user may edit, what the record has for them, and edits.

Nothing in here needs the compiled module: panels draw it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import bpy

from ..records import BAKED
from . import baked, live, principled

_AS_BAKED = {"Tint": [1.0, 1.0, 1.0], "Strength": 1.0}
_EQUAL = 1e-5  # of values that are the same but for single precision


def parameter_nodes(material: bpy.types.Material, kind: str) -> list[bpy.types.Node]:
    """The nodes that show the kind in a material, as far as they are still there."""
    found = material.node_tree.nodes if material.node_tree else ()
    if kind == "principled":
        return [node for node in found if node.bl_idname == "ShaderNodeBsdfPrincipled"][:1]
    groups = [node for node in found if node.bl_idname == "ShaderNodeGroup" and node.node_tree]
    if kind in BAKED:
        return [node for node in groups if baked.is_baked(node)]
    return [node for node in groups if live.VERSION_KEY in node.node_tree]


def recorded_inputs(record: Mapping[str, Any], kind: str, count: int) -> list[dict[str, Any]]:
    """What the inputs of `count` such nodes are made with, by the names of their sockets."""
    if kind == "principled":
        return [principled.principled_inputs(record["principled"])]
    if kind in BAKED:
        return [dict(_AS_BAKED)] * count
    # Of versions of the group from 3 on.
    return [inputs | {"Conserve Energy": 0.0} for inputs in live.live_inputs(record["parameters"])]


def is_edited(material: bpy.types.Material, record: Mapping[str, Any], kind: str) -> bool:
    """Whether a parameter has another value than the record tells, or comes from another node."""
    found = parameter_nodes(material, kind)
    recorded = recorded_inputs(record, kind, len(found))
    if len(found) != len(recorded) or not found:
        return True
    return any(map(_differs, found, recorded))


def reset(material: bpy.types.Material, record: Mapping[str, Any], kind: str) -> bool:
    """Gives all parameters the values of the record; False where nodes of it are missing."""
    found = parameter_nodes(material, kind)
    recorded = recorded_inputs(record, kind, len(found))
    if len(found) != len(recorded) or not found:
        return False
    for node, values in zip(found, recorded, strict=True):
        for socket, value in _sockets(node, values):
            for link in tuple(socket.links):
                material.node_tree.links.remove(link)
            socket.default_value = (*value, 1.0) if isinstance(value, Sequence) else value
    return True


def edited_shown(
    material: bpy.types.Material, shown: tuple[str, Mapping[str, Any]]
) -> tuple[str, Mapping[str, Any]] | None:
    """What Cycles shows with the parameters as they are, as `lobefit.preview` takes it.

    `shown` is the same as recorded. None where no formula tells it: where other nodes are linked to
    parameters, where Fresnel is between 0 and 1, and where Conserve Energy is above 0.
    """
    way, what = shown
    kind = what["target"] if way == "closures" else way
    found = parameter_nodes(material, kind)
    if len(found) != 1 or any(s.is_linked for s in found[0].inputs if s.name != "Normal"):
        return None
    values = {s.name: _plain(s) for s in found[0].inputs if hasattr(s, "default_value")}
    told = _TOLD[way](what, values)
    return told and (way, told)


def _live(parameters: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any] | None:
    """The group's inputs as parameters of the interpolated model: `live_inputs` the other way."""
    if values["Fresnel"] not in (0.0, 1.0) or values.get("Conserve Energy", 0.0) > 0:
        return None
    exponent, interpolation = values["Exponent"], values["Interpolation"]
    scale = values["Specular Strength"] / live.normal_albedo(exponent, interpolation)
    return {
        "model": "interpolated",
        "diffuse": values["Base Color"],
        "specular": [scale * channel for channel in values["Specular Color"]],
        "exponent": exponent,
        "interpolation": interpolation,
        "ior": values["IOR"] if values["Fresnel"] else None,
    }


def _principled(recorded: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    return dict(recorded) | {name: values[socket] for name, socket in principled.SOCKETS.items()}


def _baked(entry: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """The closures with the weights that Tint and Strength leave of them."""
    factors = [values["Strength"] * channel for channel in values["Tint"]]

    def tinted(weight: Sequence[Any]) -> list[Any]:
        return [
            [[cosine, factor * value] for cosine, value in curve]
            for factor, curve in zip(factors, weight, strict=True)
        ]

    specular = [lobe | {"weight": tinted(lobe["weight"])} for lobe in entry["specular"]]
    return dict(entry) | {"diffuse": tinted(entry["diffuse"]), "specular": specular}


_TOLD = {"live": _live, "principled": _principled, "closures": _baked}


def _differs(node: bpy.types.Node, recorded: Mapping[str, Any]) -> bool:
    return any(
        socket.is_linked or not _are_equal(_plain(socket), value)
        for socket, value in _sockets(node, recorded)
    )


def _are_equal(value: Any, recorded: Any) -> bool:
    if isinstance(value, list) != isinstance(recorded, list):
        return False
    pairs = zip(value, recorded, strict=True) if isinstance(value, list) else [(value, recorded)]
    return all(math.isclose(*pair, rel_tol=_EQUAL, abs_tol=1e-9) for pair in pairs)


def _sockets(
    node: bpy.types.Node, values: Mapping[str, Any]
) -> list[tuple[bpy.types.NodeSocket, Any]]:
    """The inputs of the node that there are values for; groups of old files may lack some."""
    return [(node.inputs[name], value) for name, value in values.items() if name in node.inputs]


def _plain(socket: bpy.types.NodeSocket) -> Any:
    """A number, or the three of a color."""
    value = socket.default_value
    return list(value)[:3] if hasattr(value, "__len__") else value
