"""The form in which problems.json has a problem and its reference values."""

from typing import Any

CONTACT_MECHANICS = "K. L. Johnson, Contact Mechanics, Cambridge University Press (1985)"


def problem(
    title: str,
    source: str,
    method: str,
    inputs: dict,
    references: dict[str, tuple[float, str, float]],
) -> dict[str, Any]:
    """Return a problem as it is written; references: by name the value, its unit and the relative tolerance."""
    values = {
        name: {"value": float(value), "unit": unit, "tolerance": tolerance}
        for name, (value, unit, tolerance) in references.items()
    }
    return {
        "title": title,
        "source": source,
        "method": method,
        "inputs": inputs,
        "references": values,
    }
