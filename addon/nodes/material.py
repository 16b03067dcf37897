"""A record as a Blender material."""

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import bpy

from ..records import (
    BAKED,
    BEFORE_KEY,
    BOUNCES_KEY,
    COUNT_KEY,
    KEY,
    KIND_KEY,
    VERSION,
    VERSION_KEY,
    embed,
)
from .baked import baked_group
from .live import live_group, live_inputs
from .principled import principled_node
from .tree import empty_shader_tree

KINDS = ("live", "lobe", "measured", "principled", "auto")
# Up to which part of the light that is off `auto` takes a kind, if nothing else is asked for.
TOLERANCE = 0.05
# View angles from here on, in degrees, are grazing.
GRAZING = 70.0
# What a Principled BSDF costs, in specular closures (README, "Error against run time").
PRINCIPLED_COST = 2.5


def build_material(
    record: Any,
    kind: str = "live",
    name: str | None = None,
    count: int | None = None,
    tolerance: float = TOLERANCE,
    diffuse_bounces: bool = False,
) -> bpy.types.Material:
    """A new material for a `lobefit.Record`, called `name` or like the record; see fill_material.

    Raises ValueError for another kind than those in KINDS, and for a baked kind whose closures the
    record does not hold (`lobefit.closures` adds them).
    """
    choice = choose(record, kind, count, tolerance)
    material = bpy.data.materials.new(record.name if name is None else name)
    _fill(material, record, choice, diffuse_bounces)
    return material


def fill_material(
    material: bpy.types.Material,
    record: Any,
    kind: str = "live",
    count: int | None = None,
    tolerance: float = TOLERANCE,
    diffuse_bounces: bool = False,
) -> None:
    """Replaces the material's nodes by those of a record, and keeps everything else of it.

    Its output for all renderers is the record's best Principled BSDF, which EEVEE, the viewport and
    the exporters show. Other kinds than `principled` give Cycles an output of its own: the group
    'Lobefit Live', or a baked group of the fitted lobe (`lobe`) or of the measurement (`measured`)
    with `count` specular closures (the most the record holds, if None). `auto` takes the cheapest
    that is at most `tolerance` off. With `diffuse_bounces` Cycles takes a diffuse closure instead
    for rays that left a diffuse surface. The record goes along as JSON in the custom property
    `lobefit_record`, what was chosen in `lobefit_kind` and `lobefit_closures`, and which version of
    the nodes was built in `lobefit_version`.
    """
    _fill(material, record, choose(record, kind, count, tolerance), diffuse_bounces)


def discard(materials: Collection[int], groups: Collection[int]) -> None:
    """Removes these materials, and the groups of the file that nothing uses but for these groups.

    Both are told by `session_uid`, so that it does no harm where they are gone already.
    """
    for material in list(bpy.data.materials):
        if material.session_uid in materials:
            bpy.data.materials.remove(material)
    for group in list(bpy.data.node_groups):
        if group.users == 0 and group.session_uid not in groups:
            bpy.data.node_groups.remove(group)


def add_to_tree(
    tree: bpy.types.NodeTree,
    record: Any,
    location: tuple[float, float],
    kind: str = "live",
    count: int | None = None,
    tolerance: float = TOLERANCE,
) -> bpy.types.Node:
    """Adds what Cycles shows of a `lobefit.Record` to a tree that is there, alone selected.

    The options are those of `build_material`. Nothing is linked. Returns the node whose shader it
    is; the record and what was chosen go along in its custom properties, as with a material.
    """
    choice = choose(record, kind, count, tolerance)
    for node in tree.nodes:
        node.select = False
    if choice.kind == "principled":
        shader = principled_node(tree, record.principled).outputs[0]
    else:
        shader = _add_own_shader(tree, record.name, record, choice)
    added = [node for node in tree.nodes if node.select]
    first = added[0].location.copy()
    for node in added:
        node.location = [
            place + old - start
            for place, old, start in zip(location, node.location, first, strict=True)
        ]
    shader.node[KEY] = record.to_json()
    shader.node[KIND_KEY], shader.node[COUNT_KEY] = choice.kind, choice.count
    tree.nodes.active = shader.node
    return shader.node


