"""Figure of the fit of a modulus: G(t), or G' and G'' with tan delta, on logarithmic axes, residuals and parameters."""

from typing import Any

import numpy as np

from fitting.views import fit_picture

FINE = 200  # points of a line
NAMES, COLOURS = ("G'", "G''"), ("C3", "C0")


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``ModulusFit``; saved where a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.5), layout="constrained")
    fit_picture.title(figure, fit)
    places = figure.add_gridspec(3, 2, height_ratios=(3, 1.2, 0.5))
    top, bottom = figure.add_subplot(places[0, 0]), figure.add_subplot(places[1, 0])
    rows = _rows(fit)
    line = np.geomspace(rows[0][0][rows[0][0] > 0.0].min(), rows[0][0].max(), FINE)
    model, band = fit.modulus(line), fit.modulus_band(line)
    part = (lambda values, k: values) if fit.relaxed else (lambda values, k: (values.real, values.imag)[k])
    for k, (name, colour, (x, y, residual)) in enumerate(_named(fit, rows)):
        top.loglog(
            x[x > 0.0], np.where(y > 0.0, y, np.nan)[x > 0.0], ".", markersize=4, color=colour, label=name
        )
        top.loglog(line, part(model, k), color=colour, linewidth=1.0)
        top.fill_between(line, part(band[0], k), part(band[1], k), color=colour, alpha=0.3, linewidth=0)
        bottom.semilogx(x[x > 0.0], -residual[x > 0.0], ".", markersize=4, color=colour)
    positive = [np.min(y[y > 0.0]) for _, y, _ in rows if np.any(y > 0.0)]
    low = min([*positive, *(float(np.min(part(model, k))) for k in range(len(rows)))])
    high = max(float(np.max(y)) for _, y, _ in rows)
    top.set(ylabel=f"{', '.join(name for name, *_ in _named(fit, rows))} [Pa]", ylim=(0.5 * low, 2.0 * high))
    top.legend(title=f"{fit.model.__name__}, {100 * fit.level:g} % band", fontsize="small")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="t [s]" if fit.relaxed else "ω [rad/s]", ylabel=f"residual [-]\n({fit.weights})")
    last = figure.add_subplot(places[:2, 1])
    if fit.relaxed:
        fit_picture.compliance(last, fit)
    else:
        _loss_factor(last, fit, rows, line)
    fit_picture.parameters(figure.add_subplot(places[2, :]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _rows(fit: Any) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return (abscissa, values, residuals) of G, or of G' and of G''."""
    _, _, x, y = fit.curve
    count = 1 if fit.relaxed else 2
    columns = [np.split(one, count) for one in (x, y, fit.residuals)]
    return [(columns[0][k], columns[1][k], columns[2][k]) for k in range(count)]


def _named(fit: Any, rows: list) -> list[tuple[str, str, Any]]:
    """Return (name, colour, row) of every part."""
    names = ("G(t)",) if fit.relaxed else NAMES
    return list(zip(names, COLOURS, rows, strict=False))


def _loss_factor(axes: Any, fit: Any, rows: list, line: np.ndarray) -> None:
    """Plot tan delta = G''/G' of data and fit."""
    (x, storage, _), (_, loss, _) = rows
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where((storage > 0.0) & (loss > 0.0), loss / storage, np.nan)
    model = fit.modulus(line)
    axes.loglog(x, factor, ".", markersize=4, color="0.4", label="data")
    axes.loglog(line, model.imag / model.real, color="C2", label=fit.model.__name__)
    axes.set(xlabel="ω [rad/s]", ylabel="tan δ = G''/G' [-]")
    axes.legend(fontsize="small")
