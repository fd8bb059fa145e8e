"""What two effects, or an effect and a fault of the measuring chain, leave together that neither leaves alone.

    python -m benchmarks.pairs [--command reversal] [--theta-0 0.7]

Each pair is simulated and the equations are taken at the simulated point: an equation in which one of the two acts
as if the other were off has a mean square of its whitened residual well above what either alone leaves.
"""

import argparse
from collections.abc import Mapping, Sequence
from itertools import combinations, product

from tests.equations.conftest import COMMANDS, machine_of, recorded
from tests.equations.test_residuals import SIZES, mean_squares, truth

#: entry of ``unlisted`` and the diagnosis' parameters of the same
CHAIN = {
    "lag of the voltages": ({"place": "voltage", "form": "lag", "lag": 0.5}, {"lag.voltage_late": 0.5}),
    "lag of the currents": ({"place": "current", "form": "lag", "lag": 0.2}, {"lag.current_late": 0.2}),
    "lag of the angle": ({"place": "angle", "form": "lag", "lag": 0.3}, {"lag.angle_late": 0.3}),
    "lag of the output": ({"place": "output", "form": "lag", "lag": 0.6}, {"lag.output_late": 0.6}),
    "smoothed voltages": ({"place": "voltage", "form": "smoothing", "delay": 0.4}, {"lag.voltage_smoothed": 0.4}),
    "filtered voltages": ({"place": "voltage", "form": "low_pass", "delay": 0.3}, {"lag.voltage_filtered": 0.3}),
    "crosstalk of voltages": (
        {"place": "voltage_a", "form": "crosstalk", "source": "b", "gain": 0.02}, {"crosstalk_voltage.ab": 0.02},
    ),
    "crosstalk of currents": (
        {"place": "current_a", "form": "crosstalk", "source": "b", "gain": 0.02}, {"crosstalk_current.ab": 0.02},
    ),
    "curve of the voltages": ({"place": "voltage", "form": "sensor_curve", "bend": 0.02}, {"curve.voltage": 0.02}),
    "curve of the currents": ({"place": "current", "form": "sensor_curve", "bend": 0.02}, {"curve.current": 0.02}),
    "voltages of duty cycles": (
        {"place": "voltage", "form": "drop", "drop": 0.7, "turn": 0.3}, {"drop.voltage": 0.7, "drop.turn": 0.3},
    ),
    "filter of the command": (
        {"place": "command", "form": "command_filter", "time_constant": 5e-3}, {"command.filter": 5e-3},
    ),
    "feed-forward": ({"place": "command", "form": "feedforward", "gain": 0.5}, {"command.feedforward": 0.5}),
    "drift of a current": (
        {"place": "current_a", "form": "drift", "at_start": 0.03, "at_end": 0.06},
        {"offset_current.a@a.nc": 0.03, "drift_current.a@a.nc": 0.03},
    ),
    "drift of a voltage": (
        {"place": "voltage_a", "form": "drift", "at_start": 0.1, "at_end": 0.2},
        {"offset_voltage.a@a.nc": 0.1, "drift_voltage.a@a.nc": 0.1},
    ),
}  # fmt: skip
MORE = 1.15  # times what either alone leaves
OF_FEW = {"control": 1.5, "commutation": 1.5}  # equations of few rows, whose noise is less well known


def left(members: Sequence[str], command: str, theta_0: float) -> dict[str, float]:
    """Equation -> mean square of the whitened residual where all members act, at the simulated point."""
    effects = {m: SIZES[m][0] for m in members if m in SIZES}
    chain = [CHAIN[m] for m in members if m in CHAIN]
    recording = recorded(command, effects=effects, theta_0=theta_0, unlisted=tuple(entry for entry, _ in chain))
    machine = machine_of({"a.nc": recording})
    at = truth(machine, recording, effects)
    for _, values in chain:
        at |= values
    return mean_squares(machine, at)


def beyond(both: Mapping[str, float], *alone: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Equations in which two leave more together: by how much, and what either alone leaves at most."""
    out = {}
    for equation, value in both.items():
        most = max(a.get(equation, 1.0) for a in alone)
        if value > OF_FEW.get(equation, MORE) * most:
            out[equation] = value, most
    return out


def main() -> None:
    """Print every pair that leaves more than its members."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--command", choices=COMMANDS, default="reversal")
    parser.add_argument("--theta-0", type=float, default=0.7, help="rad")
    args = parser.parse_args()
    at = args.command, args.theta_0
    none = left((), *at)
    alone = {m: left((m,), *at) for m in (*SIZES, *CHAIN)}
    for m in CHAIN:
        for equation, (value, most) in beyond(alone[m], none).items():
            print(f"{m} alone: {equation} {value:.2f}, {most:.2f} without it")
    pairs = [*combinations(SIZES, 2), *product(SIZES, CHAIN), *combinations(CHAIN, 2)]
    more = 0
    for one, other in pairs:
        for equation, (value, most) in beyond(left((one, other), *at), none, alone[one], alone[other]).items():
            more += 1
            print(f"{one}, {other}: {equation} {value:.2f}, either alone {most:.2f}", flush=True)
    print(f"{len(pairs)} pairs, {more} equations in which two leave more together")


if __name__ == "__main__":
    main()
