"""A case file to begin with: a ready-made case of a kind, with a line for all else that may stand in it.

It is written by the schema, as everything of case files is, so that no key is missing and none is unknown.
"""

from collections.abc import Iterator
from pathlib import Path

from jaxcontact.files.case_file import case_of, read_tables
from jaxcontact.files.case_schema import MATERIALS, SHAPES, TABLE, sections_of
from jaxcontact.files.case_text import Section, block_text, blocks_of

EXAMPLES = {  # of each kind a ready-made case; where it is of another kind, what both have in common
    "indentation": "polymer_coating",
    "shear": "fretting_coating",
    "sliding": "sliding_film",
    "steady-sliding": "sliding_film",
    "steady-rolling": "rolling_wheel",
}

HEAD = """# {title}
# An example to change: jaxcontact check {name}; jaxcontact run {name} -o out
# Numbers are in SI units; text may have a unit of its own: thickness = "150 nm", load = "2.5 mN", end = "1 h".
# A line with ... behind the key is what else may stand there.

"""


def template(kind: str, cases: Path, name: str) -> str:
    """A case file of this kind, from its example in the folder of cases; name: of the file it is for."""
    path = cases / f"{EXAMPLES[kind]}.toml"
    tables = {table: values for table, values in read_tables(path).items() if table in sections_of(kind)}
    tables["experiment"] = tables.get("experiment", {}) | {"kind": kind}
    case = case_of(tables, path)
    blocks = [block_text(block) + "".join(_absent(block)) for block in blocks_of(case)]
    return HEAD.format(title=_title(path), name=name) + "\n".join([*blocks, *_choices()])


def _title(path: Path) -> str:
    """The first line of a case file, which says what it is of."""
    return path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")


def _absent(block: Section) -> Iterator[str]:
    """A line for each key that is not there but may be."""
    for name, key in block.keys.items():
        if name not in block.values and key.accept is not TABLE:
            yield f"# {name} = ...  # {key.meaning}\n"


def _choices() -> Iterator[str]:
    """The materials and the shapes, each with its keys."""
    for what, choices in (("material of a layer or the substrate", MATERIALS), ("shape", SHAPES)):
        rows = [f'#   "{name}": {", ".join(keys)}' for name, (_, keys) in choices.items()]
        yield "\n".join([f"# {what}, and what stands beside it", *rows]) + "\n"
