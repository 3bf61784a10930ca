"""A page to play with: three contacts with a film that creeps; pressure and approach follow the sliders.

    pip install -e '.[play]'
    marimo run notebooks/play.py

Each move is a whole run of the solver. The first run of a ball and that of a roller compile for some seconds, unless an
earlier visit left their programs in the store.
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Contact with a film that creeps")

with app.setup:
    import os

    import marimo as mo

    mo.output.replace(mo.md("Loading; the first run of an example is then compiled for some seconds"))
    # Before scipy is loaded, whose BLAS solves the small systems of a run: its threads wait for one another in a busy
    # loop, which takes up to a second of processor time per move where other programs use the processor as well.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import jaxcontact as jc  # isort: skip (before jax)
    import jax
    import numpy as np

    jc.enable_compilation_cache()
    STEEL, GLASS = jc.Elastic.from_young(210e9, nu=0.3), jc.Elastic.from_young(70e9, nu=0.22)
    TIMES = np.append(0.0, np.outer([1.0, 10.0, 100.0, 1000.0], [1.0, 2.0, 5.0]))  # [s]
    LABELS = {
        "stiffness": "shear modulus at first",
        "softening": "softening",
        "delay": "time of softening",
        "flow": "time of flow",
        "thickness": "thickness",
        "radius": "radius",
        "load": "load",
    }
    UNITS = {
        "times": 1.0,
        "s": 1.0,
        "h": 3600.0,
        "GPa": 1e9,
        "MPa": 1e6,
        "kPa": 1e3,
        "mm": 1e-3,
        "µm": 1e-6,
        "nm": 1e-9,
    }
    UNITS |= {"Pa": 1.0, "N": 1.0, "nN": 1e-9, "kN/m": 1e3}
    PRESETS = {  # what is pressed, the film and its Poisson's ratio, the substrate, and the sliders
        "ZDDP film on steel": (
            "ball", "tribofilm", 0.3, STEEL,
            dict(stiffness=(10, "GPa"), softening=(0.5, "times"), delay=(100, "s"), flow=(10, "h"),
                 thickness=(150, "nm"), radius=(10, "mm"), load=(10, "N")),
        ),
        "gel under a bead": (
            "bead", "gel", 0.49, GLASS,
            dict(stiffness=(1, "kPa"), softening=(1, "times"), delay=(10, "s"), flow=(10, "h"),
                 thickness=(50, "µm"), radius=(25, "µm"), load=(1, "nN")),
        ),
        "rubber under a roller": (
            "roller", "rubber", 0.49, STEEL,
            dict(stiffness=(1, "MPa"), softening=(0.5, "times"), delay=(10, "s"), flow=(100, "h"),
                 thickness=(10, "mm"), radius=(50, "mm"), load=(1, "kN/m")),
        ),
    }  # fmt: skip
    SHOWN = {  # units of pressure, of approach, and of the distance from the middle
        "tribofilm": ("MPa", "nm", "µm"),
        "gel": ("Pa", "µm", "µm"),
        "rubber": ("kPa", "µm", "mm"),
    }
    # The first figure waits for the compiler, which takes half as long with these options; a run takes half as long again.
    OPTIONS = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
    try:
        jax.jit(lambda: 0, compiler_options=OPTIONS)()
    except jax.errors.JaxRuntimeError:  # a compiler that does not know them
        OPTIONS = {}
    compiled = jax.jit(
        lambda body, pressed, load, grid: jc.indent(body, pressed, jc.Load(load), TIMES, grid=grid),
        compiler_options=OPTIONS,
    )
    mo.output.clear()


@app.function
def film(stiffness, softening, delay, flow, nu):
    """A Burgers film: stiffness [Pa] at first; its compliance grows by a share, softening, within the delay [s].

    It flows as much as its first strain in flow [s].
    """
    G2 = stiffness / softening
    return jc.Burgers(G1=stiffness, G2=G2, eta1=stiffness * flow, eta2=G2 * delay, nu=nu)


@app.function
def pressed(preset, stiffness, softening, delay, flow, thickness, radius, load):
    """The history of a preset's contact, for values in SI units; the load of a roller is that on a metre."""
    shape, _, nu, substrate, _ = PRESETS[preset]
    body = jc.LayeredHalfSpace([jc.Layer(film(stiffness, softening, delay, flow, nu), thickness)], substrate)
    indenter = jc.Cylinder(radius, 1.0, STEEL) if shape == "roller" else jc.Sphere(radius, STEEL)
    grid = jc.Grid.around(body, indenter, jc.Load(load), TIMES, n=48)
    if shape == "roller":
        grid = jc.Grid((96, 1), (grid.width[0] / 96, 1.0), periodic=(False, True))
    return compiled(*jax.tree.map(np.float64, (body, indenter, load)), grid)


