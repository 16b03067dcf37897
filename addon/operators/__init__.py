"""What a user can do; nothing here changes data-blocks before its last step."""

import bpy

from .. import pictures
from . import add_live, export, library, normals
from .add_live import LOBEFIT_OT_add_live
from .classic import LOBEFIT_OT_make_classic, LOBEFIT_OT_take_lights
from .export import LOBEFIT_OT_export_measured
from .fit import LOBEFIT_OT_cancel_fit, LOBEFIT_OT_fit
from .import_measured import LOBEFIT_FH_measured, LOBEFIT_OT_import_measured, draw_menu
from .kind import LOBEFIT_OT_set_kind
from .library import LOBEFIT_OT_add_asset_library, LOBEFIT_OT_make_library
from .manual import LOBEFIT_OT_open_manual
from .normals import LOBEFIT_OT_find_normals
from .parameters import LOBEFIT_OT_edit_parameters, LOBEFIT_OT_reset_parameters
from .preview import (
    LOBEFIT_OT_draw_chart,
    LOBEFIT_OT_open_picture,
    LOBEFIT_OT_preview,
    LOBEFIT_OT_render_preview,
)
from .run import current
from .simplify import LOBEFIT_OT_restore_scene, LOBEFIT_OT_simplify_scene
from .source import LOBEFIT_OT_relink
from .two_lights import LOBEFIT_OT_two_lights
from .update import LOBEFIT_OT_update_materials

_CLASSES = (
    LOBEFIT_OT_import_measured,
    LOBEFIT_FH_measured,
    LOBEFIT_OT_add_live,
    LOBEFIT_OT_fit,
    LOBEFIT_OT_cancel_fit,
    LOBEFIT_OT_set_kind,
    LOBEFIT_OT_edit_parameters,
    LOBEFIT_OT_reset_parameters,
    LOBEFIT_OT_relink,
    LOBEFIT_OT_update_materials,
    LOBEFIT_OT_preview,
    LOBEFIT_OT_render_preview,
    LOBEFIT_OT_draw_chart,
    LOBEFIT_OT_open_picture,
    LOBEFIT_OT_two_lights,
    LOBEFIT_OT_open_manual,
    LOBEFIT_OT_simplify_scene,
    LOBEFIT_OT_restore_scene,
    LOBEFIT_OT_make_library,
    LOBEFIT_OT_add_asset_library,
    LOBEFIT_OT_export_measured,
    LOBEFIT_OT_make_classic,
    LOBEFIT_OT_take_lights,
    LOBEFIT_OT_find_normals,
)

# What the operators add to menus of Blender's.
_ENTRIES = (
    ("TOPBAR_MT_file_import", draw_menu),
    ("TOPBAR_MT_file_import", library.draw_import_menu),
    ("TOPBAR_MT_file_export", export.draw_menu),
    ("NODE_MT_shader_node_add_all", add_live.draw_menu),
    ("ASSETBROWSER_MT_catalog", library.draw_catalog_menu),
    ("IMAGE_MT_image", normals.draw_menu),
)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    for menu, entry in _ENTRIES:
        getattr(bpy.types, menu).append(entry)


def unregister() -> None:
    # Blender does not call an operator's `cancel` when its class goes.
    if current():
        current().end()
    for menu, entry in _ENTRIES:
        getattr(bpy.types, menu).remove(entry)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    pictures.unregister()
