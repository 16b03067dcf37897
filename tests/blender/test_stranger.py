"""A file or a record of a stranger is data: nothing in it is executed, and odd ones are refused."""

import json

import bpy
import pytest
from test_extension import draw_panel

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


def complaint(operator, **options) -> str:
    """What an operator says instead of doing its work."""
    with pytest.raises(RuntimeError) as refused:
        assert operator(**options) != {"FINISHED"}
        raise RuntimeError("cancelled")
    assert "Traceback" not in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize("fault", [*ODD, *CHANGES])
def test_odd_records_are_refused(addon, material, fault, tmp_path):
    record = json.loads(material["lobefit_record"])
    odd = ODD.get(fault) or json.dumps(record | CHANGES[fault])
    material["lobefit_record"] = odd
    material["lobefit_before"] = "rm"
    material["lobefit_kind"] = fault
    with bpy.context.temp_override(material=material):
        if fault == "odd keys":
            # What a later version may add is no fault, and is not looked at.
            assert draw_panel(material=material).operators == ["fit", "preview"]
            assert bpy.ops.lobefit.preview() == {"FINISHED"}
        else:
            assert draw_panel(material=material).operators == ["import_measured", "make_classic"]
            assert not bpy.ops.lobefit.preview.poll() and not bpy.ops.lobefit.fit.poll()
    assert bpy.ops.lobefit.restore_scene() != {"PASS_THROUGH"}