@app.function
def rounded(value):
    """The next of 1, 2, 5, 10, ... above a value: limits of axes that stay the same over several moves."""
    power = 10.0 ** np.floor(np.log10(value))
    return power * min(step for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * (1.0 - 1e-9))


@app.function
def panel(seen, curves, across, up):
    """The drawing of curves (x, y, style) as SVG, between axes (label, ticks, lowest, highest, logarithmic).

    The axes are 300 x 180 units large; seen: what it shows, for readers without a screen.
    """

    def placed(values, axis, length):
        _, _, low, high, logarithmic = axis
        scaled = np.log if logarithmic else np.asarray
        return length * (scaled(values) - scaled(low)) / (scaled(high) - scaled(low))

    X, Y = lambda x: 60.0 + placed(x, across, 300.0), lambda y: 190.0 - placed(y, up, 180.0)
    parts = ['<rect x="60" y="10" width="300" height="180" fill="none" stroke="#808080"/>']
    for tick in across[1]:
        parts.append(f'<path d="M{X(tick):.1f} 190 v5" stroke="#808080"/>')
        parts.append(f'<text x="{X(tick):.1f}" y="208" text-anchor="middle">{tick:g}</text>')
    for tick in up[1]:
        parts.append(f'<path d="M60 {Y(tick):.1f} h-5" stroke="#808080"/>')
        parts.append(f'<text x="52" y="{Y(tick) + 4.0:.1f}" text-anchor="end">{tick:g}</text>')
    parts.append(f'<text x="210" y="228" text-anchor="middle">{across[0]}</text>')
    parts.append(f'<text transform="translate(12 100) rotate(-90)" text-anchor="middle">{up[0]}</text>')
    for x, y, style in curves:
        points = " ".join(f"{each[0]:.2f},{each[1]:.2f}" for each in zip(X(x), Y(y), strict=True))
        parts.append(f'<polyline points="{points}" fill="none" {style}/>')
    return f"""<svg viewBox="0 0 380 240" role="img" font-size="12" font-family="sans-serif" aria-label="{seen}"
      style="flex: 1 1 300px; max-width: 450px; background: white; border-radius: 4px">{"".join(parts)}"""


@app.function
def drawn(preset, history, before, time):
    """The pressure across the contact at one of TIMES [s] and the approach over time; in grey those before the last move.

    It is written as SVG: a figure of matplotlib takes longer than the solver.
    """
    now = TIMES.tolist().index(time)
    force, length, aside = SHOWN[PRESETS[preset][1]]
    pascal, metre = UNITS[force], UNITS[length]
    grey, blue = 'stroke="#909090" stroke-dasharray="5 3"', 'stroke="#31688e" stroke-width="2"'
    pressures, approaches, ends = [], [], []
    for one, style in ((before, grey), (history, blue)):
        x, middle = np.asarray(one.grid.axes()[0]) / UNITS[aside], one.grid.shape[1] // 2
        pressure, approach = np.asarray(one.pressure)[:, :, middle] / pascal, np.asarray(one.approach) / metre
        pressures.append((x, pressure[now], style))
        approaches.append((TIMES[1:], approach[1:], style))
        ends.append((x[-1], pressure.max(), approach.max()))
    wide, high, deep = (rounded(max(values)) for values in zip(*ends, strict=True))
    marked = (
        np.full(2, max(time, 1.0)),
        np.array([0.0, approach[now]]),
        'stroke="#31688e" stroke-dasharray="1 3"',
    )
    ticks = lambda low, top: np.linspace(low, top, 5)
    left = panel(
        f"pressure across the contact after {time:g} s",
        pressures,
        (f"x [{aside}]", ticks(-wide, wide), -wide, wide, False),
        (f"pressure [{force}]", ticks(0.0, high), 0.0, high, False),
    )
    right = panel(
        "approach over time",
        [*approaches, marked],
        ("time [s]", [1, 10, 100, 1000], 1.0, TIMES[-1], True),
        (f"approach [{length}]", ticks(0.0, deep), 0.0, deep, False),
    )
    return mo.Html(f"""<div style="display: flex; flex-wrap: wrap">{left}
      <path d="M70 24 h24" {blue}/><text x="100" y="28">after {time:g} s</text>
      <path d="M70 42 h24" {grey}/><text x="100" y="46">before</text></svg>{right}</svg></div>""")


