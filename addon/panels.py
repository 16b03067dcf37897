"""The panels in Properties > Material and > Render, and progress in the status bar."""

import textwrap
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import bpy

from . import native
from .nodes.material import BAKED, shown_by
from .operators.add_live import LOBEFIT_OT_add_live
from .operators.classic import (
    LOBEFIT_OT_make_classic,
    LOBEFIT_OT_take_lights,
    classic_nodes,
)
from .operators.fit import LOBEFIT_OT_cancel_fit, LOBEFIT_OT_fit
from .operators.import_measured import LOBEFIT_OT_import_measured
from .operators.preview import LOBEFIT_OT_preview, icons_of
from .operators.run import current
from .operators.simplify import LOBEFIT_OT_restore_scene, LOBEFIT_OT_simplify_scene
from .properties import KINDS, MODELS, draw_fit_options, draw_simplify_options
from .records import active_material, is_simplified, record_of, result_of
from .targets import shows_material

TITLE = "Measured BRDF"
# Up to which part of the reflected light that is off, what to call a fit.
_JUDGEMENTS = ((0.05, "Very close"), (0.15, "Close"), (0.3, "Recognisable"), (1e9, "Far off"))


class _MaterialPanel:
    bl_label = TITLE
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"


class LOBEFIT_PT_measured_brdf(_MaterialPanel, bpy.types.Panel):
    """Where a material comes from, how close it is, and how to fit it anew"""

    # Panels without a header stand above all others; this one brings its own.
    bl_options: ClassVar = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return record_of(active_material(context)) is not None

    def draw(self, context: bpy.types.Context) -> None:
        header, body = self.layout.panel(type(self).__name__)
        header.label(text=TITLE)
        if body is None:
            return
        material = active_material(context)
        record = record_of(material)
        draw_problem(body, context)
        if current():
            draw_progress(body)
        _draw_record(body, record, _characters(context))
        _draw_error(body, material, record, _characters(context))
        _draw_fit(body, context)
        _draw_preview(body, material)


class LOBEFIT_PT_import_measured(_MaterialPanel, bpy.types.Panel):
    """The way to a measured material, shown where there is none"""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return not LOBEFIT_PT_measured_brdf.poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        draw_problem(self.layout, context)
        if current():
            draw_progress(self.layout)
        else:
            _draw_hint(self.layout, active_material(context), _characters(context))
            _draw_classic(self.layout, active_material(context))


class LOBEFIT_PT_simplify_scene(bpy.types.Panel):
    """Leaves out of measured materials what the scene does not need, and shows the last result"""

    bl_label = "Simplify Measured Materials"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        draw_problem(self.layout, context)
        if current():
            draw_progress(self.layout)
            return
        idname = LOBEFIT_OT_simplify_scene.bl_idname
        column = self.layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        draw_simplify_options(column, context.window_manager.operator_properties_last(idname))
        row = self.layout.row()
        row.operator(idname, text="Simplify", icon="MATERIAL")
        if any(map(is_simplified, bpy.data.materials)):
            row.operator(LOBEFIT_OT_restore_scene.bl_idname, text="Restore", icon="LOOP_BACK")
        result = result_of(context.scene)
        if result is not None:
            _draw_result(self.layout, result, _characters(context))


class LOBEFIT_PT_shader_editor(bpy.types.Panel):
    """Measured groups in the nodes that the shader editor shows"""

    bl_label = TITLE
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Node"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return shows_material(context.space_data)

    def draw(self, context: bpy.types.Context) -> None:
        draw_problem(self.layout, context)
        if current():
            draw_progress(self.layout)
            return
        node = context.active_node
        record = record_of(node)
        if record is not None:
            _draw_record(self.layout, record, _characters(context))
            _draw_error(self.layout, node, record, _characters(context))
        column = self.layout.column()
        column.operator(LOBEFIT_OT_import_measured.bl_idname, icon="IMPORT")
        column.operator(LOBEFIT_OT_add_live.bl_idname, icon="ADD")


def _draw_result(layout: Any, result: dict[str, Any], characters: int) -> None:
    frames = ", ".join(map(str, result["frames"]))
    sentence = (
        f"At most {result['error_added']:.2%} of error added to the picture "
        f"({result['tolerance']:.2%} allowed), on frames {frames}."
    )
    _paragraph(layout, sentence, "CHECKMARK", characters)
    for row in result["materials"]:
        box = layout.box().column(align=True)
        box.label(text=f"{row['material']}: {_kind(row['before'])} > {_kind(row['after'])}")
        seen = (
            "not seen" if row["angles"] is None else "{:.0f} to {:.0f} deg".format(*row["angles"])
        )
        box.label(text=f"{row['share']:.1%} of the picture, {seen}")
        box.label(text=f"{row['error_added']:+.2%} error, without {row['left_out']}")
    seconds = result["seconds"]
    if seconds["after"] is not None:
        text = f"Rendered in {seconds['after']:.2f} s, before in {seconds['before']:.2f} s"
        layout.label(text=text, icon="TIME")
    for item in result["skipped"]:
        _paragraph(layout, f"{item['material']}: left, {item['reason']}.", "INFO", characters)


