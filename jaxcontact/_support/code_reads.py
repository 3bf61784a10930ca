"""The names that the code of a Python function reads, from its instructions: of global variables, of attributes, and of
modules that it imports when it is called."""

import dis
import importlib.util
import types
from collections.abc import Iterator
from itertools import pairwise

LOADS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_DEREF", "LOAD_CLASSDEREF", "LOAD_FROM_DICT_OR_DEREF")
LOADS_OF_GLOBALS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS")


def instructions(code: types.CodeType) -> list[dis.Instruction]:
    """Return the instructions of code, each with its complete argument."""
    return [each for each in dis.get_instructions(code) if each.opname != "EXTENDED_ARG"]


def _nested(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield code and that of the functions defined in it."""
    yield code
    for each in code.co_consts:
        if isinstance(each, types.CodeType):
            yield from _nested(each)


def names(code: types.CodeType) -> frozenset[str]:
    """Return every name of a global variable or an attribute that code, and functions defined in it, may read."""
    return frozenset(name for each in _nested(code) for name in each.co_names)


def globals_read(code: types.CodeType) -> set[str]:
    """Return the names of the global variables that code, and functions defined in it, read."""
    return {
        one.argval for each in _nested(code) for one in instructions(each) if one.opname in LOADS_OF_GLOBALS
    }


def used_whole(code: types.CodeType) -> set[str]:
    """Return the names of variables that are used other than through an attribute."""
    return {
        one.argval
        for each in _nested(code)
        for one, following in pairwise(instructions(each))
        if one.opname in LOADS and following.opname not in ("LOAD_ATTR", "LOAD_METHOD")
    }


def modules_imported(code: types.CodeType, package: str | None) -> set[str]:
    """Return the full names of the modules that code imports when it is called."""
    found = set()
    for each in _nested(code):
        listed = instructions(each)
        for index, one in enumerate(listed):
            if one.opname == "IMPORT_NAME":
                level = listed[index - 2].argval
                found.add(importlib.util.resolve_name("." * level + one.argval, package))
    return found
