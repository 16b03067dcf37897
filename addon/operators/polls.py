"""What operators ask before they can be used; each says why where a button is greyed out."""

from collections.abc import Callable, Sequence

import bpy

from ..locks import problem_of
from ..records import active_material, record_of


def poll_measured(cls: type, context: bpy.types.Context) -> bool:
    """Whether the active material has a record."""
    found = record_of(active_material(context)) is not None
    if not found:
        cls.poll_message_set("The active material was not made from a measurement")
    return found


def poll_changeable(
    cls: type,
    materials: Sequence[bpy.types.Material],
    reason_of: Callable[[bpy.types.Material], str] = problem_of,
) -> bool:
    """Whether one of these materials can be changed; says of the first why it cannot."""
    reasons = [reason_of(material) for material in materials]
    if all(reasons):
        cls.poll_message_set(f"{materials[0].name} cannot be changed: {reasons[0]}")
    return not all(reasons)
