"""`blender --command lobefit ARGS`: Lobefit's command line in a Blender without a window."""

import sys

import bpy

from . import native

_commands: list[object] = []


def register() -> None:
    _commands.append(bpy.utils.register_cli_command("lobefit", _run))


def unregister() -> None:
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())


def _run(arguments: list[str]) -> int:
    problem = native.problem()
    if problem:
        print(f"lobefit: {problem}", file=sys.stderr)
        return 2
    from lobefit.command_line import main

    return main(arguments)
