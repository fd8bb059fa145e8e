"""Coordinates that residuals lie along, in words with their units, and the table of where most of them lie."""

from collections.abc import Mapping, Sequence
from typing import Any

from .page import Page

COORDINATES = {
    "time": "time (s)", "rotor_speed": "rotor speed (rad/s)", "rotor_angle": "rotor angle (rad)",
    "current": "current (A)", "temperature": "temperature (°C)", "direction": "direction of motion",
    "order": "order (per turn)",
}  # fmt: skip


def coordinate(name: str, words: Mapping[str, str] | None = None) -> str:
    """A coordinate in words, with its unit in brackets; ``words`` are those of a machine that has others."""
    return (words or {}).get(name) or COORDINATES.get(name) or name.replace("_", " ")


def add_regions(page: Page, where: Sequence[Mapping[str, Any]], words: Mapping[str, str] | None = None) -> None:
    """The table of ``where`` of a verdict."""
    rows = []
    for w in where:
        along, _, unit = coordinate(w["along"], words).partition(" (")
        reach = f"{w['from']:z.3g} to {w['to']:z.3g} {unit.removesuffix(')')}".rstrip()
        rows.append([w["equation"].replace("_", " "), along, reach, f"{w['z']:.3g}", f"{w['share']:.1%}"])
    page.table(["equation", "along", "where most of it lies", "size over the noise", "share"], rows)
