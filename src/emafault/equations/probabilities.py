"""On whose blind cases a verdict's probabilities were checked: the reference actuator's, or one's own actuator's."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..effects.scaling import reference
from ..errors import InputError, shown
from ..plain import read_json

FORMAT = "1.0"
NEEDED = ("format", "actuator", "counted", "calibration_error", "false_names", "holds")
SAME = ("pole_pairs", "gear_ratio")  # of an actuator and of a unit of it that was identified
ALIKE = ("bus_voltage", "resistance", "back_emf", "inductance", "inertia", "current_limit")
APART = 1.5  # factor by which a unit may differ from its datasheet


def checked_on(actuator: ActuatorParameters, path: str | Path | None = None) -> dict[str, Any]:
    """What a verdict says of its probabilities.

    Parameters
    ----------
    actuator : that is diagnosed
    path : ``calibration.json`` that ``snakemake calibration`` wrote for it; None, the reference actuator's check stands

    Returns
    -------
    ``actuator``, the name of the one that they were checked on, and whether that is the ``same``; of a file also
    ``cases``, ``error`` (value, low, high), ``false_names`` (named, cases) and whether the probabilities ``hold``

    Raises
    ------
    InputError : a file that is no such check, or one of another actuator
    """
    if path is None:
        return {"actuator": "reference actuator, 48 V", "same": asdict(actuator) == reference()}
    read = read_json(path, *NEEDED)
    if read["format"] != FORMAT:
        raise InputError(f"{shown(path)}: format: got {shown(repr(read['format']))}, accepted is {FORMAT!r}")
    try:
        _refuse_another(read["actuator"]["parameters"], asdict(actuator))
        return {
            "actuator": str(read["actuator"]["name"]), "same": True, "cases": int(read["counted"]),
            "error": {k: float(read["calibration_error"][k]) for k in ("value", "low", "high")},
            "false_names": {k: int(read["false_names"][k]) for k in ("named", "cases")},
            "hold": bool(read["holds"]),
        }  # fmt: skip
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from None
    except (LookupError, TypeError, ValueError):
        raise InputError(f"{shown(path)}: not a file that snakemake calibration wrote") from None


def _refuse_another(checked: Mapping[str, Any], mine: Mapping[str, Any]) -> None:
    for name in (*SAME, *ALIKE):
        theirs, ours = float(checked[name]), float(mine[name])
        factor = 1.001 if name in SAME else APART
        if not ours / factor <= theirs <= ours * factor:
            raise InputError(f"is the check of another actuator, {name} {theirs:g}; accepted is about {ours:g}")


def basis(told: Mapping[str, Any]) -> str:
    """On what the probabilities rest, in words."""
    head = "Probabilities are those of the model, not adjusted. How often they are right was checked on "
    if "cases" not in told:
        if told["same"]:
            return f"{head}blind cases of this actuator, the reference actuator."
        return f"{head}blind cases of the {told['actuator']}, not on this one; snakemake calibration does that."
    error, false = told["error"], told["false_names"]
    verdict = "they hold as far as that shows" if told["hold"] else "they do not hold"
    return (
        f"{head}{told['cases']} blind cases of {told['actuator']}: {verdict} (calibration error "
        f"{error['value']:.2g}, {error['low']:.2g} to {error['high']:.2g}; {false['named']} of {false['cases']} "
        "effect-free cases got a name)."
    )
