"""The panel of a measured material: what it shows, how close that is, and what can be done."""

from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

import bpy

from . import native, nodes, pictures
from .layouts import draw_paragraph, draw_problem, draw_progress
from .locks import lock_of
from .operators.fit import LOBEFIT_OT_fit
from .operators.kind import LOBEFIT_OT_set_kind
from .operators.manual import LOBEFIT_OT_open_manual
from .operators.parameters import LOBEFIT_OT_edit_parameters, LOBEFIT_OT_reset_parameters
from .operators.preview import (
    CHARTS,
    SPHERES,
    LOBEFIT_OT_draw_chart,
    LOBEFIT_OT_open_picture,
    LOBEFIT_OT_preview,
    LOBEFIT_OT_render_preview,
)
from .operators.run import current
from .operators.source import LOBEFIT_OT_relink
from .operators.two_lights import LOBEFIT_OT_two_lights
from .operators.update import LOBEFIT_OT_update_materials
from .properties import KINDS, MODELS, draw_kind_options, draw_model_options, last_options
from .records import KIND_KEY, active_material, damage_of, entries_of, record_of, source_file

if TYPE_CHECKING:
    from .nodes.material import Choice

TITLE = "Measured BRDF"
# Up to which part of the reflected light that is off, what to call a fit.
_JUDGEMENTS = ((0.05, "Very close"), (0.15, "Close"), (0.3, "Recognisable"), (1e9, "Far off"))
_UNIT = 20  # pixels of an icon of scale 1, before the interface is scaled


class LOBEFIT_PT_measured_brdf(bpy.types.Panel):
    """Where a material comes from, how close it is, and how to change it"""

    bl_label = TITLE
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    # Panels without a header stand above all others; this one brings its own.
    bl_options: ClassVar = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return entries_of(active_material(context)) is not None

    def draw(self, context: bpy.types.Context) -> None:
        header, body = self.layout.panel(type(self).__name__)
        header.label(text=TITLE)
        if body is None:
            return
        material = active_material(context)
        draw_problem(body, context)
        if current():
            draw_progress(body)
        problem = _problem_of_record(material)
        if problem:
            draw_paragraph(body, problem, "ERROR", context)
            return
        record = told_record(record_of(material))
        choice = nodes.material.shown_by(material, record)
        _draw_origin(body, context, material)
        _draw_spheres(body, context, material)
        _draw_error(body, context, material, record, choice)
        _draw_kind(body, context)
        for title, draw in {
            "Fit": _draw_fit,
            "Parameters": _draw_parameters,
            "Charts": _draw_charts,
            "Source": _draw_source,
        }.items():
            header, section = body.panel(f"{type(self).__name__}_{title}", default_closed=True)
            header.label(text=title)
            if section is not None:
                draw(section, context, material, record)
        body.operator(LOBEFIT_OT_open_manual.bl_idname, icon="HELP")


def told_record(entries: dict[str, Any]) -> SimpleNamespace:
    """A record's entries as attributes, with those that older versions did not write."""
    return SimpleNamespace(**{"closures": [], "error_by_angle": None, **entries})


def draw_closeness(layout: Any, context: bpy.types.Context, record: Any, choice: "Choice") -> None:
    """How far what is shown is off, and what the fit warns of."""
    kind = {key: label for key, label, _ in KINDS}[choice.kind]
    plural = "" if choice.count == 1 else "s"
    closures = f", {choice.count} specular closure{plural}" if choice.closures else ""
    error, grazing = choice.error(record), choice.grazing_error(record)
    judgement = next(text for limit, text in _JUDGEMENTS if error <= limit)
    near = "" if grazing is None else f", seen at grazing angles {grazing:.1%}"
    sentence = f"{kind}{closures}. {judgement}: {choice.told_error(record)}{near}."
    draw_paragraph(layout, sentence, "INFO", context)
    for sentence in (_energy(choice.albedo(record)), *record.warnings):
        if sentence:
            draw_paragraph(layout, sentence, "ERROR", context)


def _problem_of_record(material: bpy.types.Material) -> str:
    """Why nothing can be told of the material; empty for a record that is understood."""
    if nodes.versions.is_newer(material):
        return "A later version of Lobefit made this material: it is left as it is."
    return damage_of(material) if not native.problem() else ""


