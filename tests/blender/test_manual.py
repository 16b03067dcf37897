"""What the manual says of scripts in Blender is so."""

import re
from pathlib import Path

import bpy

PAGE = (Path(__file__).parents[2] / "docs" / "manual" / "scripting.md").read_text()


def test_scripts_run(addon, measured_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nickel.binary").symlink_to(measured_file)
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    names = {}
    run = [block for block in blocks if "bpy" in block]
    assert len(run) == 2
    for block in run:
        exec(compile(block, "scripting.md", "exec"), names)
    assert names["material"]["lobefit_kind"] == "live"
    assert bpy.context.object.active_material["lobefit_kind"] == "live"


def test_operators_are_those_of_the_extension(addon):
    ours = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("LOBEFIT_OT_")]
    public = {cls.bl_idname for cls in ours if "INTERNAL" not in getattr(cls, "bl_options", ())}
    table = PAGE.partition("| operator |")[2].partition("\n\n")[0]
    told = set(re.findall(r"`(lobefit\.\w+)`", table))
    assert told == public
    for name, options in re.findall(r"`(lobefit\.\w+)` \|([^|]*)\|", table):
        properties = getattr(bpy.ops.lobefit, name.split(".")[1]).get_rna_type().properties
        for option in re.findall(r"`(\w+)`", options):
            assert option in properties, (name, option)
