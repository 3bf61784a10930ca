"""Files as instruments write them, made from a known curve; the layouts are those of public examples."""

import numpy as np


def rows(*columns, sep=",", form="{:.9g}", comma=False):
    """Lines of numbers; with decimal commas if asked."""
    lines = [sep.join(form.format(x) for x in row) for row in zip(*columns, strict=True)]
    return "\n".join(line.replace(".", ",") if comma else line for line in lines) + "\n"


def table(header, *columns, **style):
    """A header, which may have several lines, over numbers."""
    return header + "\n" + rows(*columns, **style)


def save(tmp_path, text):
    """A file with that text, or those bytes."""
    path = tmp_path / "film.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def each(t, J, line):
    """One line for each pair by a format, for what ``rows`` cannot write."""
    return "".join(line.format(t=x, J=y) + "\n" for x, y in zip(t, J, strict=True))


TRIOS = ("Time", "Step time", "Stress", "Strain", "Compliance"), ("s", "s", "Pa", "%", "1/Pa")


def trios(*steps, sep="\t", names=TRIOS[0], units=TRIOS[1]):
    """TRIOS: facts of the instrument, then steps (name, columns) with a line of names and one of units."""
    lines = ["Filename\tfilm.tri", "Instrument name\tDiscovery HR-2", "rundate\t02/04/2025"]
    lines += ["[Geometry Extended Parameters]", "Compliance\t1.03 mrad/N.m", "Strain constant\t20.0 1/rad"]
    for name, columns in steps:
        lines += ["[step]", name, "\t".join(names), "\t".join(units), rows(*columns, sep="\t")]
    return "\n".join(lines).replace("\t", sep)


ENGLISH = ("Point No.", "Time", "Interval Time", "Shear Stress", "Shear Strain", "Creep Compliance", "Status")
GERMAN = (
    "Punkt Nr.",
    "Zeit",
    "Intervallzeit",
    "Schubspannung",
    "Scherdeformation",
    "Nachgiebigkeit",
    "Status",
)


def anton_paar(*intervals, names=ENGLISH, comma=False):
    """RheoCompass: intervals of columns, an empty first cell, an empty second line of names, [units]."""
    text = "Project:\tfilm\n\nTest:\tCreep 25 C\n\nResult:\tCreep 1\n\n"
    for k, columns in enumerate(intervals, 1):
        n = len(columns[0])
        text += f"Interval and data points:\t{k}\t{n}\nInterval data:\t" + "\t".join(names) + "\n"
        text += "\t" * len(names) + "\n\t\t[s]\t[s]\t[Pa]\t[%]\t[1/Pa]\t\n"
        body = rows(np.arange(1, n + 1), *columns, sep="\t", comma=comma)
        text += "".join(f"\t{line}\tDy_auto\n" for line in body.splitlines()) + "\n"
    return text


def hysitron(t, load, depth):
    """Hysitron: a date, a count, and every column in volts as well; µ in Latin-1."""
    head = f"Mon Apr 29 10:41:06 2019\n\nNumber of Points = {t.size}\n"
    names = "Depth (nm)\tLoad (µN)\tTime (s)\tDepth (V)\tLoad (V)"
    return (head + table(names, 1e9 * depth, 1e6 * load, t, 0 * t, 0 * t, sep="\t")).encode("latin-1")


def optics11(t, load, depth, k):
    """Optics11: many facts, some of them rows of words and numbers, then six columns."""
    head = "Date\t12/05/2025\tTime\t11:20:38\tStatus\tOK\nfilm_01\nScan (#)\t1\tX (#)\t1\tY (#)\t1\n"
    head += f"Piezo position (nm) (Measured)\t-10.3\n\nk (N/m)\t{k:.3f}\nTip radius (um)\t27.500\n\n"
    head += "Device:\tChiaro\nControl mode: Peak Load Poking\nStep absolute start times (s)\t\nP[max] (uN)\t0.049\n\n"
    names = "Time (s)\tLoad (uN)\tIndentation (nm)\tCantilever (nm)\tPiezo (nm)\tAuxiliary"
    bend = 1e9 * load / k
    return head + table(names, t, 1e6 * load, 1e9 * depth, bend, 1e9 * depth + bend, 0 * t, sep="\t")


def agilent(t, load, depth, marks):
    """Agilent: a line of units, and the name of a segment in its first row alone."""
    names = ("Load Segment Type", "Hold Segment Type", "Unload From Peak Segment Type")
    first = np.diff(marks, prepend=-1) > 0
    text = "Segment\tDisplacement Into Surface\tLoad On Sample\tTime On Sample\n\tnm\tmN\ts\n"
    body = rows(1e9 * depth, 1e3 * load, t, sep="\t").splitlines()
    shown = [names[mark] if new else "" for mark, new in zip(marks, first, strict=True)]
    return text + "".join(f"{name}\t{line}\n" for name, line in zip(shown, body, strict=True))


def jpk(t, load, height, marks, constant, separation=None):
    """JPK text: each segment under remarks with names, units and the spring constant, blanks between numbers.

    separation: of tip and sample (n,) [m], in place of the measured height, or None.
    """
    key, fancy, way = "measuredHeight", "Height (measured)", height
    if separation is not None:
        key, fancy, way = "tipSampleSeparation", "Tip-Sample Separation", separation
    text = "# TEXT EXPORT\n# index: 7\n# feedbackMode: contact\n#\n"
    for k, name in enumerate(("extend", "pause", "retract")):
        on = marks == k
        text += f"# segmentIndex: {k}\n# segment: {name}\n"
        text += f"# columns: height vDeflection {key} seriesTime time\n"
        text += f'# fancyNames: "Height" "Vertical Deflection" "{fancy}" "Series Time" "Segment Time"\n'
        text += f"{constant}# units: m N m s s\n#\n"
        text += rows(0.7 * height[on], load[on], way[on], t[on], t[on] - t[on][0], sep=" ")
    return text