def _draw_origin(layout: Any, context: bpy.types.Context, material: bpy.types.Material) -> None:
    """What keeps the material from being changed, and whether it is of an older version."""
    reason, linked = lock_of(material), material.library is not None
    if linked:
        sentence = f"Linked from {Path(material.library.filepath).name}: change it there."
        draw_paragraph(layout, sentence, "LINKED", context)
    elif reason:
        draw_paragraph(layout, f"It cannot be changed: {reason}.", "LINKED", context)
    if nodes.versions.is_outdated(material):
        where = "; update it there" if linked else ""
        sentence = f"Made by an older version of Lobefit{where}. It renders as it did."
        draw_paragraph(layout, sentence, "FILE_REFRESH", context)
        if not reason:
            layout.operator(LOBEFIT_OT_update_materials.bl_idname, text="Update")


def _draw_spheres(layout: Any, context: bpy.types.Context, material: bpy.types.Material) -> None:
    drawn = pictures.kept(material, SPHERES)
    if drawn is not None:
        row = layout.row()
        # Up to three side by side fill the panel.
        scale = min(12.0, _width(context) / _UNIT / len(drawn.pictures))
        for title in drawn.pictures:
            column = row.column(align=True)
            column.template_icon(pictures.icon_id(material, SPHERES, title), scale=scale)
            centred = column.row()
            centred.alignment = "CENTER"
            centred.label(text=title)
        _draw_age(layout, context, material, drawn)
    row = layout.row(align=True)
    row.operator(LOBEFIT_OT_preview.bl_idname, text="Preview", icon="SHADING_RENDERED")
    row.operator(LOBEFIT_OT_render_preview.bl_idname, text="Render", icon="RENDER_STILL")
    two_lights = LOBEFIT_OT_two_lights.bl_idname
    row.operator_menu_enum(two_lights, "subject", text="Scene", icon="SCENE_DATA")
    if drawn is not None:
        _draw_open(row, SPHERES)


def _draw_age(
    layout: Any, context: bpy.types.Context, material: bpy.types.Material, drawn: pictures.Drawn
) -> None:
    if drawn.stamp != pictures.stamp(material):
        draw_paragraph(layout, "Drawn before the last change.", "TIME", context)
    elif drawn.caption:
        draw_paragraph(layout, drawn.caption, "INFO", context)


def _draw_open(row: Any, picture: str) -> None:
    row.operator(LOBEFIT_OT_open_picture.bl_idname, text="", icon="WINDOW").picture = picture


def _draw_error(
    layout: Any,
    context: bpy.types.Context,
    material: bpy.types.Material,
    record: Any,
    choice: "Choice",
) -> None:
    draw_closeness(layout, context, record, choice)
    if nodes.parameters.is_edited(material, vars(record), choice.kind):
        sentence = "Its parameters were edited: this is told of the fit, Preview tells it anew."
        draw_paragraph(layout, sentence, "GREASEPENCIL", context)


def _energy(albedo: dict[str, list[Any]]) -> str:
    """Says where more light is reflected than arrives; empty where that is nowhere."""
    if native.problem():
        return ""
    from lobefit.albedo import excess

    return excess(albedo["view_angle"], albedo["measured"], albedo["shown"])


def _draw_kind(layout: Any, context: bpy.types.Context) -> None:
    options = last_options(context, LOBEFIT_OT_set_kind)
    column = _split_column(layout)
    draw_kind_options(column, options)
    row = layout.row(align=True)
    for text, scope, icon in (
        ("Change Kind", "ACTIVE", "MATERIAL"),
        ("Of Selected Objects", "SELECTED", "OUTLINER_OB_GROUP_INSTANCE"),
    ):
        row.operator(LOBEFIT_OT_set_kind.bl_idname, text=text, icon=icon).scope = scope


def _draw_fit(
    layout: Any, context: bpy.types.Context, material: bpy.types.Material, record: Any
) -> None:
    draw_model_options(_split_column(layout), last_options(context, LOBEFIT_OT_fit))
    chosen = last_options(context, LOBEFIT_OT_set_kind)
    fit = layout.operator(LOBEFIT_OT_fit.bl_idname, text="Fit Anew", icon="FILE_REFRESH")
    # The kind above is that of the fit as well.
    for name in ("kind", "count", "tolerance", "cap_albedo"):
        setattr(fit, name, getattr(chosen, name))


