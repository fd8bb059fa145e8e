"""What stands beside an effect in a mixed case: faults of the measuring chain and another controller, put in by the
generator's side. None of it is in the catalogue; those ``OUTSIDE`` are in no grammar of the diagnosis either.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..recording import Recording

Change = Callable[[Recording, np.random.Generator], Recording]


def _ends(recording: Recording, change: np.ndarray) -> np.ndarray | None:
    end = recording.phase_current_end
    return None if end is None else end + change


def _late(x: np.ndarray, share: float) -> np.ndarray:
    before = np.concatenate([x[:1], x[:-1]])
    return (1.0 - share) * x + share * before


def lag_voltage(recording: Recording, rng: np.random.Generator) -> Recording:
    """The voltages are recorded up to one sample late."""
    return replace(recording, phase_voltage=_late(recording.phase_voltage, rng.uniform(0.4, 1.0)))


def spikes_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """Single samples of one current are far off."""
    current = recording.phase_current.copy()
    hit = rng.choice(len(current), max(3, len(current) // 200), replace=False)
    current[hit, rng.integers(3)] += rng.normal(0.0, 2.0, len(hit))
    return replace(recording, phase_current=current)


def held_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """Samples of the currents repeat the one before."""
    current = recording.phase_current.copy()
    for k in np.sort(rng.choice(np.arange(1, len(current)), len(current) // 50, replace=False)):
        current[k] = current[k - 1]
    return replace(recording, phase_current=current)


def steps_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """A converter's step of 0.02 to 0.05 A."""
    step = rng.uniform(0.02, 0.05)
    end = recording.phase_current_end
    return replace(
        recording,
        phase_current=step * np.round(recording.phase_current / step),
        phase_current_end=None if end is None else step * np.round(end / step),
    )


def drift_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """The offset of one current drifts."""
    change = np.zeros_like(recording.phase_current)
    change[:, rng.integers(3)] = rng.uniform(0.04, 0.12) * recording.time / recording.time[-1]
    return replace(
        recording, phase_current=recording.phase_current + change, phase_current_end=_ends(recording, change)
    )


def crosstalk_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """One current shows in another's channel."""
    to, source = rng.choice(3, 2, replace=False)
    gain, end = rng.uniform(0.01, 0.04), recording.phase_current_end
    current = recording.phase_current.copy()
    current[:, to] += gain * recording.phase_current[:, source]
    if end is not None:
        end = end.copy()
        end[:, to] += gain * recording.phase_current_end[:, source]  # type: ignore[index]
    return replace(recording, phase_current=current, phase_current_end=end)


def mains_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """The currents pick the mains up together."""
    wave = 0.06 * np.sin(2.0 * np.pi * 50.0 * recording.time + rng.uniform(0.0, 6.28))[:, None]
    return replace(recording, phase_current=recording.phase_current + wave, phase_current_end=_ends(recording, wave))


def wander_current(recording: Recording, rng: np.random.Generator) -> Recording:
    """The offset of one current walks at random."""
    change = np.zeros_like(recording.phase_current)
    walk = np.cumsum(rng.standard_normal(len(change)))
    change[:, rng.integers(3)] = 0.05 * walk / np.sqrt(len(change))
    return replace(
        recording, phase_current=recording.phase_current + change, phase_current_end=_ends(recording, change)
    )


def bent_voltage(recording: Recording, rng: np.random.Generator) -> Recording:
    """The voltage channels are bent: a cubic part of their range."""
    bend = rng.uniform(0.002, 0.006)
    v = recording.phase_voltage
    return replace(recording, phase_voltage=v * (1.0 - bend * (v / 24.0) ** 2))


def hum_voltage(recording: Recording, rng: np.random.Generator) -> Recording:
    """A hum whose strength follows the current lies on one voltage."""
    v = recording.phase_voltage.copy()
    j = rng.integers(3)
    wave = np.sin(2.0 * np.pi * rng.uniform(80.0, 400.0) * recording.time)
    v[:, j] += 0.02 * np.abs(recording.phase_current[:, j]) * wave
    return replace(recording, phase_voltage=v)


DISTURBANCES: dict[str, Change] = {
    f.__name__: f
    for f in (
        lag_voltage, spikes_current, held_current, steps_current, drift_current, crosstalk_current, mains_current,
        wander_current, bent_voltage, hum_voltage,
    )
}  # fmt: skip
OUTSIDE = ("wander_current", "bent_voltage", "hum_voltage")
#: settings of the controller and how far off they may be, either way
CONTROLLER = ("position_gain", "speed_gain", "speed_integral_gain")
FARTHEST = 0.5


def disturbed(recordings: Mapping[str, Recording], name: str, seed: int) -> dict[str, Recording]:
    """Recordings with a disturbance put in; of the same kind and with its own draw in each.

    Raises
    ------
    InputError : an unknown disturbance
    """
    if name not in DISTURBANCES:
        raise InputError(f"disturbance: '{name}' is not known, accepted are {', '.join(DISTURBANCES)}")
    found = {}
    for n, (file, recording) in enumerate(sorted(recordings.items())):
        # which channel and how strongly belongs to the bench, what is random in time to the recording
        rng = np.random.default_rng([seed, 0 if name not in ("spikes_current", "held_current") else n])
        found[file] = DISTURBANCES[name](recording, rng)
    return found


def draw_controller(seed: int) -> dict[str, float]:
    """Factors of the controller's gains, within 50 % either way."""
    rng = np.random.default_rng([9, seed])
    return {name: float(1.0 + rng.uniform(-FARTHEST, FARTHEST)) for name in CONTROLLER}
