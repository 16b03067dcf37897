"""What type checkers and readers are told of the package is what is there."""

import ast
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import lobefit
import pytest
from lobefit import _native

HERE = Path(lobefit.__file__).parent
STUB = ast.parse((HERE / "_native.pyi").read_text())
# Types that both sides name. A number may come from Python as something else than C++ takes, and of
# what is called `object` there the stub tells more.
NAMED = {"bool", "dict", "list", "str", "tuple", "Measurement"}


def public(owner: type | ModuleType) -> dict[str, Any]:
    """What a module or a class has of its own; the constructor where it can be called."""
    members = {name: value for name, value in vars(owner).items() if not name.startswith("_")}
    constructor = vars(owner).get("__init__")
    if (getattr(constructor, "__doc__", "") or "").startswith("__init__("):
        members["__init__"] = constructor
    return members


def declared(body: list[ast.stmt]) -> dict[str, Any]:
    """What a stub declares, by name."""
    named = {node.name: node for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    return named | {node.target.id: node for node in body if isinstance(node, ast.AnnAssign)}


def pairs(owner: Any, body: list[ast.stmt], prefix: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Name, value and declaration of all that has both, in a module and in its classes."""
    members, nodes = public(owner), declared(body)
    for name in members.keys() & nodes.keys():
        yield prefix + name, members[name], nodes[name]
        if isinstance(nodes[name], ast.ClassDef):
            yield from pairs(members[name], nodes[name].body, f"{name}.")


PAIRS = sorted(pairs(_native, STUB.body), key=lambda pair: pair[0])
FUNCTIONS = {
    name: (member, node)
    for name, member, node in PAIRS
    if isinstance(node, ast.FunctionDef) and not isinstance(member, property)
}


def signature(function: Any) -> ast.FunctionDef:
    """The signature that pybind11 puts into the first line of a docstring."""
    line = getattr(function, "__func__", function).__doc__.splitlines()[0]
    (node,) = ast.parse(f"def {line}: ...").body
    return node


def base(annotation: ast.expr | None) -> str:
    """The last name of a type without what is in brackets: of `lobefit._native.Rgl` it is `Rgl`."""
    while isinstance(annotation, ast.Subscript):
        annotation = annotation.value
    return ast.unparse(annotation).rpartition(".")[2] if annotation else ""


def parameters(node: ast.FunctionDef) -> list[tuple[str, Any]]:
    """Names and defaults; the ellipsis stands for none."""
    names = [item.arg for item in node.args.args]
    defaults = [ast.literal_eval(value) for value in node.args.defaults]
    return list(zip(names, [...] * (len(names) - len(defaults)) + defaults, strict=True))


def test_stubs_and_their_mark_are_installed():
    assert (HERE / "py.typed").is_file()
    source = Path(__file__).parents[2] / "native" / "python" / "lobefit" / "_native.pyi"
    assert (HERE / "_native.pyi").read_bytes() == source.read_bytes()


def test_every_name_of_the_module_is_in_the_stub_and_the_reverse():
    classes = [(member, node.body) for _, member, node in PAIRS if isinstance(node, ast.ClassDef)]
    for owner, body in [(_native, STUB.body), *classes]:
        assert public(owner).keys() == declared(body).keys(), owner


def test_properties_and_static_methods_are_declared_as_such():
    for name, member, node in PAIRS:
        marks = [mark.id for mark in getattr(node, "decorator_list", [])]
        special = isinstance(member, property | staticmethod)
        assert marks == ([type(member).__name__] if special else []), name


@pytest.mark.parametrize("name", FUNCTIONS)
def test_signatures_are_those_of_the_docstrings(name):
    member, node = FUNCTIONS[name]
    actual = signature(member)
    assert parameters(actual) == parameters(node)
    assert base(actual.returns) == base(node.returns)
    for one, other in zip(actual.args.args, node.args.args, strict=True):
        if base(one.annotation) in NAMED and one.arg != "self":
            assert base(one.annotation) == base(other.annotation), one.arg


def explained(name: str, value: Any) -> bool:
    """Whether a docstring tells more than the signature, which machines write."""
    text = (value.__doc__ or "").strip()
    own_name = name.rpartition(".")[2]
    return bool(text.partition("\n")[2] if text.startswith(f"{own_name}(") else text)


def test_everything_public_has_a_docstring():
    found = {name: value for name, value, _ in PAIRS if not isinstance(value, str)}
    for name in set(lobefit.__all__) - {"__version__"}:
        found[name] = getattr(lobefit, name)
        members = public(found[name]) if isinstance(found[name], type) else {}
        found |= {
            f"{name}.{key}": member
            for key, member in members.items()
            if callable(member) or isinstance(member, property | classmethod | staticmethod)
        }
    assert [name for name, value in found.items() if not explained(name, value)] == []
