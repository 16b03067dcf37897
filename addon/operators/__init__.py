"""What a user can do; nothing here changes data-blocks before its last step."""

import bpy

from . import library, preview
from .fit import LOBEFIT_OT_cancel_fit, LOBEFIT_OT_fit
from .import_measured import LOBEFIT_FH_measured, LOBEFIT_OT_import_measured, draw_menu
from .library import LOBEFIT_OT_add_asset_library, LOBEFIT_OT_make_library
from .run import current
from .simplify import LOBEFIT_OT_restore_scene, LOBEFIT_OT_simplify_scene

_CLASSES = (
    LOBEFIT_OT_import_measured,
    LOBEFIT_FH_measured,
    LOBEFIT_OT_fit,
    LOBEFIT_OT_cancel_fit,
    LOBEFIT_OT_simplify_scene,
    LOBEFIT_OT_restore_scene,
    LOBEFIT_OT_make_library,
    LOBEFIT_OT_add_asset_library,
)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    preview.register()
    bpy.types.TOPBAR_MT_file_import.append(draw_menu)
    bpy.types.TOPBAR_MT_file_import.append(library.draw_import_menu)
    bpy.types.ASSETBROWSER_MT_asset.append(library.draw_asset_menu)


def unregister() -> None:
    # Blender does not call an operator's `cancel` when its class goes.
    if current():
        current().end()
    bpy.types.ASSETBROWSER_MT_asset.remove(library.draw_asset_menu)
    bpy.types.TOPBAR_MT_file_import.remove(library.draw_import_menu)
    bpy.types.TOPBAR_MT_file_import.remove(draw_menu)
    preview.unregister()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
