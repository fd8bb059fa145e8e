"""The command beside the output that follows it: which way it counts, and in which unit.

A position controller turns the output towards the command, at its gain times the error (rad/s), no faster than the
actuator can and no further than its end stops. A replay of this alone, with the gain that suits best, tells a command
that is reversed or in another unit: what a bench's own gains, limits, lags and loads do to the way there is far less.
"""

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .recording import Recording

LEAST_TRAVEL = 5.0  # rad of the rotor; less of it says nothing of the command
INSTANTS = 500  # of a replay
GAINS = np.geomspace(0.05, 20.0, 14)  # times the actuator's position gain
FULL_SPEED = 0.5  # of the speed limit; an output that is faster may be as fast as its bench lets it be
RATE_OVER = 0.01  # s, over which the output's speed is taken
MARGIN = 10.0  # times the misfit, by which another reading must be better; honest gains, off by five, come to 3
FOLLOWED = 0.01  # of the output's mean square, below which a misfit is no contradiction
UNEXPLAINED = 0.9  # of it, where 1 is what standing still leaves


def refuse_unfollowed(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse a command that the output does not follow; where the output hardly moves any is taken.

    Raises
    ------
    InputError : naming the file, and the sign or unit in which the output would follow
    """
    if np.ptp(recording.rotor_angle) < LEAST_TRAVEL:
        return
    command, output = recording.commanded_position, recording.output_position
    moved = float(np.ptp(output))
    if np.ptp(command) == 0.0 and abs(command[0] - output[0]) < 0.5 * moved:
        raise InputError(
            f"{path}: commanded_position never changes while output_position moves by {moved:.3g} rad; the channel is "
            "dead"
        )
    units = {
        1.0: "rad",
        -1.0: "rad, reversed",
        180.0 / np.pi: "degrees",
        0.5 / np.pi: "turns",
        1e3: "mrad",
        actuator.gear_ratio: "rad of the rotor",
    }
    left = dict(zip(units, _misfits(recording, actuator, np.array(list(units))), strict=True))
    best = min(left, key=lambda factor: left[factor])
    if left[1.0] > max(MARGIN * left[best], FOLLOWED):
        if best < 0.0:
            raise InputError(f"{path}: commanded_position goes against output_position; its sign is reversed")
        raise InputError(
            f"{path}: commanded_position is {best:.3g} times what output_position follows, as if in {units[best]}; "
            "accepted is rad of the output"
        )
    if left[1.0] > UNEXPLAINED:
        raise InputError(
            f"{path}: output_position does not follow commanded_position, in no unit and with neither sign; one of "
            "the channels is mistaken"
        )


def _misfits(recording: Recording, actuator: ActuatorParameters, factors: np.ndarray) -> np.ndarray:
    """(factor,) what a replay leaves of the output's mean square where the command is a factor times what is followed,
    with the gain that leaves least; of a recording that was cut or whose zeros are apart the motions are compared."""
    at = np.unique(np.linspace(0, len(recording.time) - 1, INSTANTS).astype(int))
    time, output = recording.time[at], recording.output_position[at]
    target = recording.commanded_position[at] / factors[:, None]
    target = np.stack([target, target - target[:, :1] + output[0]], axis=1)  # (factor, 2, instant)
    over = max(1, round(RATE_OVER / recording.interval))
    reached = np.abs(recording.output_position[over:] - recording.output_position[:-over]).max()
    fastest = max(reached / (over * recording.interval), FULL_SPEED * actuator.speed_limit / actuator.gear_ratio)
    lowest, highest = min(-actuator.end_stop, output.min()), max(actuator.end_stop, output.max())
    gain = GAINS * actuator.position_gain
    position = np.full((len(factors), 2, len(gain)), output[0])
    left = np.zeros_like(position)
    for n, step in enumerate(np.diff(time), start=1):
        way = (target[..., n - 1, None] - position) * -np.expm1(-gain * step)
        position = np.clip(position + np.clip(way, -fastest * step, fastest * step), lowest, highest)
        left += (output[n] - position) ** 2
    return left.min(axis=(1, 2)) / max(float(np.sum((output - output[0]) ** 2)), 1e-30)
