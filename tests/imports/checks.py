"""Import of written logs, and how far a recording is from what was simulated."""

import numpy as np

from emafault.imports.mapping import complete
from emafault.imports.run import imported

from .measured import ACTUATOR, NOISE
from .writers import parquet

ELECTRICAL = 2.0 * np.pi / ACTUATOR.pole_pairs


def bring(folder, given, **logs):
    """Import logs, written as Parquet, by a map."""
    for name, written in logs.items():
        parquet(folder / f"{name}.parquet", written)
    return imported(complete(given, folder / "map.yaml"), ACTUATOR, NOISE["u"])


def off(recording, truth, voltage=0.056, tail=0.0, current=0.0056, command=1e-9):
    """Channels that are not those of the truth; the angle counts up to whole electrical turns.

    ``voltage``, ``current`` and ``command``: what their errors may be, most of it noise; ``tail``: share of voltages
    that may be further off
    """
    n = len(recording.time)
    errors = {
        "phase_current": (recording.phase_current - truth["phase_current"][:n], current),
        "rotor_speed": (recording.rotor_speed - truth["rotor_speed"][:n], 0.33),
        "output_position": (recording.output_position - truth["output_position"][:n], 1.1e-5),
        "commanded_position": (recording.commanded_position - truth["commanded_position"][:n], command),
    }
    u = np.abs(recording.phase_voltage - truth["phase_voltage"][:n])
    kept = np.sort(u, axis=None)[: int((1.0 - tail) * u.size)]
    turn = recording.rotor_angle - truth["rotor_angle"][:n]
    turn -= ELECTRICAL * np.round(np.median(turn) / ELECTRICAL)
    wrong = [name for name, (error, most) in errors.items() if np.sqrt(np.mean(error**2)) > most]
    wrong += ["phase_voltage"] if np.sqrt(np.mean(kept**2)) > voltage else []
    return wrong + (["rotor_angle"] if np.sqrt(np.mean(turn**2)) > np.deg2rad(0.5) / ACTUATOR.pole_pairs else [])
