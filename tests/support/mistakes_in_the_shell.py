"""Mistakes that only the command line can make, those in a study's file among them: one line, and status 2."""

import numpy as np
from mistakes_in_case_files import CASE, NO_TIMES

from jaxcontact.__main__ import main


def shell(folder, *words):
    """The mistakes that only the command line can make; the files are there."""
    (folder / "case.toml").write_text(CASE)
    (folder / "kelvin.toml").write_text(
        '[substrate]\nmaterial = "kelvin-voigt"\nG = 1.0\neta = 1.0\n' + CASE[CASE.index("[indenter]") :]
    )
    far = '[experiment]\nkind = "sliding"\nvelocity = 1.0\n' + CASE
    (folder / "far.toml").write_text(far)
    rolls = CASE.replace(*NO_TIMES).replace("load = 10.0", "load = 10.0\ncreepage = [1e-3, 0.0]")
    still = '[experiment]\nkind = "steady-rolling"\nvelocity = 0.0\nfriction = 0.3\n' + rolls
    (folder / "still.toml").write_text(still)
    (folder / "large.toml").write_text(CASE.replace("n = 32", "n = 65536"))
    (folder / "bad.npz").write_text("no arrays")
    np.savez(folder / "other.npz", a=1.0)
    np.savez(folder / "part.npz", kind="ContactHistory")
    np.savez(folder / "course.npz", times=[0.0], approach=[1e-6])
    for number, (sweep, _) in enumerate(STUDIES.values()):
        (folder / f"study_{number}.toml").write_text(f"{sweep}\n{CASE}")
    (folder / "full").mkdir(exist_ok=True)
    (folder / "full" / "mine.txt").write_text("mine")
    return main([str(folder / word[1:]) if word.startswith("@") else word for word in words])


STUDIES = {
    "a study of nothing": ("", r"\[sweep\]: missing; accepted: keys and their values"),
    "a number for a study": ("sweep = 1", r"\[sweep\]: found 1, accepted: a table"),
    "a key without its table": (
        "[sweep]\nload = [1.0]",
        r"sweep.load: unknown key; accepted: method, samples, seed,",
    ),
    "one value": (
        '[sweep]\n"control.load" = 1.0',
        r"sweep.control.load: found 1.0, accepted: a list of values, or",
    ),
    "no value": (
        '[sweep]\n"control.load" = []',
        r"sweep.control.load: found \[\], accepted: a list of values, or",
    ),
    "a quantity of another dimension": (
        '[sweep]\n"control.load" = ["1 N", "2 mm"]',
        r'sweep.control.load: found "2 mm", accepted: ',
    ),
    "a range without count": (
        '[sweep]\n"control.load" = {from = 1, to = 2}',
        r"sweep.control.load.count: missing; accepted: a whole number from 2",
    ),
    "a range by steps": (
        '[sweep]\n"control.load" = {from = 1, to = 2, steps = 3}',
        r"sweep.control.load.steps: unknown key; accepted: from, to, count, log",
    ),
    "a range down": (
        '[sweep]\n"control.load" = {from = 2, to = 1, count = 3}',
        r"sweep.control.load: found 2 to 1, accepted: from < to",
    ),
    "a logarithm of nothing": (
        '[sweep]\n"control.load" = {from = 0, to = 1, count = 3, log = true}',
        r"found 0 to 1, accepted: 0 < from < to, since log = true",
    ),
    "samples of a grid": (
        '[sweep]\nsamples = 3\n"control.load" = [1.0]',
        r'sweep.samples: found with a grid, accepted: with method = "latin-hypercube"',
    ),
    "a hypercube of no size": (
        '[sweep]\nmethod = "latin-hypercube"\n"control.load" = [1.0]',
        r"sweep.samples: missing; accepted: a whole number from 1",
    ),
    "too many cases": (
        '[sweep]\n"control.load" = {from = 1, to = 2, count = 400}\n"grid.n" = {from = 1, to = 2, count = 400}',
        r"\[sweep\]: found 160000, accepted: up to 100000 cases",
    ),
    "a layer that is not there": (
        '[sweep]\n"layer[3].thickness" = [1e-6]',
        r"\[sweep\] layer\[3\].thickness = 1e-06: layer\[3\]: found no such table",
    ),
    "a value that no case takes": (
        '[sweep]\n"control.load" = [1.0, -1.0]',
        r"\[sweep\] control.load = -1.0: control.load: found -1.0, accepted: a number > 0",
    ),
}

