"""Which closures a scene needs: the cheapest kinds that change the picture by no more than asked.

The nearest that a record has to its measurement is what other kinds are compared with. What a kind
adds is its distance from that at the angles the material is seen at, times the light that the
material sends to the camera: a share of the picture times an albedo. The sum over all materials is,
at worst, the part of the picture's light that is changed, if light comes from everywhere alike.

Bounced light meets a material at every angle and is mixed before it is seen. So no kind is taken
whose error over all angles exceeds `BOUNCE_TOLERANCE`, seen or not, unless none is better.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .angle_errors import Comparison
from .nodes.baked import is_black
from .nodes.material import BAKED, build_material, fill_material
from .records import BEFORE_COUNT_KEY, BEFORE_KIND_KEY, COUNT_KEY, KEY, KIND_KEY
from .scene_view import DEGREES, View

# Parts of the reflected light that may be off where only bounced light shows it.
BOUNCE_TOLERANCE = 0.1
# What surfaces that are not measured reflect: a photographer's grey. The darker they are taken to
# be, the more the errors of the measured ones count.
OTHER_ALBEDO = 0.18
# What kinds cost, in specular closures (README, "Error against run time").
DIFFUSE_COST, PRINCIPLED_COST, LIVE_COST = 0.25, 2.5, 5.0

_ANGLES = np.arange(DEGREES) + 0.5
_COMPARED = ".lobefit as built"  # a material that is there only to be compared with


@dataclass(frozen=True)
class Way:
    """A way to show a material: its cost in closures, and the part of the light that is off.

    `error` is that over all view angles. `by_angle` is at most what is off at each degree from the
    normal, and `added` how far the way is from the nearest one.
    """

    kind: str
    count: int
    cost: float
    error: float
    by_angle: NDArray[np.float64]
    added: NDArray[np.float64]


@dataclass(frozen=True)
class Subject:
    """A material to choose for, by its `session_uid`: what it shows and what it could."""

    uid: int
    name: str
    record: Any
    now: Way
    ways: tuple[Way, ...]
    albedo: NDArray[np.float64]


@dataclass(frozen=True)
class Choice:
    """What was chosen for a material; shares and errors are parts of the picture, by frame.

    `error` and `error_before` are against the measurement, `added` is against the nearest way.
    """

    subject: Subject
    way: Way
    share: NDArray[np.float64]
    added: NDArray[np.float64]
    error: NDArray[np.float64]
    error_before: NDArray[np.float64]
    seen: NDArray[np.float64]


def ways_of(record: Any) -> tuple[Way, ...]:
    """All ways to show a record's measurement, as far as their error is known."""
    fit_error = _fit_error(record)
    sources: list[tuple[str, Mapping[str, Any] | None, float, float]] = [
        # The error of closures made for the fitted lobe comes on top of the fit's own.
        (
            entry["target"],
            entry,
            _cost(entry),
            entry["error"] + (fit_error if entry["target"] == "lobe" else 0.0),
        )
        for entry in record.closures
    ]
    sources.append(("principled", None, PRINCIPLED_COST, _known(record.principled["error"])))
    sources.append(("live", None, LIVE_COST, fit_error))
    sources = [source for source in sources if np.isfinite(source[3])]
    nearest = min(
        (entry for entry in record.closures if entry["target"] == "measured"),
        key=lambda entry: entry["error"],
        default=None,
    )
    if nearest is None:
        return tuple(_even_way(*source, least=min(s[3] for s in sources)) for source in sources)
    comparison = Comparison(record, nearest)
    own_error = np.asarray(nearest["by_view"]["relative_error"], float)
    return tuple(_compared_way(*source, comparison, own_error) for source in sources)


def _compared_way(
    kind: str,
    entry: Mapping[str, Any] | None,
    cost: float,
    error: float,
    comparison: Comparison,
    own_error: NDArray[np.float64],
) -> Way:
    """A way beside the nearest one, which is off by `own_error` itself."""
    added = comparison.distances(kind, entry)
    off = added + own_error
    if kind == "measured":
        off = np.asarray(entry["by_view"]["relative_error"], float)
    return Way(
        kind,
        0 if entry is None else entry["count"],
        cost,
        error,
        _at_angles(comparison.angles, off),
        _at_angles(comparison.angles, added),
    )


def _even_way(
    kind: str, entry: Mapping[str, Any] | None, cost: float, error: float, least: float
) -> Way:
    """A way with nothing to compare it with: it is taken to be off by the same at every angle."""
    count = 0 if entry is None else entry["count"]
    even = np.ones(DEGREES)
    return Way(kind, count, cost, error, even * error, even * (error - least))


