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

from .locks import problem_of
from .records import KEY, RESULT_KEY, embed, has_bounces, is_simplified
from .scene import render_seconds
from .scene_budget import BOUNCE_TOLERANCE, Decision, Subject, choose_ways
from .scene_view import lights, shown_only_in_renders
from .survey import Survey
from .swaps import is_as_built, is_named, restore, show
from .ways import Way, albedo_of, ways_of


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
    decisions = choose_ways(subjects, survey.views, tolerance)
    before = render_seconds(scene) if timed else None
    rows = [_row(decision) | _change(decision, diffuse_bounces) for decision in decisions]
    after = render_seconds(scene) if timed else None
    result = {
        "scene": scene.name,
        "tolerance": tolerance,
        "bounce_tolerance": BOUNCE_TOLERANCE,
        "frames": [view.frame for view in survey.views],
        "rays": max(view.rays for view in survey.views),
        "seconds": {"before": before, "after": after},
        **lights(context),
        **_sums(decisions),
        "materials": rows,
        "skipped": skipped,
    }
    if rows:
        scene[RESULT_KEY] = json.dumps(result)
    return result


def restore_all() -> dict[str, Any]:
    """Puts back what every simplified material of the file showed before."""
    restored, skipped = [], []
    for material in filter(is_simplified, bpy.data.materials):
        reason = problem_of(material) or _restored(material)
        if reason:
            skipped.append(_skipped(material, reason))
        else:
            restored.append(material.name)
    for scene in bpy.data.scenes:
        scene.pop(RESULT_KEY, None)
    return {"restored": restored, "skipped": skipped}


def _restored(material: bpy.types.Material) -> str:
    """Puts back what the material showed; returns the reason where that is not possible."""
    import lobefit

    try:
        restore(material, lobefit.Record.from_json(material[KEY], material.name))
    except (ValueError, TypeError, AttributeError):
        return "its record does not hold what it showed"
    return ""


def _subjects(
    context: bpy.types.Context, survey: Survey
) -> tuple[list[Subject], list[dict[str, str]]]:
    """The materials to choose for, and the others of the scene with the reason why not."""
    hidden = shown_only_in_renders(context)
    wanted = survey.present() | set(hidden)
    ways: dict[int, tuple[Way, ...]] = {}
    subjects, skipped = [], []
    for material in list(bpy.data.materials):
        uid = material.session_uid
        if KEY not in material or uid not in wanted:
            continue
        if uid in hidden:
            found = f"the viewport hides {hidden[uid]}, which renders show"
        elif uid in survey.records:
            found = _subject(material, survey.records[uid], ways)
        else:
            found = survey.skipped.get(uid, "it is new")
        if isinstance(found, Subject):
            subjects.append(found)
        else:
            skipped.append(_skipped(material, found))
    return subjects, skipped


def _subject(
    material: bpy.types.Material, record: Any, ways: dict[int, tuple[Way, ...]]
) -> Subject | str:
    """The material with the ways of its record, or why it has to be left as it is.

    `ways` keeps those of a record for the next material that has it.
    """
    if id(record) not in ways:
        ways[id(record)] = ways_of(record)
    known = ways[id(record)]
    named = [way for way in known if is_named(material, way)]
    if not named:
        return "what it shows is not in its record"
    # Of two entries with as many closures only one is what is shown.
    now = next((way for way in named if is_as_built(material, record, way)), None)
    if now is None:
        return "its nodes were changed by hand"
    return Subject(material, record, now, known, albedo_of(record))


def _skipped(material: bpy.types.Material, reason: str) -> dict[str, str]:
    return {"material": material.name, "reason": reason}


def _change(decision: Decision, diffuse_bounces: bool) -> dict[str, bool]:
    """Shows the material as chosen; tells whether that is another way than before."""
    way, subject = decision.way, decision.subject
    bounces = diffuse_bounces and way.kind != "principled"
    changed = way is not subject.now or bounces != has_bounces(subject.material)
    if changed:
        show(subject.material, subject.record, subject.now, way, bounces)
    else:
        # Closures that were found on the way are kept for the next time.
        embed(subject.material, subject.record)
    return {"changed": changed, "diffuse_bounces": bounces}


def _sums(decisions: list[Decision]) -> dict[str, Any]:
    """Errors of the worst frame, and the closures drawn in a pixel of the picture on average."""

    def worst(errors: list[NDArray[np.float64]]) -> float:
        return float(np.sum(errors, axis=0).max()) if errors else 0.0

    shares = [float(decision.share.mean()) for decision in decisions]
    before = [decision.subject.now.cost for decision in decisions]
    after = [decision.way.cost for decision in decisions]
    return {
        "error_added": worst([decision.added for decision in decisions]),
        "error": worst([decision.error for decision in decisions]),
        "error_before": worst([decision.error_before for decision in decisions]),
        "closures": {
            "before": float(np.dot(shares, before)),
            "after": float(np.dot(shares, after)),
        },
    }


def _row(decision: Decision) -> dict[str, Any]:
    now, way = decision.subject.now, decision.way
    return {
        "material": decision.subject.material.name,
        "before": _told(now),
        "after": _told(way),
        "share": float(decision.share.mean()),
        "angles": _angles(decision),
        "error_added": float(decision.added.max()),
        "error": float(decision.error.max()),
        "error_before": float(decision.error_before.max()),
        "left_out": left_out(decision.subject, way),
        "closures_saved": now.cost - way.cost,
    }


def _told(way: Way) -> dict[str, Any]:
    return {"kind": way.kind, "count": way.count, "cost": way.cost}


def _angles(decision: Decision) -> list[float] | None:
    """Between which view angles nine tenths of the rays are that meet the material."""
    total = decision.seen.sum()
    if total == 0:
        return None
    share = np.cumsum(decision.seen) / total
    return [float(np.searchsorted(share, part)) for part in (0.05, 0.95)]


def left_out(subject: Subject, way: Way) -> str:
    """What the material does without, compared with what it showed."""
    now = subject.now
    if way is now:
        return "nothing"
    if way.kind == "principled":
        return "all but a Principled BSDF"
    if now.kind == "live":
        most = max(other.count for other in subject.ways if other.kind == way.kind)
        dropped = f", {most - way.count} of {most} lobes" if way.count < most else ""
        return f"live sockets{dropped}"
    if way.closures is None or way.count >= now.count:
        return "nothing"
    return f"{now.count - way.count} of {now.count} lobes"