SHELL = {
    **{
        name: (["sweep", f"@study_{i}.toml", "-o", "@out"], words)
        for i, (name, (_, words)) in enumerate(STUDIES.items())
    },
    "a study in a directory of others": (
        ["sweep", "film_map", "-o", "@full"],
        r"full: found a directory that is not empty, accepted: a new one, or that of this study",
    ),
    "a study to run": (
        ["run", "film_map", "-o", "@out"],
        r"\[sweep\]: found a study, accepted: a single case; jaxcontact sweep checks and runs",
    ),
    "processes without number": (
        ["sweep", "film_map", "-o", "@out", "--processes", "0"],
        r"processes: expected 1 to 10000, got 0",
    ),
    "no such case": (["run", "@none.toml", "-o", "@out"], r"none.toml: No such file.*expected a TOML file"),
    "no place for results": (["run", "@case.toml"], r"-o: missing; accepted: -o DIR"),
    "results into a file": (
        ["run", "@case.toml", "-o", "@case.toml"],
        r"found a file, accepted: a directory",
    ),
    "results over others": (["run", "@case.toml", "-o", "@full"], r"not empty; --force overwrites it"),
    "nothing to resume": (
        ["run", "@case.toml", "-o", "@full", "--resume"],
        r"found no unfinished run and no finished one of this case, accepted",
    ),
    "too large a run": (
        ["check", "@large.toml"],
        r"large.toml: grid: found .* GB of memory, accepted: up to .* GB",
    ),
    "what a run would refuse": (["check", "@kelvin.toml"], r"kelvin.toml: .*expected an elastic indenter"),
    "the same, run": (["run", "@kelvin.toml", "-o", "@out"], r"kelvin.toml: .*expected an elastic indenter"),
    "what its function would refuse": (
        ["check", "@far.toml"],
        r"far.toml: velocity: expected steps of at most 0.5 of the grid's width, got",
    ),
    "a steady state at rest": (["check", "@still.toml"], r"still.toml: velocity"),
    "a steady state at rest, run": (["run", "@still.toml", "-o", "@out"], r"still.toml: velocity"),
    "the same function, run": (["run", "@far.toml", "-o", "@out"], r"far.toml: velocity: expected steps of"),
    "a picture as text": (["plot", "@part.npz", "-o", "@a.txt"], r"found .txt, accepted: .pdf, .png, .svg"),
    "a picture over another": (["plot", "@case.npz", "-o", "@full.png"], r"already exists"),
    "a new case over another": (["new", "@full.png"], r"already exists"),
    "no such result": (["plot", "@none.npz"], r"No such file.*none.npz"),
    "a result that is none": (["plot", "@bad.npz"], r"not an npz file of arrays; accepted"),
    "somebody else's arrays": (["plot", "@other.npz"], r"found no result of jaxcontact; accepted"),
    "half a result": (["plot", "@part.npz"], r"times: missing; accepted"),
    "a course for a result": (
        ["plot", "@course.npz"],
        r"course.npz: found the time series of a run.*numpy.load.*; accepted: the result.npz beside it",
    ),
    "a file over another": (["convert", "@other.npz", "-o", "@full.png"], r"already exists"),
    "no folder to write into": (
        ["convert", "@other.npz", "-o", "@none/film.nc"],
        r"found no folder .*none, accepted: a file name in an existing folder",
    ),
    "a film to be converted": (["convert", "@film.pvd", "-o", "@film.nc"], r"found .pvd, accepted"),
    "an unknown figure": (
        ["reproduce", "figure_99", "-o", "@out"],
        r"unknown case 'figure_99'; expected one of figure_4",
    ),
}
