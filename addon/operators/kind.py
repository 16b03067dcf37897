"""Changes the kind of measured materials, one or many at once, without fitting them anew."""

from typing import TYPE_CHECKING, Any, ClassVar

import bpy
from bpy.props import EnumProperty

from .. import native, nodes
from ..locks import problem_of
from ..preferred import take_preferred
from ..properties import KINDS, KindOptions, draw_kind_options
from ..records import KEY, active_material, located, record_of
from .polls import poll_changeable
from .run import RunsWork

if TYPE_CHECKING:  # It is loaded when it is used: Blender starts as soon as before.
    from ..jobs import Batch

_SCOPES = (
    ("ACTIVE", "Active Material", "The material of the panel"),
    ("SELECTED", "Selected Objects", "All measured materials of the selected objects"),
)


class LOBEFIT_OT_set_kind(KindOptions, RunsWork, bpy.types.Operator):
    """Show measured materials in another way, from the fits that they carry"""

    bl_idname = "lobefit.set_kind"
    bl_label = "Set Kind of Measured Materials"
    bl_options: ClassVar = {"REGISTER"}

    scope: EnumProperty(
        name="Materials", items=_SCOPES, default="ACTIVE", description="Which materials to change"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = _measured(_materials(context, "ACTIVE") + _materials(context, "SELECTED"))
        if not found:
            cls.poll_message_set("Neither the active material nor a selected object is measured")
            return False
        return poll_changeable(cls, found) and super().poll(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context)

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        import lobefit

        from ..jobs import Batch

        take_preferred(self)
        self._ready: dict[int, Any] = {}
        self._wanting: list[int] = []
        self._problems: list[str] = []
        wanting = []
        found = _measured(_materials(context, self.scope))
        for material in found:
            reason = problem_of(material)
            if reason:
                self._problems.append(f"{material.name_full}: left as it is, {reason}")
                continue
            try:
                record = located(lobefit.Record.from_json(material[KEY], material.name))
            except lobefit.InputError as error:
                self._problems.append(str(error))
                continue
            if all(closures.is_in(record) for closures in self.closures()):
                self._ready[material.session_uid] = record
            else:
                wanting.append(record)
                self._wanting.append(material.session_uid)
        if not found:
            return self.refuse("Expected a measured material, found none.")
        if not wanting:
            return self.conclude(context, None)
        options = {"closures": self.closures(), "threads": self.threads}
        return self.start(context, Batch(wanting, options))

    def conclude(self, context: bpy.types.Context, work: "Batch | None") -> set[str]:
        for uid, outcome in zip(self._wanting, work.outcomes if work else (), strict=True):
            if outcome.record:
                self._ready[uid] = outcome.record
            else:
                self._problems.append(outcome.problem)
        changed = [m for m in bpy.data.materials if m.session_uid in self._ready]
        for material in changed:
            record = self._ready[material.session_uid]
            if nodes.parameters.is_edited(
                material, record_of(material), nodes.material.shown_by(material, record).kind
            ):
                self._problems.append(f"{material.name}: what was edited in it was replaced")
            nodes.material.fill_material(material, record, **self.material_options())
        for problem in self._problems:
            self.report({"WARNING" if changed else "ERROR"}, problem)
        if not changed:
            return {"CANCELLED"}
        kind = {key: label for key, label, _ in KINDS}[self.kind]
        many = len(changed) if len(changed) > 1 else changed[0].name
        self.report({"INFO"}, f"{kind}: {many} material{'s' if len(changed) > 1 else ''} changed")
        bpy.ops.ed.undo_push(message=self.bl_label)
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        draw_kind_options(self.layout, self)
        self.layout.prop(self, "scope")


def _materials(context: bpy.types.Context, scope: str) -> list[bpy.types.Material]:
    """Each material once, in the order of objects and slots."""
    if scope == "ACTIVE":
        found = [active_material(context)]
    else:
        found = [slot.material for item in context.selected_objects for slot in item.material_slots]
    return [material for material in dict.fromkeys(found) if material is not None]


def _measured(materials: list[bpy.types.Material]) -> list[bpy.types.Material]:
    return [material for material in materials if record_of(material) is not None]
