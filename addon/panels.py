"""The panels in Properties > Material and > Render, and progress in the status bar."""

from typing import Any, ClassVar

import bpy

from . import nodes
from .layouts import draw_paragraph, draw_problem, draw_progress
from .measured_panel import (
    TITLE,
    LOBEFIT_PT_measured_brdf,
    draw_closeness,
    draw_fitted,
    told_record,
)
from .operators.add_live import LOBEFIT_OT_add_live
from .operators.classic import (
    LOBEFIT_OT_make_classic,
    LOBEFIT_OT_take_lights,
    classic_nodes,
)
from .operators.import_measured import LOBEFIT_OT_import_measured
from .operators.run import current
from .operators.simplify import LOBEFIT_OT_restore_scene, LOBEFIT_OT_simplify_scene
from .properties import draw_simplify_options
from .records import BAKED, active_material, is_simplified, record_of, result_of
from .targets import shows_material


class LOBEFIT_PT_import_measured(bpy.types.Panel):
    """The way to a measured material, shown where there is none"""

    bl_label = TITLE
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return not LOBEFIT_PT_measured_brdf.poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        draw_problem(self.layout, context)
        if current():
            draw_progress(self.layout)
        else:
            _draw_hint(self.layout, context)
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
            _draw_result(self.layout, result, context)


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
        entries = record_of(node)
        if entries is not None:
            record = told_record(entries)
            draw_closeness(self.layout, context, record, nodes.material.shown_by(node, record))
            draw_fitted(self.layout, record)
        column = self.layout.column()
        column.operator(LOBEFIT_OT_import_measured.bl_idname, icon="IMPORT")
        column.operator(LOBEFIT_OT_add_live.bl_idname, icon="ADD")


def _draw_result(layout: Any, result: dict[str, Any], context: bpy.types.Context) -> None:
    frames = ", ".join(map(str, result["frames"]))
    sentence = (
        f"At most {result['error_added']:.2%} of error added to the picture "
        f"({result['tolerance']:.2%} allowed), on frames {frames}."
    )
    draw_paragraph(layout, sentence, "CHECKMARK", context)
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
        sentence = f"{item['material']}: left, {item['reason']}."
        draw_paragraph(layout, sentence, "INFO", context)


def _kind(way: dict[str, Any]) -> str:
    return f"{way['kind']} {way['count']}" if way["kind"] in BAKED else way["kind"]


def _draw_status(self: Any, context: bpy.types.Context) -> None:
    if current():
        row = self.layout.row()
        row.ui_units_x = 16
        draw_progress(row)


def _draw_hint(layout: Any, context: bpy.types.Context) -> None:
    is_none = active_material(context) is None
    what = "No material is selected." if is_none else "This material is not measured."
    draw_paragraph(layout, f"{what} Import a measurement to make one:", "INFO", context)
    layout.operator(LOBEFIT_OT_import_measured.bl_idname, icon="IMPORT")


def _draw_classic(layout: Any, material: bpy.types.Material | None) -> None:
    if classic_nodes(material):
        layout.operator(LOBEFIT_OT_take_lights.bl_idname, icon="LIGHT_SUN")
    else:
        layout.operator(LOBEFIT_OT_make_classic.bl_idname, icon="ADD")


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
