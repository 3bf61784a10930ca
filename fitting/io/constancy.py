"""Check that a column of compliance is a creep compliance: strain over stress is J(t) only under a constant stress.

Under a varying stress, strain = int J(t - s) d stress(s) (L. Boltzmann, Ann. Phys. 241 (1878) 430), and the compliance
that an instrument writes is the quotient of strain and stress at the same time. The strain is then recovered as their
product and fitted under the measured stress.
"""

import numpy as np

from fitting.data.segments import noise, smooth
from fitting.io.columns import Column, Series

STEADY = 0.01  # relative variation of a constant stress about its median
SURE = 3.0  # significant variation in standard deviations of its noise
ENDED = 0.05  # fraction of its maximum below which the stress has ended


def settle(path: str, series: Series, end: float | None) -> Series:
    """Return the compliance alone where the stress beside it is constant, otherwise strain and stress.

    Args:
        path: for messages.
        series: with "J" and "stress", and "strain" if the file has it.
        end: last time of the requested rows on the file's clock [s], None for all.

    Raises:
        ValueError: the stress ends, and there is no strain.
    """
    t, J, stress = (series.values[key] for key in ("t", "J", "stress"))
    known = np.isfinite(t) & np.isfinite(J) & np.isfinite(stress)
    known &= (t + series.zero) <= (np.inf if end is None else end)
    if _steady(np.abs(stress[known & (J > 0)])):
        return _keep(series, ("t", "J", "sigma"), ("stress", "strain"))
    label = series.columns["stress"].label
    if "strain" in series.values and "sigma" not in series.values:
        series = _keep(series, ("t", "strain", "stress"), ("J",))
        return series.say(
            f"{label} varies: the strain is fitted under it, and the compliance beside it is not taken"
        )
    loaded = known & (np.cumsum(known & (np.abs(stress) > ENDED * np.nanmax(np.abs(stress)))) > 0)
    ends = loaded & (np.abs(stress) <= ENDED * np.nanmax(np.abs(stress)))
    if np.any(ends):
        begin, last = t[loaded][0] + series.zero, t[ends][0] + series.zero
        raise ValueError(
            f"{path}: column {label!r}: expected a strain beside a stress that ends, got a compliance alone: "
            f"window=({begin:g}, {last:g}) selects the part before its end"
        )
    return _strained(series, label)


def _steady(stress: np.ndarray) -> bool:
    """Return whether the running median of the stress stays at its median."""
    if stress.size < 3:
        return True
    level = float(np.median(stress))
    return bool(np.max(np.abs(smooth(stress) - level)) <= max(STEADY * level, SURE * noise(stress)))


def _strained(series: Series, label: str) -> Series:
    """Return the series with strain = compliance times stress in place of the compliance."""
    stress, compliance = series.values["stress"], series.columns["J"]
    values = {"t": series.values["t"], "strain": series.values["J"] * stress, "stress": stress}
    if "sigma" in series.values:
        values["sigma"] = series.values["sigma"] * np.abs(stress)
    columns: dict[str, Column] = {key: series.columns[key] for key in values if key in series.columns}
    series = series._replace(values=values, columns=columns | {"strain": compliance})
    return series.say(f"{label} varies: {compliance.label} times it is the strain, which is fitted under it")


def _keep(series: Series, keys: tuple[str, ...], dropped: tuple[str, ...]) -> Series:
    """Return some of the columns, without the notes on those that are not used."""
    notes = {note for key in dropped if key in series.columns for note in series.columns[key].notes}
    used = {note for key in keys if key in series.columns for note in series.columns[key].notes}
    return series._replace(
        values={key: series.values[key] for key in keys if key in series.values},
        columns={key: series.columns[key] for key in keys if key in series.columns},
        notes=tuple(note for note in series.notes if note not in notes - used),
    )
