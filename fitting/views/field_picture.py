"""The figure of a fit to fields: data, model and difference."""

from typing import Any

import numpy as np

from fitting.views import report


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``FieldFit``: a row for every field, at its last time with data."""
    from matplotlib.figure import Figure

    fields, grid = fit.data.fields, fit.data.grid
    figure = Figure(figsize=(10.0, 3.2 * len(fields) + 0.6), layout="constrained")
    figure.suptitle(
        "\n".join(report.parameter(fit, name) for name in fit.values), family="monospace", fontsize="small"
    )
    half = [0.5e6 * float(w) for w in grid.width]
    extent = (-half[0], half[0], -half[1], half[1])
    for row, (name, field) in enumerate(fields.items()):
        time = int(np.flatnonzero(np.isfinite(field).any((1, 2)))[-1])
        data, model = field[time], fit.predict(name)[time]
        for column, (title, image) in enumerate(
            (("data", data), ("model", model), ("difference", data - model))
        ):
            axes = figure.add_subplot(len(fields), 3, 3 * row + column + 1)
            shown = axes.imshow(image.T, origin="lower", extent=extent)
            axes.set(
                title=f"{name}, {title}, t = {fit.data.times[time]:.4g} s", xlabel="x [µm]", ylabel="y [µm]"
            )
            figure.colorbar(shown, ax=axes)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure
