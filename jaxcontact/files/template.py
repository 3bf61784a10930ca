"""Templates of case files: a ready-made case of a kind, with a commented line for every other key that it may have.

Templates are generated from the schema, as all of case files is, so that they contain every known key and no other.
"""

from collections.abc import Iterator
from pathlib import Path

from jaxcontact.files.case_file import case_of
from jaxcontact.files.case_keys import LAWS, MATERIALS, SHAPES, TABLE
from jaxcontact.files.case_schema import KINDS, sections_of
from jaxcontact.files.case_tables import read_tables
from jaxcontact.files.case_text import Section, block_text, blocks_of

HEAD = """# {title}
# An example to change: jaxcontact check {name}; jaxcontact run {name} -o out
# Numbers are in SI units; text may have a unit of its own: thickness = "150 nm", load = "2.5 mN", end = "1 h".
# A commented line with ... after the key is an optional key.

"""


def template(kind: str, cases: Path, name: str) -> str:
    """Return a case file of this kind, from its example in the folder of cases; name: the file that it is written to."""
    path = cases / f"{KINDS[kind].example}.toml"
    tables = {table: values for table, values in read_tables(path).items() if table in sections_of(kind)}
    own = {name: key.example for name, key in KINDS[kind].beside.items() if key.example is not None}
    tables["experiment"] = own | tables.get("experiment", {}) | {"kind": kind}
    case = case_of(tables, path)
    blocks = [block_text(block) + "".join(_absent(block)) for block in blocks_of(case)]
    return HEAD.format(title=_title(path), name=name) + "\n".join([*blocks, *_choices(kind)])


def _title(path: Path) -> str:
    """Return the first line of a case file, which is its title."""
    return path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")


def _absent(block: Section) -> Iterator[str]:
    """Yield a commented line for each optional key that is absent."""
    for name, key in block.keys.items():
        if name not in block.values and key.accept is not TABLE:
            yield f"# {name} = ...  # {key.meaning}\n"


def _choices(kind: str) -> Iterator[str]:
    """Yield the materials, the shapes and, with adhesion, its laws, each with its keys."""
    laws = [("law of [adhesion]", LAWS)] if "adhesion" in sections_of(kind) else []
    for what, choices in [("material of a layer or the substrate", MATERIALS), ("shape", SHAPES), *laws]:
        rows = [f'#   "{name}": {", ".join(keys)}' for name, (_, keys) in choices.items()]
        yield "\n".join([f"# {what}, and its keys", *rows]) + "\n"