@app.function
def sketch(preset, shown):
    """A drawing of the contact with its numbers, not to scale; shown: the values as text."""
    shape, name, _, substrate, _ = PRESETS[preset]
    below = "steel" if substrate is STEEL else "glass"
    return mo.Html(f"""<svg viewBox="0 0 320 190" width="320" role="img" aria-label="{shape} on a {name}" font-size="12"
      style="background: white; border-radius: 4px"><rect y="150" width="320" height="40" fill="#c3cad2"/>
      <rect y="110" width="320" height="40" fill="#e8d9b0"/><circle cx="160" cy="-25" r="138" fill="#c3cad2"/>
      <path d="M160 8 V32 M155 26 L160 34 L165 26" stroke="black" fill="none"/><text x="170" y="24">{shown["load"]}</text>
      <text x="160" y="70" text-anchor="middle">{shape}, radius {shown["radius"]}</text>
      <text x="8" y="134">{name}, {shown["thickness"]}</text>
      <text x="312" y="134" text-anchor="end">{shown["stiffness"]}</text>
      <text x="8" y="175">{below}</text></svg>""")


@app.function
def film_of_pressure(history):
    """The pressure across the contact as a drawing that runs once through all TIMES, in four seconds."""
    middle = history.grid.shape[1] // 2
    pressure = np.asarray(history.pressure)[:, :, middle]
    heights = 110.0 - 100.0 * pressure / max(float(pressure.max()), np.finfo(float).tiny)
    across = np.linspace(0.0, 320.0, pressure.shape[1])
    curves = [
        "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in zip(across, line, strict=True)) for line in heights
    ]
    ends = "".join(
        f'<path d="{curves[i]}" stroke="#b0b0b0" stroke-dasharray="4 3" fill="none"/>' for i in (0, -1)
    )
    return mo.Html(f"""<figure style="margin: 0"><svg viewBox="0 0 320 120" width="320" role="img" font-size="12"
      aria-label="pressure across the contact from the first instant to the last" style="background: white">{ends}
      <path d="{curves[-1]}" stroke="#31688e" stroke-width="2" fill="none">
      <animate attributeName="d" dur="4s" values="{";".join(curves)}" /></path></svg>
      <figcaption>Pressure from the first instant to {TIMES[-1]:,.0f} s, in steps of 1, 2, 5, 10 ...; dashed: first and
      last.</figcaption></figure>""")


@app.function
def validity(history):
    """Return a warning if a run failed or its film strain is large, and the film strain."""
    status, strain = int(np.max(np.asarray(history.status))), float(np.max(np.asarray(history.film_strain)))
    if status:
        return mo.callout(mo.md(f"No result: {jc.Status(status).message}."), kind="danger")
    note = f"The film is shortened by {100 * strain:.2g} % of its thickness at most"
    if strain > 0.1:
        return mo.callout(mo.md(f"{note}, which is beyond the range of linear theory."), kind="warn")
    return mo.md(f"{note}.")


@app.cell
def _():
    preset = mo.ui.dropdown(list(PRESETS), value="ZDDP film on steel", label="example")
    mo.vstack([mo.md("# Contact with a film that creeps"), preset])
    return (preset,)


@app.cell
def _(preset):
    steps = lambda value: [float(f"{value * 10.0 ** (i / 12):.2g}") for i in range(-12, 13)]
    slider = lambda value, grid: mo.ui.slider(steps=grid, value=value, show_value=True, debounce=False)
    given = PRESETS[preset.value][4]
    sliders = mo.ui.dictionary(
        {name: slider(float(value), steps(value)) for name, (value, _) in given.items()}
    )
    time = slider(100.0, TIMES.tolist())
    histories = []  # of this example, the last one at the end
    return given, histories, sliders, time


@app.cell
def _(given, preset, sliders, time):
    values = {name: sliders.value[name] * UNITS[unit] for name, (_, unit) in given.items()}
    shown = {name: f"{sliders.value[name]:g} {unit}" for name, (_, unit) in given.items()}
    rows = [
        f"<tr><td style='padding-right: 1em'>{LABELS[name]} [{unit}]</td><td>{sliders[name]}</td></tr>"
        for name, (_, unit) in given.items()
    ]
    rows.append(f"<tr><td>time under load [s]</td><td>{time}</td></tr>")
    mo.hstack(
        [mo.Html(f"<table>{''.join(rows)}</table>"), sketch(preset.value, shown)], wrap=True, align="center"
    )
    return (values,)


@app.cell
def _(histories, preset, values):
    with mo.status.spinner(title="Computing; the first run of an example is compiled for some seconds"):
        history = jax.block_until_ready(pressed(preset.value, **values))
    before = histories[-1] if histories else history
    histories[:] = [before, history]
    return before, history


@app.cell
def _(before, history, preset, time):
    now = mo.hstack([film_of_pressure(history), validity(history)], wrap=True, align="center")
    mo.vstack([drawn(preset.value, history, before, time.value), now])
    return


if __name__ == "__main__":
    app.run()
