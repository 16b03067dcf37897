"""A file or a record of a stranger is data: nothing in it is executed, and odd ones are refused."""

import importlib
import json

import bpy
import lobefit
import pytest
from recording_layout import material_tab

DEEP = "[" * 100_000
ODD = {
    "number": 5,
    "empty": "",
    "no JSON": "import os",
    "list": "[1]",
    "empty object": "{}",
    "text of a number": "5",
    "deep": DEEP,
    "deep inside": '{"schema": 1, "models": ' + DEEP,
    "huge number": '{"schema": 1' + "0" * 5000 + "}",
    "huge text": '{"schema": "' + "x" * 10_000_000 + '"}',
    "NUL": '{"schema": "\\u0000"}',
}
CHANGES = {
    "odd keys": {"__class__": "os", "to_json": 1, "schema ": 2, "": None},
    "schema": {"schema": "1"},
    "source": {"source": None},
    "path": {"source": {"path": ["/etc/passwd"]}},
    "parameters": {"parameters": {"__import__": "os"}},
    "closures": {"closures": [{"target": "measured", "count": 2}]},
    "endless": {"max_angle": 1e999},
}


@pytest.fixture(scope="module")
def record(measured_file) -> dict:
    """The entries of a record without a fault."""
    return json.loads(lobefit.fit(measured_file).to_json())


@pytest.mark.parametrize("fault", [*ODD, *CHANGES])
def test_odd_records_are_refused(addon, record, fault):
    material = bpy.data.materials.new("odd")
    odd = ODD[fault] if fault in ODD else json.dumps(record | CHANGES[fault])
    material["lobefit_record"] = odd
    material["lobefit_kind"], material["lobefit_before"] = fault, "rm"
    layout = material_tab(material=material)
    with bpy.context.temp_override(material=material):
        polls = bpy.ops.lobefit.preview.poll(), bpy.ops.lobefit.fit.poll()
    if fault == "odd keys":
        # What a later version may add is no fault, and is not looked at.
        assert "fit" in layout.operators and polls == (True, True)
    elif str(odd).startswith("{") and DEEP not in odd and fault != "huge number":
        # Of what is a record by its form the panel says in a sentence what is wrong with it.
        assert layout.operators == [] and layout.texts[-1].endswith(".") and not any(polls)
    else:
        assert layout.operators == ["import_measured", "make_classic"] and not any(polls)
    simplification = importlib.import_module(f"{addon.__name__}.simplification")
    reasons = ["its record does not hold what it showed"]
    if material.node_tree is None:  # until Blender 4.5
        reasons.insert(0, "it has no nodes")
    for reason in reasons:
        (skipped,) = simplification.restore_all()["skipped"]
        assert skipped["reason"] == reason
        material.use_nodes = True