def _draw_parameters(
    layout: Any, context: bpy.types.Context, material: bpy.types.Material, record: Any
) -> None:
    kind = material.get(KIND_KEY, "live")
    found = nodes.parameters.parameter_nodes(material, kind)
    column = _split_column(layout)
    for node in found:
        for socket in node.inputs if kind != "principled" else _first(node):
            if socket.is_linked:
                column.label(text=f"{socket.name}: from another node", icon="NODE")
            elif not socket.hide_value:
                column.prop(socket, "default_value", text=socket.name)
    if not found:
        draw_paragraph(layout, "Its nodes are no longer those of the fit.", "INFO", context)
    if kind != "live":
        draw_fitted(layout, record)
    row = layout.row(align=True)
    if kind != "live":
        row.operator(LOBEFIT_OT_edit_parameters.bl_idname, icon="GREASEPENCIL")
    row.operator(LOBEFIT_OT_reset_parameters.bl_idname, icon="LOOP_BACK")


def _first(node: bpy.types.Node) -> list[bpy.types.NodeSocket]:
    """Those of the many inputs of a Principled BSDF that a record tells."""
    return [node.inputs[name] for name in nodes.principled.SOCKETS.values()]


def draw_fitted(layout: Any, record: Any) -> None:
    """The parameters of the fitted lobe, which kinds without it do not show."""
    parameters = record.parameters
    _draw_table(
        layout,
        {
            "Model": {key: label for key, label, _ in MODELS}[record.model],
            "Diffuse": _numbers(parameters["diffuse"]),
            "Specular": _numbers(parameters["specular"]),
            "Exponent": _numbers(parameters["exponent"]),
            "Interpolation": _numbers(parameters["interpolation"]),
            "IOR": _numbers(parameters["ior"]) or "no Fresnel",
        },
    )


def _draw_charts(
    layout: Any, context: bpy.types.Context, material: bpy.types.Material, record: Any
) -> None:
    options = last_options(context, LOBEFIT_OT_draw_chart)
    column = _split_column(layout)
    column.prop(options, "chart")
    if options.chart == "LOBE":
        column.prop(options, "incidence")
    row = layout.row(align=True)
    row.operator(LOBEFIT_OT_draw_chart.bl_idname, text="Draw", icon="GRAPH")
    drawn = pictures.kept(material, CHARTS)
    if drawn is not None:
        _draw_open(row, CHARTS)
        scale = min(30.0, _width(context) / _UNIT)
        for title in drawn.pictures:
            layout.label(text=title)
            layout.template_icon(pictures.icon_id(material, CHARTS, title), scale=scale)
        _draw_age(layout, context, material, drawn)


def _draw_source(
    layout: Any, context: bpy.types.Context, material: bpy.types.Material, record: Any
) -> None:
    source = record.source
    name = Path(source["path"]).name if source["path"] else source["format"]
    _draw_table(
        layout,
        {
            "File": name,
            "Format": source["format"],
            "SHA-256": (source["sha256"] or "")[:16],
            "Lobefit": vars(record).get("machine", {}).get("version", ""),
        },
    )
    if not source_file(source):
        draw_paragraph(layout, "The file is not where it was.", "ERROR", context)
        layout.operator(LOBEFIT_OT_relink.bl_idname, icon="VIEWZOOM")


def _draw_table(layout: Any, rows: dict[str, str]) -> None:
    column = layout.column(align=True)
    for name, value in rows.items():
        if value:
            split = column.split(factor=0.35)
            split.label(text=name)
            split.label(text=value)


def _numbers(values: Any) -> str:
    """One number or three as text; empty for None."""
    if values is None:
        return ""
    return "  ".join(f"{value:.3g}" for value in (values if isinstance(values, list) else [values]))


def _split_column(layout: Any) -> Any:
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    return column


def _width(context: bpy.types.Context) -> float:
    """The width of the region in pixels of an interface that is not scaled, less its borders."""
    return (
        context.region.width / context.preferences.system.ui_scale - 50 if context.region else 400
    )
