"""The table [thermal] of a case file: heat of friction, with the law by which it changes the times of the body."""

from typing import Any

from jaxcontact.inputs.shifts import ArrheniusShift, WLFShift
from jaxcontact.inputs.thermal import Thermal

SHIFTS: dict[str, tuple[Any, dict[str, str]]] = {  # by word: the law, and the keys of its arguments
    "arrhenius": (
        ArrheniusShift,
        {"shift_energy": "activation_energy", "shift_reference": "reference"},
    ),
    "wlf": (WLFShift, {"shift_c1": "c1", "shift_c2": "c2", "shift_reference": "reference"}),
}
NO_SHIFT = "none"


def heat_of(shift: str = NO_SHIFT, **given: Any) -> Thermal:
    """Return the ``Thermal`` of a table by its keys, those without a value None; ValueError for keys of another shift."""
    law, names = SHIFTS.get(shift, (None, {}))
    of_shifts = {name: given.pop(name) for name in list(given) if name.startswith("shift_")}
    for name, value in of_shifts.items():
        if (value is None) == (name in names):
            found = "missing" if value is None else "found"
            raise ValueError(f'thermal.{name}: {found} with shift = "{shift}"; accepted: {_words(names)}')
    own = None if law is None else law(**{names[name]: of_shifts[name] for name in names})
    return Thermal(shift=own, **given)


def _words(names: dict[str, str]) -> str:
    return ", ".join(names) or "no other key of a shift"
