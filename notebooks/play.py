"""A page to play with: a steel ball on a film that creeps, on glass; pressure and approach follow the sliders.

    pip install -e '.[play]'
    marimo run notebooks/play.py

Each move is a whole run of the solver on 48 x 48 cells. The first compiles for some seconds, unless an earlier visit left
its program in the store.
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="A ball on a film that creeps")

with app.setup:
    import jaxcontact as jc  # isort: skip (before jax)
    import jax
    import marimo as mo
    import numpy as np
    from matplotlib.figure import Figure

    jc.enable_compilation_cache()
    STEEL, GLASS = jc.Elastic.from_young(210e9, nu=0.3), jc.Elastic.from_young(70e9, nu=0.22)
    TIMES = np.append(0.0, np.outer([1.0, 10.0, 100.0, 1000.0], [1.0, 1.5, 2.0, 3.0, 5.0, 7.0]))  # [s]
    compiled = jax.jit(lambda body, ball, load, grid: jc.indent(body, ball, jc.Load(load), TIMES, grid=grid))


@app.function
def film(G1, softening, delay, flow):
    """A Burgers film: G1 [Pa] at first, softer by a factor 1 + softening, delay [s]; it flows as much in flow [s]."""
    return jc.Burgers(G1=G1, G2=G1 / softening, eta1=G1 * flow, eta2=G1 / softening * delay, nu=0.4)


@app.function
def pressed(material, thickness, radius, load):
    """The history of a ball of a radius [m] under a load [N] on a film of a thickness [m]."""
    body = jc.LayeredHalfSpace([jc.Layer(material, thickness)], substrate=GLASS)
    ball = jc.Sphere(radius=radius, material=STEEL)
    grid = jc.Grid.around(body, ball, jc.Load(load), TIMES, n=48)
    return compiled(*jax.tree.map(np.float64, (body, ball, load)), grid)


@app.function
def drawn(history, time):
    """The pressure across the contact at one of TIMES [s], between first and last, and the approach over time."""
    now = TIMES.tolist().index(time)
    x, middle = np.asarray(history.grid.axes()[0]) * 1e6, history.grid.shape[1] // 2
    pressure, approach = np.asarray(history.pressure)[:, :, middle] / 1e6, np.asarray(history.approach) * 1e9
    figure = Figure(figsize=(9, 3.4), dpi=80)
    figure.subplots_adjust(left=0.08, right=0.98, bottom=0.16, top=0.96, wspace=0.25)
    left, right = figure.subplots(1, 2)
    left.plot(x, pressure[0], color="0.7", label="at first")
    left.plot(x, pressure[-1], color="0.7", linestyle="--", label=f"after {TIMES[-1]:.0f} s")
    left.plot(x, pressure[now], label=f"after {time:g} s")
    left.set(xlabel="x [µm]", ylabel="pressure [MPa]", ylim=(0.0, 1.05 * pressure.max()))
    left.legend(frameon=False)
    right.plot(TIMES[1:], approach[1:])
    right.plot(max(time, 1.0), approach[now], "o", color="C0")
    right.set(xlabel="time [s]", ylabel="approach [nm]", xscale="log", ylim=(0.0, None))
    return figure


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
    decades = lambda low, high: [
        float(f"{x:.2g}") for x in np.geomspace(low, high, 4 * round(np.log10(high / low)) + 1)
    ]
    slider = lambda steps, value, label: mo.ui.slider(
        steps=steps, value=value, label=label, show_value=True, debounce=False
    )
    G1 = slider(decades(0.1, 10.0), 1.0, "shear modulus at first [GPa]")
    softening = slider(decades(0.1, 10.0), 1.0, "softens by a factor of 1 +")
    delay = slider(decades(1.0, 1e4), 100.0, "within [s]")
    flow = slider(decades(1e2, 1e6), 1e4, "flows as much within [s]")
    thickness = slider(decades(0.1, 100.0), 10.0, "thickness [µm]")
    radius = slider(decades(0.1, 10.0), 1.0, "radius of the ball [mm]")
    load = slider(decades(1.0, 1e3), 10.0, "load [mN]")
    time = slider(TIMES.tolist(), 100.0, "time [s]")
    sliders = mo.hstack(
        [mo.vstack([G1, softening, delay, flow]), mo.vstack([thickness, radius, load, time])], wrap=True
    )
    mo.vstack([mo.md("# A ball on a film that creeps, on glass"), sliders])
    return G1, delay, flow, load, radius, softening, thickness, time


@app.cell
def _(G1, delay, flow, load, radius, softening, thickness):
    material = film(G1.value * 1e9, softening.value, delay.value, flow.value)
    history = pressed(material, thickness.value * 1e-6, radius.value * 1e-3, load.value * 1e-3)
    return (history,)


@app.cell
def _(history, time):
    mo.vstack([drawn(history, time.value), validity(history)])
    return


if __name__ == "__main__":
    app.run()