def _cost(entry: Mapping[str, Any]) -> float:
    drawn = sum(not is_black(specular["weight"]) for specular in entry["specular"])
    return drawn + DIFFUSE_COST * (not is_black(entry["diffuse"]))


def _fit_error(record: Any) -> float:
    return _known(record.error["relative_l1_cosine"]["pooled"])


def _known(error: float | None) -> float:
    return np.inf if error is None else error


def _at_angles(angles: Sequence[float], values: Sequence[float]) -> NDArray[np.float64]:
    """Values between those at some view angles, and beyond them the outermost."""
    order = np.argsort(angles)
    return np.interp(_ANGLES, np.asarray(angles)[order], np.asarray(values, float)[order])


def albedo_of(record: Any) -> NDArray[np.float64]:
    """The part of the light that the measurement reflects, by degree of the view angle."""
    for entry in record.closures:
        if entry["target"] == "measured":
            table = zip(
                entry["by_view"]["view_angle"], entry["by_view"]["target_albedo"], strict=True
            )
            break
    else:
        table = zip(record.albedo["view_angle"], record.albedo["measured"], strict=True)
    known = [(angle, np.mean(rgb)) for angle, rgb in table if None not in rgb]
    return _at_angles(*zip(*known, strict=True)) if known else np.ones(DEGREES)


def subject_of(material: bpy.types.Material, record: Any, ways: Sequence[Way]) -> Subject | str:
    """The material with the ways of its record, or the reason why it has to be left as it is."""
    shown = str(material.get(KIND_KEY, "live")), int(material.get(COUNT_KEY, 0))
    count = _asked_count(record, *shown)
    now = [way for way in ways if (way.kind, way.count) == (shown[0], count)]
    if not now:
        return "what it shows is not in its record"
    return Subject(
        material.session_uid, material.name, record, now[0], tuple(ways), albedo_of(record)
    )


def _asked_count(record: Any, kind: str, shown: int) -> int | None:
    """Which entry of the record a material with so many closures shows, by its own count."""
    if kind not in BAKED:
        return 0
    entries = [entry for entry in record.closures if entry["target"] == kind]
    return next((e["count"] for e in entries if len(e["specular"]) == shown), None)


def choose_ways(
    subjects: Sequence[Subject], views: Sequence[View], tolerance: float
) -> list[Choice]:
    """The cheapest ways that add at most `tolerance` of the picture's light on every frame.

    Every material begins with what is nearest to its measurement; then the step is taken that saves
    most for what it adds, for as long as there is one within the tolerance.
    """
    light = _light(subjects, views)
    shares = [_shares(subject, views) for subject in subjects]
    candidates = [_sound_ways(subject) for subject in subjects]
    added = [
        np.array([_part_of_light(subject, way.added, views, light) for way in ways])
        for subject, ways in zip(subjects, candidates, strict=True)
    ]
    costs = [np.array([way.cost for way in ways]) for ways in candidates]
    picked = _greedy(added, costs, shares, tolerance)
    return [
        Choice(
            subject=subject,
            way=candidates[index][picked[index]],
            share=shares[index],
            added=added[index][picked[index]],
            error=_part_of_light(subject, candidates[index][picked[index]].by_angle, views, light),
            error_before=_part_of_light(subject, subject.now.by_angle, views, light),
            seen=sum((_seen(subject, view) for view in views), np.zeros(DEGREES)),
        )
        for index, subject in enumerate(subjects)
    ]


def _sound_ways(subject: Subject) -> list[Way]:
    """The ways that will do for bounced light too."""
    limit = max(BOUNCE_TOLERANCE, min(way.error for way in subject.ways))
    return [way for way in subject.ways if way.error <= limit]


def _greedy(
    errors: Sequence[NDArray[np.float64]],
    costs: Sequence[NDArray[np.float64]],
    shares: Sequence[NDArray[np.float64]],
    tolerance: float,
) -> list[int]:
    """For each material the index of its way; `errors` are (ways, frames) for each of them."""
    # Where no frame shows a material no way adds anything, and the cheapest comes first.
    picked = [
        int(np.lexsort((cost, error.sum(1)))[0]) for error, cost in zip(errors, costs, strict=True)
    ]
    while True:
        total = sum(error[way] for error, way in zip(errors, picked, strict=True))
        best: tuple[float, int, int] | None = None
        for index, way in enumerate(picked):
            for other in np.flatnonzero(costs[index] < costs[index][way]):
                added = errors[index][other] - errors[index][way]
                if np.any(total + added > tolerance):
                    continue
                saved = (costs[index][way] - costs[index][other]) * shares[index].sum()
                worth = saved / max(added.sum(), 1e-12)
                if best is None or worth > best[0]:
                    best = (worth, index, int(other))
        if best is None:
            return picked
        picked[best[1]] = best[2]


