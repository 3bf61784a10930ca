"""The names that the code of a function reads: variables, attributes and modules that it imports."""

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


def nested(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for each in code.co_consts:
        if isinstance(each, types.CodeType):
            yield from nested(each)


def names(code: types.CodeType) -> frozenset[str]:
    """Return every name of a global variable or an attribute that code, and functions defined in it, may read."""
    return frozenset(name for each in nested(code) for name in each.co_names)


def loaded(code: types.CodeType, loads: tuple[str, ...]) -> set[str]:
    return {one.argval for each in nested(code) for one in instructions(each) if one.opname in loads}


def used_whole(code: types.CodeType) -> set[str]:
    """Return the names of variables that are used other than through an attribute."""
    return {
        one.argval
        for each in nested(code)
        for one, following in pairwise(instructions(each))
        if one.opname in LOADS and following.opname not in ("LOAD_ATTR", "LOAD_METHOD")
    }


def imported(code: types.CodeType, package: str | None) -> set[str]:
    """Return the full names of the modules that code imports when it is called."""
    found = set()
    for each in nested(code):
        steps = instructions(each)
        for index, one in enumerate(steps):
            if one.opname == "IMPORT_NAME":
                level = steps[index - 2].argval
                found.add(importlib.util.resolve_name("." * level + one.argval, package))
    return found
