"""Messages of the readers and fits for the shell: flags in place of keyword arguments."""

import re

# names of options at the head of a message, and their flags
HEADS = {
    **{name: f"--{name.replace('_', '-')}" for name in (
        "adhesion", "contact_point", "control", "convention", "curve", "drag", "drift", "exclude", "law", "layer", "level",
        "machine_compliance", "model", "nu", "segment", "sensitivity", "thickness", "sigma", "spring_constant", "start",
        "stress", "tau", "temperature", "weights", "window", "bulk_modulus",
    )},
    "columns, units, decimal": "--column, --unit, --decimal",
    "fixed, bounds": "--fix, --bound", "fixed": "--fix", "bounds": "--bound", "sigma": "--weights", "columns": "--column",
    "units": "--unit", "per_decade": "--resample", "times": "--times", "substrate": "--substrate-modulus",
}  # fmt: skip
# patterns of options elsewhere in a message, and their flags
FLAGS = (
    (
        rf"(^|: )({'|'.join(HEADS)}): (?=expected|goes|\"|\w+ has )",
        lambda found: f"{found[1]}{HEADS[found[2]]}: ",
    ),
    (r"\b(fixed|bounds)\['?([^'\]]+)'?\]", lambda found: f"{HEADS[found[1]]} {found[2]}"),
    (r"\berrors\['(\w+)'\]", lambda found: f"--{found[1].replace('_', '-')}-error"),
    (r"columns=\{'(\w+)': \.\.\.\}", r"--column \1=HEADER"),
    (r"columns=\{'(\w+)': '([^']*)'\}", r"--column \1=\2"),
    (r"columns=\{'(\w+)': (\d+)(?:, '\w+': \d+)*\} for instance", r"--column \1=\2 and so on"),
    (r"columns\['(\w+)'\]", r"--column \1"),
    (r"units=\{'(\w+)': \.\.\.\}", r"--unit \1=..."),
    (r"units=\{'(\w+)': '([^']*)'\}", r"--unit \1=\2"),
    (r"\bunits=", "--unit"),
    (r"window=\(None, ([^)]*)\)", r"--window :\1"),
    (r"window=\(([^,]*), None\)", r"--window \1:"),
    (r"window=\(([^,]*), ([^)]*)\)", r"--window \1:\2"),
    (r"decimal='\.' or ','", "--decimal . or --decimal ,"),
    (r"convention='D'; got convention='?([^']*)'?$", r"--tension; got --convention \1"),
    (r"convention='[DE]' and nu=|convention='D', nu=|\bnu=(?= for [JE])", "--tension NU"),
    (r"\bnu=(\S+), bulk_modulus=(\S+)", r"--nu \1, --bulk-modulus \2"),
    (r"\bof nu and bulk_modulus", "of --nu and --bulk-modulus"),
    (r"\bcontact=\"([\w-]+)\"", r"--contact \1"),
    (r"\bcontrol=\"(\w+)\"", r"--control \1"),
    (r"(?<!-)\b(start|segment|curve|stress)=", r"--\1="),
    (r"--(start|segment|curve|stress)=(?=[\s,;:]|$)", r"--\1"),
    (r"\bspring_constant=", "--spring-constant"),
    (r"\bsensitivity=", "--sensitivity"),
    (r"\btemperature= ", "--temperature "),
    (r"\bdrag=\"fit\"", "--drag fit"),
    (r"\bor sigma(=\.\.\.)?", "or a standard deviation"),
    (r"--segment=\(\"(\w+)\", \"(\w+)\"\)", r"--segment \1 --segment \2"),
    (r"\bindenter: (?=expected a radius)", "--radius, --punch: "),
    (r"\bin_contact\((film=True)?\)", "--in-contact"),
    (r"\bdata\.(?=--)", ""),
    (r"\bread_(creep|growth|relaxation|oscillation|indentation|stiffness)\b", r"jaxcontact fit \1"),
    (r"\bfit_prony\(data\) (.*) \(jaxcontact fit prony\)", r"jaxcontact fit prony \1"),
    (r"\bfit_prony\b", "jaxcontact fit prony"),
    (
        r"take load and depth from afmformats and make IndentationData\([^)]*\)",
        "export times, load and depth as text",
    ),
    (r"\bjc\.", ""),
    (r"\bgot None\b", "got none"),
    (r"\bgot \{('[^}]*)\}", lambda found: "got " + re.sub(r"'(\w+)': '?([^',]*)'?", r"\1=\2", found[1])),
)


def in_flags(message: str) -> str:
    """Return a message of the readers and fits, of one or several lines, with each option replaced by its flag."""
    for pattern, flag in FLAGS:
        message = re.sub(pattern, flag, message, flags=re.MULTILINE)  # type: ignore[call-overload]
    return message
