"""Which closures a scene needs: the cheapest kinds that change the picture by no more than asked.

What a kind adds is its distance from the nearest one (ways.py) at the angles the material is seen
at, times the light that the material sends to the camera: a share of the picture times an albedo.
The sum over all materials is, at worst, the part of the picture's light that is changed, if light
comes from everywhere alike.

Bounced light meets a material at every angle and is mixed before it is seen. So no kind is taken
that changes more than `BOUNCE_TOLERANCE` of the light over all angles, whether it is seen or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .scene_view import DEGREES, View
from .ways import Way

# The part of the reflected light that may change where only bounced light shows it.
BOUNCE_TOLERANCE = 0.1
# What surfaces that are not measured reflect: a photographer's grey. The darker they are taken to
# be, the more the errors of the measured ones count.
OTHER_ALBEDO = 0.18


@dataclass(frozen=True)
class Subject:
    """A material to choose for: what it shows and what it could."""

    material: bpy.types.Material
    record: Any
    now: Way
    ways: tuple[Way, ...]
    albedo: NDArray[np.float64]


@dataclass(frozen=True)
class Decision:
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


def choose_ways(
    subjects: Sequence[Subject], views: Sequence[View], tolerance: float
) -> list[Decision]:
    """The cheapest ways that add at most `tolerance` of the picture's light on every frame.

    Every material begins with what is nearest to its measurement; then the step is taken that saves
    most for what it adds, for as long as there is one within the tolerance.
    """
    sights = [_Sight(subject, views) for subject in subjects]
    light = _light(subjects, views)
    candidates = [_sound_ways(subject) for subject in subjects]
    added = [
        np.array([sight.part(way.added, light) for way in ways])
        for sight, ways in zip(sights, candidates, strict=True)
    ]
    costs = [np.array([way.cost for way in ways]) for ways in candidates]
    picked = _greedy(added, costs, [sight.share for sight in sights], tolerance)
    return [
        sight.decision(ways[index], light)
        for sight, ways, index in zip(sights, candidates, picked, strict=True)
    ]


class _Sight:
    """How a material is seen: its rays (frames, degrees) and their shares of the pictures."""

    def __init__(self, subject: Subject, views: Sequence[View]) -> None:
        self._subject = subject
        uid = subject.material.session_uid
        self._rays = np.array([view.angles.get(uid, np.zeros(DEGREES)) for view in views])
        self.share = self._rays.sum(1) / np.array([max(1, view.rays) for view in views])

    def part(self, off: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of each frame's light what is off in the material, by parts `off` at each angle."""
        return self._rays @ (self._subject.albedo * off) / np.maximum(light, 1e-12)

    def decision(self, way: Way, light: NDArray[np.float64]) -> Decision:
        return Decision(
            subject=self._subject,
            way=way,
            share=self.share,
            added=self.part(way.added, light),
            error=self.part(way.by_angle, light),
            error_before=self.part(self._subject.now.by_angle, light),
            seen=self._rays.sum(0),
        )


def _light(subjects: Sequence[Subject], views: Sequence[View]) -> NDArray[np.float64]:
    """The light of all surfaces in each frame, in rays that meet white."""
    albedos = {subject.material.session_uid: subject.albedo for subject in subjects}
    grey = np.full(DEGREES, OTHER_ALBEDO)
    return np.array(
        [
            view.other * OTHER_ALBEDO
            + sum(rays @ albedos.get(uid, grey) for uid, rays in view.angles.items())
            for view in views
        ]
    )


def _sound_ways(subject: Subject) -> list[Way]:
    """The ways that will do for bounced light too; the nearest one always does."""
    # Light from all around, as surfaces that stand in every direction reflect it.
    light = subject.albedo * np.sin(2 * np.radians(np.arange(DEGREES) + 0.5))
    return [way for way in subject.ways if way.added @ light <= BOUNCE_TOLERANCE * light.sum()]


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
