"""A layout that draws nothing: it records what is asked of it and refuses what Blender would."""

from types import SimpleNamespace
from typing import Any

import bpy

_LAYOUT = bpy.types.UILayout.bl_rna
_NESTED = {"row", "column", "column_flow", "grid_flow", "box", "split", "menu_pie"}


class RecordingLayout:
    """Stands in for a UILayout and all layouts inside of it.

    Every function, argument, icon, property, operator, option of an operator and menu has to exist.
    `texts` are what is written, `operators` the names of those of Lobefit, `properties` the names
    of what can be edited, `icons` the numbers of the pictures.
    """

    def __init__(self) -> None:
        fields = {name: [] for name in ("texts", "operators", "properties", "icons", "menus")}
        self.__dict__.update(fields)

    def __setattr__(self, name: str, value: Any) -> None:
        assert name in _LAYOUT.properties, f"a layout has no {name}"

    def __getattr__(self, name: str) -> Any:
        assert name in _LAYOUT.functions, f"a layout has no {name}"
        parameters = [p for p in _LAYOUT.functions[name].parameters if not p.is_output]

        def record(*values: Any, **named: Any) -> Any:
            given = dict(zip((p.identifier for p in parameters), values, strict=False)) | named
            known = {parameter.identifier: parameter for parameter in parameters}
            for key, value in given.items():
                assert key in known, f"{name} has no argument {key}"
                if known[key].type == "ENUM" and known[key].enum_items:
                    assert value in known[key].enum_items, f"{name} has no {key} {value}"
            if "text" in given:
                self.texts.append(given["text"])
            return self._made(name, given)

        return record

    def _made(self, name: str, given: dict[str, Any]) -> Any:
        if name in _NESTED:
            return self
        if name == "panel":
            assert given["idname"]
            return self, self
        if name == "prop":
            properties = given["data"].bl_rna.properties
            assert given["property"] in properties, f"{given['data']} has no {given['property']}"
            self.properties.append(given["property"])
        elif name == "menu":
            assert hasattr(bpy.types, given["menu"]), f"there is no {given['menu']}"
            self.menus.append(given["menu"])
        elif name == "operator":
            return self._operator(given["operator"])
        elif name == "operator_menu_enum":
            options = self._operator(given["operator"])
            assert options.items(given["property"])
            return options
        elif name == "template_icon":
            # Without a window there are no icons, and their number is 0.
            assert given["icon_value"] >= 0 and given["scale"] > 0
            self.icons.append(given["icon_value"])
        elif name == "progress":
            assert 0 <= given["factor"] <= 1
        return None

    def _operator(self, idname: str) -> "_Options":
        area, name = idname.split(".")
        # Raises KeyError for an operator that does not exist.
        options = getattr(getattr(bpy.ops, area), name).get_rna_type()
        self.operators.append(name if area == "lobefit" else idname)
        return _Options(options)


class _Options:
    """The options of a button: each has to be one of the operator's, and a value it may have."""

    def __init__(self, rna: bpy.types.Struct) -> None:
        self.__dict__["_rna"] = rna

    def items(self, name: str) -> Any:
        """The values that an option may have."""
        return self._rna.properties[name].enum_items

    def __setattr__(self, name: str, value: Any) -> None:
        assert name in self._rna.properties, f"{self._rna.identifier} has no {name}"
        known = self._rna.properties[name]
        if known.type == "ENUM":
            assert value in known.enum_items, f"{self._rna.identifier}.{name} is never {value}"


def drawn(panel: type, **context: Any) -> RecordingLayout:
    """What a panel, header, menu or page of preferences draws with these members in the context."""

    class Drawn(SimpleNamespace):
        bl_rna, draw = panel.bl_rna, panel.draw

    layout = RecordingLayout()
    with bpy.context.temp_override(**context):
        Drawn(layout=layout).draw(bpy.context)
    return layout


def panels(space: str) -> list[type]:
    """Lobefit's panels in the editors of this type."""
    names = [name for name in dir(bpy.types) if name.startswith("LOBEFIT_PT_")]
    found = [getattr(bpy.types, name) for name in names]
    return [panel for panel in found if panel.bl_space_type == space]


def material_tab(**context: Any) -> RecordingLayout:
    """What Lobefit draws in the Material tab; it shows one of its panels."""
    with bpy.context.temp_override(**context):
        tab = [panel for panel in panels("PROPERTIES") if panel.bl_context == "material"]
        (shown,) = [panel for panel in tab if panel.poll(bpy.context)]
    return drawn(shown, **context)
