"""The options of operators, as properties that they and the panels have in common.

What the user chose last lives with the operator (`operator_properties_last`) and a fit under way in
`operators.run`: nothing of it is saved in files, which hold only the record in each material.
"""

from collections.abc import Sequence
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from .preferred import take_preferred
from .records import BAKED

MODELS = (
    ("interpolated", "Interpolated", "A blend of the two others, and closer than both"),
    ("modified-phong", "Modified Phong", "A lobe around the mirror direction"),
    ("modified-blinn-phong", "Modified Blinn-Phong", "A lobe around the half vector"),
)
NORMS = (
    ("cosine-l1", "As Seen", "Weighted with the cosine of the light, as a picture shows it"),
    ("l1", "L1", "The plain sum of differences, as in the paper"),
    ("l2", "L2", "Squared differences: the highlight's peak counts most"),
    ("log-l2", "Logarithmic", "Squared differences of logarithms: dark parts count as much"),
)


KINDS = (
    ("measured", "Measured", "The measurement itself by a few closures: the closest picture"),
    ("lobe", "Lobe", "The fitted lobe by a few closures: the model, faithfully"),
    ("live", "Live", "The fitted lobe with every parameter a socket, to edit and animate"),
    ("principled", "Principled", "The nearest Principled BSDF, as every other program shows it"),
    ("auto", "Auto", "The cheapest of these that is within the tolerance"),
)


class _ClosureOptions:
    """The closures to find."""

    count: IntProperty(
        name="Closures",
        default=2,
        min=0,
        max=3,
        description="Specular closures of the kinds Measured and Lobe, besides a diffuse one",
    )
    cap_albedo: BoolProperty(
        name="Cap Albedo",
        default=False,
        description="Let no view angle reflect more light than arrives, as some measurements do",
    )
    threads: IntProperty(
        name="Threads",
        default=0,
        min=0,
        max=1024,
        description="Processors to use; 0 for all. Until it is chosen, that of the preferences",
    )


class _ModelOptions:
    """What to fit."""

    model: EnumProperty(
        name="Model", items=MODELS, default="interpolated", description="The lobe to fit"
    )
    fresnel: BoolProperty(
        name="Fresnel", default=True, description="Let the lobe grow toward grazing angles"
    )
    norm: EnumProperty(
        name="Match",
        items=NORMS,
        default="cosine-l1",
        description=(
            "What the fit makes small. As Seen by default, because the material is made to be "
            "looked at"
        ),
    )


class KindOptions(_ClosureOptions):
    """What to make of a record; mixed into operators."""

    kind: EnumProperty(
        name="Kind",
        items=KINDS,
        default="measured",
        description="What Cycles renders. Until it is chosen, the kind of the preferences",
    )
    tolerance: FloatProperty(
        name="Tolerance",
        default=5.0,
        min=0.0,
        max=100.0,
        subtype="PERCENTAGE",
        description="How much of the reflected light the kind Auto may have off",
    )

    def closures(self) -> list[Any]:
        """The closures to find for the kind, as `lobefit.start_fit` takes them."""
        from lobefit import closures_for

        return closures_for(self.kind, self.count, self.tolerance / 100, self.cap_albedo)

    def material_options(self) -> dict[str, Any]:
        """The options as `build_material` takes them."""
        count = self.count if self.kind in BAKED else None
        return {"kind": self.kind, "count": count, "tolerance": self.tolerance / 100}


class FitOptions(KindOptions, _ModelOptions):
    """How to fit and what to make of it; mixed into operators."""

    def fit_options(self) -> dict[str, Any]:
        """The options as `lobefit.start_fit` takes them."""
        take_preferred(self)
        names = ("model", "fresnel", "norm", "threads")
        return {"closures": self.closures()} | {name: getattr(self, name) for name in names}


def last_options(context: bpy.types.Context, operator: Any) -> Any:
    """The options that an operator was run with last, for a panel to draw."""
    options = context.window_manager.operator_properties_last(operator.bl_idname)
    take_preferred(options)
    return options


def draw_kind_options(layout: Any, options: Any) -> None:
    """Draws what to make of a record; `options` is an operator or its last properties."""
    layout.prop(options, "kind")
    if options.kind in BAKED:
        layout.prop(options, "count")
    if options.kind == "auto":
        layout.prop(options, "tolerance")
    if options.kind in (*BAKED, "auto"):
        layout.prop(options, "cap_albedo")


def draw_model_options(layout: Any, options: Any) -> None:
    """Draws how to fit; `options` is an operator or its last properties."""
    for name in ("model", "fresnel", "norm", "threads"):
        layout.prop(options, name)


def draw_fit_options(layout: Any, options: Any) -> None:
    """Draws all options of a fit; `options` is an operator or its last properties."""
    draw_kind_options(layout, options)
    draw_model_options(layout, options)


class LibraryOptions(_ClosureOptions, _ModelOptions):
    """How to fit the files of a library; mixed into an operator."""

    # `auto` judges by a tolerance, and a record does not tell whether it was made for the same.
    kind: EnumProperty(
        name="Kind",
        items=[kind for kind in KINDS if kind[0] != "auto"],
        default="measured",
        description="What Cycles renders",
    )
    jobs: IntProperty(
        name="Jobs",
        default=2,
        min=1,
        max=1024,
        description="Files at once, each with its share of the processors",
    )

    def command(self, sources: Sequence[str], library: str) -> list[str]:
        """The words of the command line that makes the library."""
        take_preferred(self)
        words = ["library", *sources, "-o", library, "--json", "--kind", self.kind]
        words += ["--closures", str(self.count), "--jobs", str(self.jobs)]
        words += ["--cap-albedo"] if self.cap_albedo else []
        # Options of a fit are refused where all files are records.
        for name in ("model", "norm"):
            if self.properties.is_property_set(name):
                words += [f"--{name}", getattr(self, name)]
        words += [] if self.fresnel else ["--no-fresnel"]
        return [*words, "--threads", str(self.threads)]


def draw_library_options(layout: Any, options: Any) -> None:
    """Draws the options; `options` is an operator or its last properties."""
    draw_fit_options(layout, options)
    layout.prop(options, "jobs")


class SimplifyOptions:
    """How to simplify a scene; mixed into an operator."""

    tolerance: FloatProperty(
        name="Tolerance",
        subtype="PERCENTAGE",
        default=1.0,
        min=0.0,
        max=100.0,
        precision=2,
        description=(
            "How much of the picture's light may change, against the nearest kinds, on any frame "
            "looked at"
        ),
    )
    frames: IntProperty(
        name="Frames",
        default=8,
        min=1,
        max=10000,
        description="How many frames of the scene's range to look at, evenly spread",
    )
    diffuse_bounces: BoolProperty(
        name="Diffuse Bounces",
        default=False,
        description="Show only a diffuse closure to light that bounced off a diffuse surface",
    )
    timed: BoolProperty(
        name="Time It",
        default=False,
        description="Render the current frame before and after, small and with few samples",
    )


def draw_simplify_options(layout: Any, options: Any) -> None:
    """Draws the options; `options` is an operator or its last properties."""
    for name in SimplifyOptions.__annotations__:
        layout.prop(options, name)
