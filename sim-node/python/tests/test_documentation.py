"""`help()` shows what the type stubs say, and everything has a text."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import catenary
import pytest
from catenary import _catenary

STUB = Path(_catenary.__file__).parent / "_catenary.pyi"
NODES = ast.parse(STUB.read_text()).body
CLASSES = [node for node in NODES if isinstance(node, ast.ClassDef)]
FUNCTIONS = [node for node in NODES if isinstance(node, ast.FunctionDef)]


@pytest.mark.parametrize("stub", CLASSES, ids=[stub.name for stub in CLASSES])
def test_the_native_classes_have_the_texts_of_the_stub(stub: ast.ClassDef) -> None:
    native = getattr(_catenary, stub.name)
    texts: list[tuple[str | None, str | None]] = [(None, ast.get_docstring(stub))]
    functions = [node for node in stub.body if isinstance(node, ast.FunctionDef)]
    texts += [(function.name, ast.get_docstring(function)) for function in functions]
    for name, text in texts:
        if text is not None:
            found = native if name is None else getattr(native, name)
            assert inspect.cleandoc(found.__doc__ or "") == text, name


@pytest.mark.parametrize("stub", FUNCTIONS, ids=[stub.name for stub in FUNCTIONS])
def test_the_native_functions_have_the_texts_of_the_stub(stub: ast.FunctionDef) -> None:
    native = getattr(_catenary, stub.name)
    assert inspect.cleandoc(native.__doc__ or "") == ast.get_docstring(stub)


@pytest.mark.parametrize("name", catenary.__all__)
def test_everything_public_has_a_text(name: str) -> None:
    value = getattr(catenary, name)
    if not isinstance(value, type) or issubclass(value, Exception):
        return
    assert value.__doc__, name
    if value is catenary.Action:
        return  # The methods of `Commands` describe each action.
    for attribute in dir(value):
        member = inspect.getattr_static(value, attribute)
        if not attribute.startswith("_") and not isinstance(member, (int, dict)):
            assert inspect.getdoc(getattr(value, attribute)), f"{name}.{attribute}"