def _kind(way: dict[str, Any]) -> str:
    return f"{way['kind']} {way['count']}" if way["kind"] in BAKED else way["kind"]


def draw_problem(layout: Any, context: bpy.types.Context) -> None:
    """What keeps the compiled module from being used, if anything does."""
    if native.problem():
        _paragraph(layout, native.problem(), "ERROR", _characters(context))


def draw_progress(layout: Any) -> None:
    """A bar with what is being fitted, and the way to end it."""
    run = current()
    row = layout.row(align=True)
    row.progress(factor=run.progress, text=run.text)
    row.operator(LOBEFIT_OT_cancel_fit.bl_idname, text="", icon="X")


def _draw_status(self: Any, context: bpy.types.Context) -> None:
    if current():
        row = self.layout.row()
        row.ui_units_x = 16
        draw_progress(row)


def _draw_hint(layout: Any, material: bpy.types.Material | None, characters: int) -> None:
    what = "No material is selected." if material is None else "This material is not measured."
    _paragraph(layout, f"{what} Import a measurement to make one:", "INFO", characters)
    layout.operator(LOBEFIT_OT_import_measured.bl_idname, icon="IMPORT")


def _draw_classic(layout: Any, material: bpy.types.Material | None) -> None:
    if classic_nodes(material):
        layout.operator(LOBEFIT_OT_take_lights.bl_idname, icon="LIGHT_SUN")
    else:
        layout.operator(LOBEFIT_OT_make_classic.bl_idname, icon="ADD")


def _draw_record(layout: Any, record: dict[str, Any], characters: int) -> None:
    source, parameters = record["source"], record["parameters"]
    column = layout.column(align=True)
    for name, value in {
        "Source": Path(source["path"]).name if source["path"] else source["format"],
        "Model": {key: label for key, label, _ in MODELS}[record["model"]],
        "Diffuse": _numbers(parameters["diffuse"]),
        "Specular": _numbers(parameters["specular"]),
        "Exponent": _numbers(parameters["exponent"]),
        "Interpolation": _numbers(parameters["interpolation"]),
        "IOR": _numbers(parameters["ior"]) or "no Fresnel",
    }.items():
        if value:
            split = column.split(factor=0.35)
            split.label(text=name)
            split.label(text=value)
    for warning in record["warnings"]:
        _paragraph(layout, warning, "ERROR", characters)


def _draw_error(
    layout: Any, material: bpy.types.Material, record: dict[str, Any], characters: int
) -> None:
    whole = SimpleNamespace(**{"closures": [], **record})
    choice = shown_by(material, whole)
    kind = {key: label for key, label, _ in KINDS}[choice.kind]
    closures = f", {choice.count} specular closures" if choice.closures else ""
    error = choice.error(whole)
    judgement = next(text for limit, text in _JUDGEMENTS if error <= limit)
    sentence = f"{kind}{closures}. {judgement}: {error:.1%} of the reflected light is off."
    _paragraph(layout, sentence, "INFO", characters)


def _draw_fit(layout: Any, context: bpy.types.Context) -> None:
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    idname = LOBEFIT_OT_fit.bl_idname
    draw_fit_options(column, context.window_manager.operator_properties_last(idname))
    row = layout.row()
    row.operator(idname, text="Fit", icon="FILE_REFRESH")
    row.operator(LOBEFIT_OT_preview.bl_idname, text="Preview", icon="SHADING_RENDERED")


def _draw_preview(layout: Any, material: bpy.types.Material) -> None:
    row = layout.row()
    for title, icon in icons_of(material).items():
        column = row.column()
        column.template_icon(icon, scale=5)
        column.label(text=title)


def _numbers(values: Any) -> str:
    """One number or three as text; empty for None."""
    if values is None:
        return ""
    return "  ".join(f"{value:.3g}" for value in (values if isinstance(values, list) else [values]))


def _paragraph(layout: Any, text: str, icon: str, characters: int) -> None:
    column = layout.column(align=True)
    for index, line in enumerate(textwrap.wrap(text, characters)):
        column.label(text=line, icon="BLANK1" if index else icon)


def _characters(context: bpy.types.Context) -> int:
    """How many characters fit beside an icon into a line of the region."""
    scale = context.preferences.system.ui_scale
    return max(20, int(context.region.width / (6.2 * scale)) - 6) if context.region else 60


def register() -> None:
    bpy.utils.register_class(LOBEFIT_PT_measured_brdf)
    bpy.utils.register_class(LOBEFIT_PT_import_measured)
    bpy.utils.register_class(LOBEFIT_PT_simplify_scene)
    bpy.utils.register_class(LOBEFIT_PT_shader_editor)
    bpy.types.STATUSBAR_HT_header.append(_draw_status)


def unregister() -> None:
    bpy.types.STATUSBAR_HT_header.remove(_draw_status)
    bpy.utils.unregister_class(LOBEFIT_PT_shader_editor)
    bpy.utils.unregister_class(LOBEFIT_PT_simplify_scene)
    bpy.utils.unregister_class(LOBEFIT_PT_import_measured)
    bpy.utils.unregister_class(LOBEFIT_PT_measured_brdf)
