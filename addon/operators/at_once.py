"""How an operator does something to the active measured material without waiting for it."""

import bpy

from .. import native
from ..records import active_material
from .polls import poll_measured


class ActsAtOnce:
    """What such operators have in common; each says in `act` what it does."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_measured(cls, context)

    def act(self, material: bpy.types.Material) -> str:
        """Does it and says what is to be warned of, if anything is.

        Raises ValueError, InputError among them, where it cannot be done.
        """
        raise TypeError(f"{type(self).__name__} does not say what it does")

    @native.needed
    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            warning = self.act(active_material(context))
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if warning:
            self.report({"WARNING"}, warning)
        return {"FINISHED"}
