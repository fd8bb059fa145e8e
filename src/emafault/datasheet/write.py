"""An identified machine as a file: each number in the unit that the datasheet has it in, with its source."""

import json

from ..units import quantity
from .compose import Composed, Machine
from .identify import OF
from .keys import KEYS
from .sheet import PLUS_MINUS, Number, Sheet, split

#: parameter of the equations -> number of the file, and how many of the parameter make one
NUMBERS = {
    "bus_voltage": ("supply_voltage", 1.0), "resistance": ("resistance", 2.0), "inductance": ("inductance", 2.0),
    "back_emf": ("torque_constant", 2.0), "inertia": ("rotor_inertia", 1.0),
    "viscous_friction": ("viscous_friction", 1.0), "coulomb_friction": ("coulomb_friction", 1.0),
    "backlash": ("backlash", 1.0), "position_gain": ("position_gain", 1.0), "speed_gain": ("speed_gain", 1.0),
    "speed_integral_gain": ("speed_integral_gain", 1.0),
}  # fmt: skip


def completed(sheet: Sheet, machine: Machine, files: int) -> str:
    """The text of a file with every number that the sheet says or the recordings told.

    Parameters
    ----------
    files : number of recordings that it was identified in
    """
    lines = [
        f"# identified by emafault in {files} healthy recording(s); tolerance: half of a 90 % interval, over the value",
        f"name: {_quoted(sheet.name)}",
    ]
    told = {NUMBERS[n][0]: (NUMBERS[n][1], p) for n, p in machine.parameters.items() if n in OF and _identified(p)}
    for key in KEYS:
        given = sheet.get(key)
        if key in told:
            factor, p = told[key]
            lines.append(f"{key}: {_entry(key, factor * p.value, p.tolerance, given)}")
        elif key == "load_inertia" and "rotor_inertia" in told:
            continue  # the identified inertia is of both
        elif given is not None:
            lines.append(f"{key}: {_given(given)}")
    return "\n".join(lines) + "\n"


def _identified(p: Composed) -> bool:
    return p.source == "identified"


def _entry(key: str, value: float, tolerance: float, given: Number | None) -> str:
    unit = (split(PLUS_MINUS.split(given.text)[0])[1] if given else "") or split(KEYS[key].example)[1]
    number = value / quantity(f"1.0 {unit}", KEYS[key].unit, key)
    of = f", datasheet: {_quoted(given.datasheet or given.text)}" if given else ""
    text = f"{number:.6g} {unit}"
    share = _quoted(f"{max(100.0 * tolerance, 1e-4):.2g} %")
    return f"{{value: {_quoted(text)}, tolerance: {share}, source: identified{of}}}"


def _given(given: Number) -> str:
    if given.source == "datasheet":
        return _quoted(given.text)
    text, *spread = PLUS_MINUS.split(given.text)
    share = spread[0].strip() if spread else f"{100.0 * given.tolerance:.3g} %"
    tolerance = f", tolerance: {_quoted(share)}" if given.tolerance else ""
    of = f", datasheet: {_quoted(given.datasheet)}" if given.datasheet else ""
    return f"{{value: {_quoted(text.strip())}{tolerance}, source: {given.source}{of}}}"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
