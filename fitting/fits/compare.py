"""Comparison of several models of one measured curve by AIC and BIC."""

from collections.abc import Callable, Sequence
from typing import Any

from fitting.data.creep import CreepData
from fitting.data.indentation import IndentationData
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits.creep import compare_creep, restrictions
from fitting.fits.indentation import fit_indentation
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.inference.result import Comparison

# for data other than a creep curve: the fit, and the weights in a comparison of models unless others are given
OTHERS: dict[type, tuple[Callable[..., Any], str]] = {
    RelaxationData: (fit_relaxation, "proportional"),
    OscillationData: (fit_oscillation, "proportional"),
    IndentationData: (fit_indentation, "absolute"),
}


def compare(
    data: CreepData | RelaxationData | OscillationData | IndentationData,
    models: Sequence[Any] = ("Maxwell", "StandardLinearSolid", "Burgers"),
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    **options: Any,
) -> Comparison:
    """Fit several models to one creep curve, relaxation modulus, frequency sweep or indentation; the printed result is a
    table.

    All fits of a creep curve use the points and the weights of the model with the most parameters. Those of a modulus take
    "proportional" weights by default, whose errors are a fraction of each model's own values and whose variances AIC and
    BIC include, and those of an indentation "absolute" ones; "relative" weights or a sigma may be given for both.

    Args:
        data: the curve.
        models: material classes or their names, or instances as in ``fit_creep``.
        fixed: as in ``fit_creep``; applied to every model that has the parameter.
        bounds: as ``fixed``.
        options: the other keywords of ``fit_creep``, ``fit_relaxation``, ``fit_oscillation`` or ``fit_indentation``.

    Returns:
        The fits, lowest BIC first.

    Raises:
        ValueError: as these fits, a parameter that no model has, or estimated weights with a modulus or an
            indentation.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.CreepData(t=t, J=1e-6 * (1.0 + t))
        >>> table = fitting.compare(data, ["Maxwell", "Elastic"], weights="relative")
        >>> [fit.model.__name__ for fit in table.fits]
        ['Maxwell', 'Elastic']
    """
    each = restrictions(data, models, fixed, bounds)
    if type(data) not in OTHERS:
        return compare_creep(data, each, **options)
    # a modulus or an indentation by several models with weights of one kind
    fit, usual = OTHERS[type(data)]
    given = dict(options)
    if given.get("weights") is None and given.get("sigma") is None:
        given["weights"] = usual
    if given.get("weights") == "estimated":
        raise ValueError(
            'weights: expected "proportional", "relative", "absolute" or a sigma to compare models of a modulus or an'
            " indentation, got 'estimated'"
        )
    found = [fit(data, model, **own, **given) for model, _, own in each]
    return Comparison(tuple(sorted(found, key=lambda one: one.bic)))