class Choice(NamedTuple):
    """A kind that is not `auto`, and for a baked one the record's entry it shows."""

    kind: str
    closures: Mapping[str, Any] | None = None

    @property
    def count(self) -> int:
        """How many specular closures are drawn."""
        return 0 if self.closures is None else len(self.closures["specular"])

    def error(self, record: Any) -> float:
        """The part of the measured light that is off; of a fitted lobe that of the fit."""
        if self.kind == "measured":
            return self.closures["error"]
        if self.kind == "principled":
            return record.principled["error"]
        return record.error["relative_l1_cosine"]["pooled"] or 0.0

    def told_error(self, record: Any) -> str:
        """The same in words, and what closures add to that of a fitted lobe."""
        told = f"{self.error(record):.1%} of the reflected light is off"
        if self.kind == "lobe":
            told += f", and {self.closures['error']:.1%} of the fitted lobe's"
        return told

    def grazing_error(self, record: Any) -> float | None:
        """The same of the light seen from beyond 70 degrees from the normal, where it is known."""
        if self.kind == "measured":
            table = self.closures["by_view"]
            errors = zip(table["view_angle"], table["relative_error"], strict=True)
            found = [error for angle, error in errors if angle >= GRAZING]
            return sum(found) / len(found) if found else None
        if self.kind == "principled" or record.error_by_angle is None:
            return None
        view = record.error_by_angle["view"]
        rows = zip(view["view_angle"], view["misfit"], view["measured"], strict=False)
        beyond = [sums for start, *sums in rows if start >= GRAZING]
        misfit, measured = (sum(column) for column in zip(*beyond, strict=True))
        return misfit / measured if measured > 0 else None

    def albedo(self, record: Any) -> dict[str, list[Any]]:
        """By `view_angle` in degrees, of the target (`measured`) and as Cycles shows it (`shown`).

        Each is three channels or None; the live kind is taken to show what was fitted, and of the
        Principled BSDF nothing is known.
        """
        if self.closures is not None:
            table = self.closures["by_view"]
            measured, shown = table["target_albedo"], table["closures_albedo"]
        else:
            table = record.albedo
            measured, shown = table["measured"], table["model"] if self.kind == "live" else []
        return {"view_angle": table["view_angle"], "measured": measured, "shown": shown}

    def shown(self, record: Any) -> tuple[str, Mapping[str, Any]]:
        """What Cycles shows, as `lobefit.preview` takes it."""
        if self.closures is not None:
            return "closures", self.closures
        if self.kind == "principled":
            return "principled", record.principled
        return "live", record.parameters


def choose(
    record: Any, kind: str, count: int | None = None, tolerance: float = TOLERANCE
) -> Choice:
    """What a kind stands for with this record; raises ValueError where it stands for nothing."""
    if kind not in KINDS:
        raise ValueError(f"kind: expected one of {', '.join(KINDS)}, found '{kind}'.")
    if kind == "auto":
        return choices(record, tolerance)[0]
    if kind not in BAKED:
        return Choice(kind)
    found = [
        entry
        for entry in record.closures
        if entry["target"] == kind and count in (None, entry["count"])
    ]
    if not found:
        many = "" if count is None else f" with {count} specular closures"
        raise ValueError(
            f"{record.name}: expected a record with the closures of kind '{kind}'{many}, found "
            "none; `lobefit closures` adds them."
        )
    return Choice(kind, max(found, key=lambda entry: entry["count"]))


def shown_by(material: bpy.types.Material, record: Any) -> Choice:
    """What a material made of the record shows; `live` in files from before there were kinds."""
    kind = material.get(KIND_KEY, "live")
    if kind not in BAKED:
        return Choice("principled" if kind == "principled" else "live")
    count = material.get(COUNT_KEY)
    entries = [entry for entry in record.closures if entry["target"] == kind]
    return Choice(kind, next((e for e in entries if len(e["specular"]) == count), None))


def choices(record: Any, tolerance: float) -> list[Choice]:
    """The ways to show the measurement, the cheapest that is within the tolerance first.

    Where none is within the tolerance, the nearest is first. Cost goes by the number of closures.
    """
    measured = [entry for entry in record.closures if entry["target"] == "measured"]
    ways = [(entry["error"], entry["count"], Choice("measured", entry)) for entry in measured]
    ways.append((record.principled["error"], PRINCIPLED_COST, Choice("principled")))
    ways.sort(key=lambda way: (max(way[0], tolerance), way[1], way[0]))
    return [way for _, _, way in ways]


