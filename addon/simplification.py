"""Simplifies the materials of a scene, puts them back, and tells what was done.

The result is one dictionary of plain values, kept as JSON with the scene: shares and errors are
parts of the picture (1 is all of it), costs are in specular closures. `error_added` is against the
nearest kinds there are, `error` and `error_before` are against the measurements, all of them in the
worst frame.
"""

import json
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .nodes.material import BAKED
from .records import BOUNCES_KEY, KEY
from .scene import render_seconds
from .scene_budget import (
    BOUNCE_TOLERANCE,
    Choice,
    Subject,
    Way,
    choose_ways,
    is_as_built,
    is_simplified,
    problem_of,
    restore,
    show,
    subject_of,
    ways_of,
)
from .scene_view import lights, shown_only_in_renders
from .survey import Survey

RESULT_KEY = "lobefit_simplified"


def simplify(
    context: bpy.types.Context,
    survey: Survey,
    tolerance: float,
    diffuse_bounces: bool = False,
    timed: bool = False,
) -> dict[str, Any]:
    """Changes the materials of the current scene to what it needs, and returns the result.

    `tolerance` is the part of the picture's light that may be changed. With `diffuse_bounces`
    materials get a diffuse closure for rays that left a diffuse surface; with `timed` the current
    frame is rendered before and after.
    """
    scene = context.scene
    timed = timed and scene.render.engine == "CYCLES"
    subjects, skipped = _subjects(context, survey)
    choices = choose_ways(subjects, survey.views, tolerance) if subjects else []
    before = render_seconds(scene) if timed else None
    materials = {material.session_uid: material for material in bpy.data.materials}
    changed = [
        _change(materials[choice.subject.uid], choice, diffuse_bounces) for choice in choices
    ]
    after = render_seconds(scene) if timed else None
    result = {
        "scene": scene.name,
        "tolerance": tolerance,
        "bounce_tolerance": BOUNCE_TOLERANCE,
        "frames": [view.frame for view in survey.views],
        "rays": max(view.rays for view in survey.views),
        "seconds": {"before": before, "after": after},
        **lights(context),
        **_sums(choices),
        "materials": [
            _row(choice, new) | {"diffuse_bounces": _has_bounces(materials[choice.subject.uid])}
            for choice, new in zip(choices, changed, strict=True)
        ],
        "skipped": [{"material": name, "reason": reason} for name, reason in skipped],
    }
    if choices:
        scene[RESULT_KEY] = json.dumps(result)
    return result


def restore_all(context: bpy.types.Context) -> dict[str, Any]:
    """Puts back what every simplified material of the file showed before."""
    import lobefit

    restored, skipped = [], []
    for material in filter(is_simplified, bpy.data.materials):
        reason = problem_of(material)
        if not reason:
            try:
                restore(material, lobefit.Record.from_json(material[KEY], material.name))
                restored.append(material.name)
                continue
            except (ValueError, TypeError):
                reason = "its record does not hold what it showed"
        skipped.append({"material": material.name, "reason": reason})
    if RESULT_KEY in context.scene:
        del context.scene[RESULT_KEY]
    return {"restored": restored, "skipped": skipped}


def result_of(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """The last result for a scene, or None if there is none to be read."""
    try:
        return json.loads(scene[RESULT_KEY])
    except (KeyError, TypeError, ValueError):
        return None


def _subjects(
    context: bpy.types.Context, survey: Survey
) -> tuple[list[Subject], list[tuple[str, str]]]:
    """The materials to choose for, and the others of the scene with the reason why not."""
    present, hidden = survey.present(), shown_only_in_renders(context)
    subjects, skipped = [], []
    # Many materials may have one record.
    ways: dict[str, tuple[Way, ...]] = {}
    for material in list(bpy.data.materials):
        uid = material.session_uid
        if KEY not in material or uid not in present | set(hidden):
            continue
        reason = survey.skipped.get(uid, "")
        if uid in hidden:
            reason = f"the viewport hides {hidden[uid]}, which renders show"
        elif not reason:
            record = survey.records.get(uid)
            found = "it is new"
            if record is not None:
                text = record.to_json()
                ways[text] = ways.get(text) or ways_of(record)
                found = subject_of(material, record, ways[text])
            if isinstance(found, str):
                reason = found
            elif not is_as_built(material, record, found.now, _has_bounces(material)):
                reason = "its nodes were changed by hand"
            else:
                subjects.append(found)
        if reason:
            skipped.append((material.name, reason))
    return subjects, skipped


def _has_bounces(material: bpy.types.Material) -> bool:
    return bool(material.get(BOUNCES_KEY, False))


def _change(material: bpy.types.Material, choice: Choice, diffuse_bounces: bool) -> bool:
    """Shows the material as chosen; says whether that is another way than before."""
    way, now, record = choice.way, choice.subject.now, choice.subject.record
    bounces = diffuse_bounces and way.kind != "principled"
    same = (way.kind, way.count) == (now.kind, now.count) and bounces == _has_bounces(material)
    if same:
        # Closures that were found on the way are kept for the next time.
        material[KEY] = record.to_json()
    else:
        show(material, record, now, way, bounces)
    return not same


def _sums(choices: list[Choice]) -> dict[str, Any]:
    """Errors of the worst frame, and the closures drawn in a pixel of the picture on average."""

    def worst(errors: list[NDArray[np.float64]]) -> float:
        return float(np.sum(errors, axis=0).max()) if errors else 0.0

    shares = [float(choice.share.mean()) for choice in choices]
    before = [choice.subject.now.cost for choice in choices]
    after = [choice.way.cost for choice in choices]
    return {
        "error_added": worst([choice.added for choice in choices]),
        "error": worst([choice.error for choice in choices]),
        "error_before": worst([choice.error_before for choice in choices]),
        "closures": {
            "before": float(np.dot(shares, before)),
            "after": float(np.dot(shares, after)),
        },
    }


def _row(choice: Choice, changed: bool) -> dict[str, Any]:
    now, way = choice.subject.now, choice.way
    return {
        "material": choice.subject.name,
        "before": _told(now),
        "after": _told(way),
        "changed": changed,
        "share": float(choice.share.mean()),
        "angles": _angles(choice),
        "error_added": float(choice.added.max()),
        "error": float(choice.error.max()),
        "error_before": float(choice.error_before.max()),
        "left_out": left_out(choice.subject, way),
        "closures_saved": now.cost - way.cost,
    }


def _told(way: Way) -> dict[str, Any]:
    return {"kind": way.kind, "count": way.count, "cost": way.cost}


def _angles(choice: Choice) -> list[float] | None:
    """Between which view angles nine tenths of the rays are that meet the material."""
    total = choice.seen.sum()
    if total == 0:
        return None
    share = np.cumsum(choice.seen) / total
    return [float(np.searchsorted(share, part)) for part in (0.05, 0.95)]


def left_out(subject: Subject, way: Way) -> str:
    """What the material does without, compared with what it showed."""
    now = subject.now
    if (way.kind, way.count) == (now.kind, now.count):
        return "nothing"
    if way.kind == "principled":
        return "all but a Principled BSDF"
    if now.kind in BAKED:
        lobes = now.count - way.count
        return f"{lobes} of {now.count} lobes" if lobes > 0 else "nothing"
    if now.kind == "live" and way.kind in BAKED:
        most = max(other.count for other in subject.ways if other.kind == way.kind)
        dropped = f", {most - way.count} of {most} lobes" if way.count < most else ""
        return f"live sockets{dropped}"
    return "nothing"
