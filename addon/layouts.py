"""Parts that several panels draw."""

import textwrap
from typing import Any

import bpy

from . import native
from .operators.fit import LOBEFIT_OT_cancel_fit
from .operators.run import current


def draw_problem(layout: Any, context: bpy.types.Context) -> None:
    """What keeps the compiled module from being used, if anything does."""
    if native.problem():
        draw_paragraph(layout, native.problem(), "ERROR", context)


def draw_progress(layout: Any) -> None:
    """A bar with what is being fitted, and the way to end it."""
    run = current()
    row = layout.row(align=True)
    row.progress(factor=run.progress, text=run.text)
    row.operator(LOBEFIT_OT_cancel_fit.bl_idname, text="", icon="X")


def draw_paragraph(layout: Any, text: str, icon: str, context: bpy.types.Context) -> None:
    """Text in as many lines as the region wants, beside an icon."""
    column = layout.column(align=True)
    for index, line in enumerate(textwrap.wrap(text, _characters(context))):
        column.label(text=line, icon="BLANK1" if index else icon)


def _characters(context: bpy.types.Context) -> int:
    """How many characters fit beside an icon into a line of the region."""
    scale = context.preferences.system.ui_scale
    return max(20, int(context.region.width / (6.2 * scale)) - 6) if context.region else 60