def _seen(subject: Subject, view: View) -> NDArray[np.float64]:
    return view.angles.get(subject.uid, np.zeros(DEGREES))


def _shares(subject: Subject, views: Sequence[View]) -> NDArray[np.float64]:
    return np.array([_seen(subject, view).sum() / max(1, view.rays) for view in views])


def _light(subjects: Sequence[Subject], views: Sequence[View]) -> NDArray[np.float64]:
    """The light of all surfaces in each frame, in rays that meet white."""
    albedos = {subject.uid: subject.albedo for subject in subjects}
    grey = np.full(DEGREES, OTHER_ALBEDO)
    return np.array(
        [
            view.other * OTHER_ALBEDO
            + sum(rays @ albedos.get(uid, grey) for uid, rays in view.angles.items())
            for view in views
        ]
    )


def _part_of_light(
    subject: Subject,
    off: NDArray[np.float64],
    views: Sequence[View],
    light: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Of each frame's light what is off in one material, by parts `off` at each angle."""
    rays = np.array([_seen(subject, view) for view in views])
    return rays @ (subject.albedo * off) / np.maximum(light, 1e-12)


def problem_of(material: bpy.types.Material) -> str:
    """Why a material has to be left as it is; empty for one that may be changed."""
    if material.library is not None:
        return "it is linked from another file"
    if not material.is_editable:
        return "it cannot be edited"
    if material.node_tree is None or material.node_tree.animation_data is not None:
        return "its nodes are animated"
    return ""


def is_as_built(material: bpy.types.Material, record: Any, way: Way, bounces: bool) -> bool:
    """Whether the nodes are still those of the record, so that nothing of a user's is lost."""
    groups = {group.session_uid for group in bpy.data.node_groups}
    # With its own name it takes the place of no group of the user's.
    built = build_material(
        record,
        way.kind,
        name=_COMPARED,
        count=way.count if way.kind in BAKED else None,
        diffuse_bounces=bounces,
    )
    try:
        return tree_content(built.node_tree) == tree_content(material.node_tree)
    finally:
        bpy.data.materials.remove(built)
        for group in list(bpy.data.node_groups):
            if group.session_uid not in groups:
                bpy.data.node_groups.remove(group)


def tree_content(tree: bpy.types.NodeTree) -> tuple[Any, ...]:
    """The nodes, values and links of a tree, to be compared; names and places do not count."""
    order = {node.as_pointer(): index for index, node in enumerate(tree.nodes)}
    nodes = [(node.bl_idname, node.mute, tuple(map(_value, node.inputs))) for node in tree.nodes]
    links = {
        (
            order[link.from_node.as_pointer()],
            _place(link.from_node.outputs, link.from_socket),
            order[link.to_node.as_pointer()],
            _place(link.to_node.inputs, link.to_socket),
        )
        for link in tree.links
    }
    return tuple(nodes), frozenset(links)


def _value(socket: bpy.types.NodeSocket) -> Any:
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def _place(sockets: Any, socket: bpy.types.NodeSocket) -> int:
    return next(index for index, item in enumerate(sockets) if item == socket)


def show(
    material: bpy.types.Material, record: Any, now: Way, way: Way, diffuse_bounces: bool = False
) -> None:
    """Gives a material another way to be shown, and remembers the one it had at first."""
    before = (
        str(material.get(BEFORE_KIND_KEY, now.kind)),
        int(material.get(BEFORE_COUNT_KEY, now.count)),
    )
    fill_material(
        material,
        record,
        way.kind,
        count=way.count if way.kind in BAKED else None,
        diffuse_bounces=diffuse_bounces,
    )
    if before != (way.kind, way.count) or diffuse_bounces:
        material[BEFORE_KIND_KEY], material[BEFORE_COUNT_KEY] = before


def is_simplified(material: bpy.types.Material) -> bool:
    """Whether the material can be shown again as before it was simplified."""
    return BEFORE_KIND_KEY in material and KEY in material


def restore(material: bpy.types.Material, record: Any) -> None:
    """Shows a material as before it was simplified, from the record in it alone.

    Raises ValueError where the record does not hold what was shown.
    """
    kind, count = str(material[BEFORE_KIND_KEY]), int(material[BEFORE_COUNT_KEY])
    fill_material(material, record, kind, count=count if kind in BAKED else None)
