"""The nominal actuator with SciPy's solve_ivp, restarted at every event: what a general integrator costs.

Plain Python, no effects and no faults. The states are the phase currents (A), the motor's speed (rad/s) and angle
(rad), and the charges (A s) from which the recorded mean currents follow.
"""

import numpy as np
from scipy.integrate import solve_ivp

from emafault.actuator.parameters import ActuatorParameters

AXIS = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
PAIR = ((0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1))  # driven + and - from 30, 90, ... 330 electrical degrees


def trapezoid(x: np.ndarray) -> np.ndarray:
    """Unit trapezoid with a plateau of 120 degrees; x electrical rad."""
    x = x % (2.0 * np.pi)
    folded = np.where(x < np.pi, x, x - np.pi)
    return np.where(x < np.pi, 1.0, -1.0) * np.minimum(1.0, np.minimum(folded, np.pi - folded) * (6.0 / np.pi))


class Circuit:
    """Equations between two events: commutation, bridge, diode of the off phase and sticking stay as they are."""

    def __init__(self, p: ActuatorParameters):
        self.p = p
        self.sector, self.high, self.diode, self.moving = -1, True, 0, 0
        self.reference = 0.0

    @property
    def roles(self) -> tuple[int, int, int]:
        """Phases driven +, driven - and off."""
        plus, minus = PAIR[self.sector % 6]
        return plus, minus, 3 - plus - minus

    def back_emf(self, y: np.ndarray) -> np.ndarray:
        """(phase,) k_j f_j (V s/rad)."""
        return self.p.back_emf * trapezoid(self.p.pole_pairs * y[4] - AXIS)

    def voltages(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Terminal voltages less drops and back-EMF, (phase,); back-EMF (V); which conduct; the star point (V)."""
        p = self.p
        plus, minus, off = self.roles
        emf = self.back_emf(y) * y[3]
        terminal = np.zeros(3)
        terminal[plus if self.high else minus] = p.bus_voltage
        terminal[off] = -p.diode_voltage if self.diode > 0 else p.bus_voltage + p.diode_voltage
        resistance = np.full(3, p.resistance + p.switch_resistance)
        resistance[off] = p.resistance
        conducts = np.ones(3, bool)
        conducts[off] = self.diode != 0
        net = terminal - resistance * y[:3] - emf
        return net, emf, conducts, float(net[conducts].mean())

    def settle(self, y: np.ndarray) -> None:
        """Comparator, and the diode of the off phase, where a segment begins."""
        plus, minus, off = self.roles
        pair = 0.5 * (y[plus] - y[minus])
        if self.high and pair >= self.reference + self.p.hysteresis - 1e-9:
            self.high = False
        elif not self.high and pair <= self.reference - self.p.hysteresis + 1e-9:
            self.high = True
        self.diode = int(np.sign(y[off]))
        if self.diode == 0:
            _, emf, _, star = self.voltages(y)
            if star + emf[off] < -self.p.diode_voltage:
                self.diode = 1
            elif star + emf[off] > self.p.bus_voltage + self.p.diode_voltage:
                self.diode = -1

    def slopes(self, t: float, y: np.ndarray) -> np.ndarray:
        """Time derivative of the states."""
        p = self.p
        net, _, conducts, star = self.voltages(y)
        out = np.zeros(8)
        out[:3] = np.where(conducts, (net - star) / p.inductance, 0.0)
        if self.moving:
            torque = self.back_emf(y) @ y[:3]
            out[3] = (torque - p.viscous_friction * y[3] - self.moving * p.coulomb_friction) / p.inertia
        out[4], out[5:] = y[3], y[:3]
        return out

    def trip(self, t: float, y: np.ndarray) -> float:
        """Comparator: zero where the bridge switches."""
        plus, minus, _ = self.roles
        side = 1.0 if self.high else -1.0
        return side * (0.5 * (y[plus] - y[minus]) - self.reference) - self.p.hysteresis

    def edge(self, t: float, y: np.ndarray) -> float:
        """Electrical angle to the next commutation in the direction of motion (rad), negative before it."""
        side = 1 if self.moving >= 0 else 0
        return (1.0 if side else -1.0) * (
            self.p.pole_pairs * y[4] - np.pi / 6.0 - (self.sector + side) * np.pi / 3.0
        ) - 1e-12

    def extinction(self, t: float, y: np.ndarray) -> float:
        """Free-wheel current of the off phase, falling to zero (A)."""
        return self.diode * y[self.roles[2]] if self.diode else 1.0

    def sticking(self, t: float, y: np.ndarray) -> float:
        """Moving: speed falling to zero (rad/s). At rest: torque left below the static limit (N m)."""
        if self.moving:
            return self.moving * y[3]
        return self.p.static_over_coulomb * self.p.coulomb_friction - abs(self.back_emf(y) @ y[:3])


def simulate_solve_ivp(
    p: ActuatorParameters, command: np.ndarray, duration: float, interval: float, rtol: float = 1e-7
) -> dict[str, np.ndarray]:
    """Simulate the nominal actuator from rest.

    Parameters
    ----------
    command : (tick+1,) user-shaft command at the control ticks (rad)
    duration, interval : s; the interval is a multiple of the control period

    Returns
    -------
    phase_current, phase_current_end (A): (1, time, phase); rotor_speed (rad/s), rotor_angle (rad): (1, time)
    """
    circuit = Circuit(p)
    events = [circuit.trip, circuit.edge, circuit.extinction, circuit.sticking]
    for event, direction in zip(events, (1.0, 1.0, -1.0, -1.0), strict=True):
        event.__func__.terminal, event.__func__.direction = True, direction  # type: ignore[attr-defined]
    every = round(interval / p.control_period)
    y = np.zeros(8)
    shaft = integral = 0.0
    kept = [y]
    for tick in range(round(duration / p.control_period)):
        wanted = np.clip(p.gear_ratio * p.position_gain * (command[tick] - shaft), -p.speed_limit, p.speed_limit)
        error = wanted - y[3]
        advanced = integral + error * p.control_period
        if abs(p.speed_gain * error + p.speed_integral_gain * advanced) <= p.current_limit:
            integral = advanced
        demand = p.speed_gain * error + p.speed_integral_gain * integral
        circuit.reference = float(np.clip(demand, -p.current_limit, p.current_limit))
        t, end = tick * p.control_period, (tick + 1) * p.control_period
        while t < end - 1e-13:
            circuit.settle(y)
            found = solve_ivp(circuit.slopes, (t, end), y, method="RK45", rtol=rtol, atol=1e-9, events=events)
            t, y = found.t[-1], found.y[:, -1].copy()
            hit = [len(times) > 0 for times in found.t_events]
            plus, minus, off = circuit.roles
            if hit[0]:
                circuit.high = not circuit.high
            if hit[1]:
                circuit.sector += 1 if circuit.moving >= 0 else -1
            if hit[2]:
                y[off] = 0.0
                y[minus] = -y[plus]
            if hit[3] and circuit.moving:
                circuit.moving, y[3] = 0, 0.0
            elif hit[3]:
                circuit.moving = int(np.sign(circuit.back_emf(y) @ y[:3]))
            play = y[4] / p.gear_ratio + 0.5 * p.backlash * np.array([-1.0, 1.0])
            shaft = float(np.clip(np.clip(shaft, *play), -p.end_stop, p.end_stop))
        if (tick + 1) % every == 0:
            kept.append(y)
    states = np.array(kept)
    return {
        "phase_current": np.diff(states[:, 5:], axis=0)[None] / interval,
        "phase_current_end": states[None, 1:, :3],
        "rotor_speed": np.diff(states[:, 4])[None] / interval,
        "rotor_angle": states[None, 1:, 4],
    }