def _fill(material: bpy.types.Material, record: Any, choice: Choice, diffuse_bounces: bool) -> None:
    tree = empty_shader_tree(material)
    principled = principled_node(tree, record.principled, location=(0.0, 0.0))
    _add_output(tree, "ALL", principled.outputs[0], (500.0, 0.0)).is_active_output = True
    shader = _add_own_shader(tree, material.name, record, choice)
    if shader is not None:
        if diffuse_bounces:
            shader = _add_bounces(tree, f"{material.name} bounces", record, shader)
        _add_output(tree, "CYCLES", shader, (500.0, 300.0))
    embed(material, record)
    material[KIND_KEY], material[COUNT_KEY] = choice.kind, choice.count
    material[VERSION_KEY] = VERSION
    material[BOUNCES_KEY] = diffuse_bounces and shader is not None
    # A material that is filled anew has nothing to go back to.
    material.pop(BEFORE_KEY, None)


def _add_own_shader(
    tree: bpy.types.NodeTree, name: str, record: Any, choice: Choice
) -> bpy.types.NodeSocket | None:
    """What Cycles shows instead of the Principled BSDF; None where it shows that."""
    if choice.kind == "live":
        return _add_live(tree, record.parameters)
    if choice.closures is not None:
        return _add_baked(tree, f"{name} {choice.kind}", choice.closures)
    return None


def _add_bounces(
    tree: bpy.types.NodeTree, name: str, record: Any, shader: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """The shader, and for rays that left a diffuse surface what is diffuse of the measurement."""
    path = tree.nodes.new("ShaderNodeLightPath")
    path.location = (-250.0, 900.0)
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.location = (300.0, 500.0)
    tree.links.new(path.outputs["Is Diffuse Ray"], mix.inputs[0])
    tree.links.new(shader, mix.inputs[1])
    tree.links.new(_add_diffuse(tree, name, record), mix.inputs[2])
    return mix.outputs[0]


def _add_diffuse(tree: bpy.types.NodeTree, name: str, record: Any) -> bpy.types.NodeSocket:
    """The record's closures without a specular one, or a diffuse closure of the mean albedo."""
    for entry in record.closures:
        if entry["target"] == "measured" and not entry["specular"]:
            return _add_baked(tree, name, entry, (0.0, 600.0))
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.location = (0.0, 600.0)
    known = [rgb for rgb in record.albedo["measured"] if None not in rgb] or [[0.5] * 3]
    mean = [sum(rgb[channel] for rgb in known) / len(known) for channel in range(3)]
    node.inputs["Color"].default_value = (*mean, 1.0)
    return node.outputs[0]


def _add_baked(
    tree: bpy.types.NodeTree,
    name: str,
    closures: Mapping[str, Any],
    location: tuple[float, float] = (0.0, 300.0),
) -> bpy.types.NodeSocket:
    # A material fitted anew replaces its own group; the same source always makes the same tree.
    old = bpy.data.node_groups.get(name)
    if old is not None and old.users == 0:
        bpy.data.node_groups.remove(old)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = baked_group(name, closures)
    node.name = node.label = name
    node.width, node.location = 200.0, location
    return node.outputs[0]


def _add_live(tree: bpy.types.NodeTree, parameters: dict[str, Any]) -> bpy.types.NodeSocket:
    """The shader of the live group, or the sum of several where the channels differ in exponent."""
    total = None
    for index, values in enumerate(live_inputs(parameters)):
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = live_group()
        node.name = node.label = node.node_tree.name
        node.width, node.location = 200.0, (0.0, 300.0 + 320.0 * index)
        for socket, value in values.items():
            colour = isinstance(value, list)
            node.inputs[socket].default_value = (*value, 1.0) if colour else value
        shader = node.outputs[0]
        if total is not None:
            both = tree.nodes.new("ShaderNodeAddShader")
            both.location = (250.0, 300.0 + 320.0 * index)
            tree.links.new(total, both.inputs[0])
            tree.links.new(shader, both.inputs[1])
            shader = both.outputs[0]
        total = shader
    return total


def _add_output(
    tree: bpy.types.NodeTree,
    target: str,
    shader: bpy.types.NodeSocket,
    location: tuple[float, float],
) -> bpy.types.Node:
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.target = target
    output.name = output.label = "Cycles" if target == "CYCLES" else "All"
    output.location = location
    tree.links.new(shader, output.inputs["Surface"])
    return output
