"""At the simulated point the residual of every equation is the sensors' noise, whatever effect is on."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from emafault.actuator.motor import AXIS
from emafault.actuator.sensors import SensorNoise
from emafault.diagnosis.linear import compressed_columns, correct, disturbance
from emafault.diagnosis.whitening import whiten
from emafault.effects import EFFECTS

from .conftest import ACTUATOR, COMMANDS, NOISE, machine_of, recorded

#: a clearly visible size of each effect, and the block of rows in which it shows
SIZES = {
    "magnet_temperature": ({"alpha_m": -1e-3}, "electrical_a"),
    "unit_calibration": ({"R_scale": 1.08, "k_scale": 0.96}, "electrical_a"),
    "contact_resistance": ({"R_x_a": 0.05, "R_x_b": 0.0, "R_x_c": 0.02}, "electrical_a"),
    "inductance_tolerance": ({"L_scale": 1.25}, "electrical_a"),
    "inductance_saturation": ({"s": 0.05}, "electrical_a"),
    "back_emf_shape": ({"width": 105.0, "h5": 0.02, "h7": -0.02}, "electrical_a"),
    "dynamic_eccentricity": ({"d": 0.04, "psi": 0.6}, "electrical_a"),
    "self_heating": ({"heating_rate": 0.333, "Rth": 3.0}, "electrical_a"),
    "current_gain": ({"g_a": 1.02, "g_b": 0.99, "g_c": 1.0}, "sensor_current"),
    "current_offset": ({"o_a": 0.05, "o_b": -0.02, "o_c": 0.0}, "sensor_current"),
    "voltage_gain": ({"g_a": 1.01, "g_b": 0.99, "g_c": 1.0}, "electrical_a"),
    "virtual_neutral": ({"on": 1.0}, "electrical_a"),
    "speed_latency": ({"tau": 2e-3}, "sensor_speed"),
    "speed_scale": ({"scale": 1.01}, "sensor_speed"),
    "angle_offset": ({"offset": 3.0}, "electrical_a"),
    "cogging": ({"a": 0.01}, "torque"),
    "friction_level": ({"scale": 1.5}, "torque"),
    "viscous_friction": ({"scale": 2.5}, "torque"),
    "friction_temperature": ({"beta": -8e-3}, "torque"),
    "stribeck": ({"a": 0.03, "w_s": 15.0}, "torque"),
    "friction_asymmetry": ({"a": 0.12}, "torque"),
    "load_constant": ({"T": 8.0}, "torque"),
    "load_spring": ({"c": 120.0}, "torque"),
    "inertia": ({"scale": 1.25}, "torque"),
    "backlash": ({"blk": 8e-4}, "position"),
    "compliance": ({"K": 5000.0, "C": 300.0}, "position"),
    "bus_voltage": ({"Vdc": 45.0}, "bus"),
    "bus_resistance": ({"R": 0.4}, "bus"),
    "control_delay": ({"delay": 4e-4}, "control"),
    "hall_displacement": ({"d_a": 4.0, "d_b": -3.0, "d_c": 1.0}, "commutation"),
}
FAULT = (0.05, 0.02, 0.07, 0.1, -0.06, 35.0)


def internal(effect, values):
    """Parameters as the equations take them."""
    if effect == "dynamic_eccentricity":
        d, psi = values["d"], values["psi"]
        return {"d_cos": d * np.cos(psi), "d_sin": d * np.sin(psi)}
    if effect == "stribeck":
        return {"a": values["a"], "log_w_s": np.log(values["w_s"])}
    if effect == "compliance":
        return {"flexibility": 1.0 / values["K"], "C": values["C"]}
    return values


def mean_squares(machine, values, robust=("control", "commutation")):
    """Equation -> mean square of the whitened residual; of the control equations a robust one.

    At a reversal the loops' own dynamics between samples show in single rows, which a diagnosis leaves out.
    """
    out = {}
    for block in machine.blocks(values, "a.nc"):
        rows = whiten(block.bands, block.usable, block.residual[:, None].copy())[:, 0]
        square = rows[block.usable] ** 2
        out[block.equation] = float(np.median(square) / 0.455 if block.equation in robust else np.mean(square))
    return out


def truth(machine, recording, effects=None, fault=(0.0,) * 6):
    """Values of every parameter at the simulated point."""
    values = {n: p.off for n, p in machine.parameters.items()}
    values["dT@a.nc"] = fault[5] - (recording.ambient_temperature - 20.0)
    for name, x in zip(("Na", "Nb", "Nc", "xi_x", "xi_y"), fault[:5], strict=True):
        values[f"{name}@a.nc"] = x
    for effect, given in (effects or {}).items():
        values |= {f"{effect}.{n}": x for n, x in internal(effect, given).items()}
    return values


@pytest.mark.parametrize("theta_0", [0.0, 2.1])
@pytest.mark.parametrize("command", COMMANDS)
def test_white_at_the_simulated_point(command, theta_0):
    recording = recorded(command, fault=FAULT, theta_0=theta_0, health="seeded")
    machine = machine_of({"a.nc": recording})
    found = mean_squares(machine, truth(machine, recording, fault=FAULT))
    for equation in (
        "electrical_a",
        "electrical_b",
        "electrical_c",
        "sensor_current",
        "sensor_speed",
        "torque",
        "position",
        "bus",
    ):
        assert 0.75 < found[equation] < 1.2, equation  # balanced currents are less noisy than each alone
    assert found["control"] < 1.5 and 0.7 < found["commutation"] < 1.5


@pytest.mark.parametrize("theta_0", [0.7, 2.1])
def test_the_control_law_holds_where_a_step_is_braked(theta_0):
    recording = recorded("step", interval=5e-5, theta_0=theta_0)
    machine = machine_of({"a.nc": recording})
    block = next(b for b in machine.blocks(truth(machine, recording), "a.nc") if b.equation == "control")
    assert block.usable.sum() > 10
    # the changes add up to that from the first row to the last: 0.04 A where what a commutation adds is left out
    assert abs(block.residual[block.usable].sum()) < 0.015


@pytest.mark.parametrize("command", ["reversal", "sine"])
def test_the_controller_saw_the_recorded_speed_whatever_dynamics_it_has(command):
    recording = recorded(command, effects={"speed_latency": {"tau": 2e-3}})
    machine = machine_of({"a.nc": recording})
    found = mean_squares(machine, truth(machine, recording))
    assert found["sensor_speed"] > 50.0
    assert found["control"] < 1.3


RECORDER = {
    "lag of the output": ({"place": "output", "form": "lag", "lag": 0.6}, {"lag.output_late": 0.6}),
    "lag of the currents": ({"place": "current", "form": "lag", "lag": 0.5}, {"lag.current_late": 0.5}),
    "lag of the speed": ({"place": "speed", "form": "lag", "lag": 0.7}, {"lag.speed_late": 0.7}),
    "a speed that is early": ({"place": "speed", "form": "lag", "lag": -0.7}, {"lag.speed_early": 0.7}),
    "filter of the speed": ({"place": "speed", "form": "low_pass", "delay": 4.0}, {"lag.speed_filtered": 4.0}),
    "second-order filter of the speed": (
        {"place": "speed", "form": "butterworth", "delay": 4.0},
        {"lag.speed_butterworth": 4.0},
    ),
    "average of the speed": ({"place": "speed", "form": "averaging", "samples": 9.0}, {"lag.speed_averaged": 4.0}),
    "lag of one current": ({"place": "current_b", "form": "lag", "lag": 0.3}, {"lag.current_b_late": 0.3}),
    "lag of one voltage": ({"place": "voltage_c", "form": "lag", "lag": -0.4}, {"lag.voltage_c_early": 0.4}),
    "filter of the currents": ({"place": "current", "form": "low_pass", "delay": 0.3}, {"lag.current_filtered": 0.3}),
    "drift of a current": (
        {"place": "current_a", "form": "drift", "at_start": 0.03, "at_end": 0.06},
        {"offset_current.a@a.nc": 0.03, "drift_current.a@a.nc": 0.03},
    ),
}


@pytest.mark.parametrize("fault", RECORDER)
def test_the_controller_does_not_see_what_a_recorder_makes_of_a_signal(fault):
    entry, values = RECORDER[fault]
    recording = recorded("reversal", unlisted=(entry,))
    machine = machine_of({"a.nc": recording})
    assert mean_squares(machine, truth(machine, recording) | values)["control"] < 1.3


@pytest.mark.parametrize("command", ["reversal", "sine"])
def test_white_with_a_back_emf_that_has_harmonics(command):
    sizes = {"h3": 0.03, "h5": -0.02, "h13": 0.01}
    entry = {"place": "emf", "form": "harmonics", **sizes}
    recording = recorded(command, unlisted=(entry,), fault=FAULT, health="seeded")
    machine = machine_of({"a.nc": recording})
    without = truth(machine, recording, fault=FAULT)
    before, after = (
        mean_squares(machine, without | more) for more in ({}, {f"emf.{name}": x for name, x in sizes.items()})
    )
    for equation in ("electrical_a", "electrical_b", "electrical_c", "torque"):
        assert 0.75 < after[equation] < 1.2 and before[equation] > 1.3, equation


def test_white_with_currents_that_pick_up_voltages():
    entries = (
        {"place": "current", "form": "pickup", "gain": 3e-3},
        {"place": "current_b", "form": "pickup", "gain": 2e-3},
    )
    recording = recorded("reversal", unlisted=entries)
    machine = machine_of({"a.nc": recording})
    values = truth(machine, recording)
    of = {"pickup.current": 3e-3, "pickup.current_b": 2e-3}
    none, alike, both = (mean_squares(machine, values | {n: of[n] for n in list(of)[:k]}) for k in range(3))
    for name in ("sensor_current", "torque"):  # the sum shows what one has of its own
        assert both[name] < 1.2 < 1.5 < alike[name] < none[name], name
    assert 5.0 * alike["torque"] < none["torque"]


def test_white_with_a_winding_that_differs():
    entry = {"place": "winding", "form": "coefficient", "back_emf_b": 0.03, "inductance_b": -0.3}
    recording = recorded("reversal", unlisted=(entry,), fault=FAULT, health="seeded")
    machine = machine_of({"a.nc": recording})
    without = truth(machine, recording, fault=FAULT)
    of = {"winding.back_emf_b": 0.03, "winding.inductance_b": -0.3}
    none, back_emf, both = (mean_squares(machine, without | {n: of[n] for n in list(of)[:count]}) for count in range(3))
    assert both["electrical_b"] < 1.2 < 1.1 * back_emf["electrical_b"] < none["electrical_b"]
    assert both["torque"] < 1.2 < none["torque"]


def test_a_rotor_that_is_salient_adds_the_change_of_its_flux_to_the_voltages():
    """Of a recording whose voltages have it: L0 s cos(2 (p theta - alpha_j)) i_j, less what it was, over the interval;
    the torque has its derivative by the angle, times half the square of the current."""
    clean = replace(NOISE, **dict.fromkeys(vars(NOISE), 0.0))
    plain, size, shift = recorded("sine", noise=clean), 0.04, 0.3
    angles = ACTUATOR.pole_pairs * plain.rotor_angle[:, None] - AXIS
    flux = ACTUATOR.inductance * size * np.cos(2.0 * angles - shift) * plain.phase_current_end
    salient = replace(
        plain, phase_voltage=plain.phase_voltage + np.diff(flux, axis=0, prepend=flux[:1]) / plain.interval
    )
    of = {"saliency.cos": size * np.cos(shift), "saliency.sin": size * np.sin(shift)}
    found = []
    for recording, more in ((plain, {}), (salient, of), (salient, {})):
        machine = machine_of({"a.nc": recording})
        blocks = machine.blocks(truth(machine, recording) | more, "a.nc", wanted=set(of))
        found.append({b.equation: b for b in blocks})
    before, after, without = found
    for equation in ("electrical_a", "electrical_b", "electrical_c"):
        of_rows = slice(2, None)
        residuals = (x[equation].residual[of_rows] for x in (after, without))
        off = [np.std(x - before[equation].residual[of_rows]) for x in residuals]
        assert off[0] < 1e-3 * off[1], equation
    torque = 0.5 * ACTUATOR.inductance * plain.phase_current**2 * -2.0 * ACTUATOR.pole_pairs * size
    angles -= 0.5 * ACTUATOR.pole_pairs * plain.rotor_speed[:, None] * plain.interval
    torque = np.sum(torque * np.sin(2.0 * angles - shift), axis=1)
    torque[:-1] = 0.5 * (torque[:-1] + torque[1:])
    added = (before["torque"].residual - after["torque"].residual)[2:-2]
    assert np.std(added - torque[2:-2]) < 0.05 * np.std(torque)


def test_inductances_between_phases_add_the_other_s_flux():
    clean = replace(NOISE, **dict.fromkeys(vars(NOISE), 0.0))
    plain = recorded("sine", noise=clean)
    of = {"mutual.ab": 0.04, "mutual.bc": -0.02, "mutual.ca": 0.01}
    shares = np.array([[0.0, 0.04, 0.01], [0.04, 0.0, -0.02], [0.01, -0.02, 0.0]])
    flux = ACTUATOR.inductance * plain.phase_current_end @ shares
    coupled = replace(
        plain, phase_voltage=plain.phase_voltage + np.diff(flux, axis=0, prepend=flux[:1]) / plain.interval
    )
    residuals = []
    for recording, more in ((plain, {}), (coupled, of), (coupled, {})):
        machine = machine_of({"a.nc": recording})
        blocks = machine.blocks(truth(machine, recording) | more, "a.nc", wanted=())
        residuals.append({b.equation: b.residual[2:] for b in blocks})
    before, after, without = residuals
    for equation in ("electrical_a", "electrical_b", "electrical_c"):
        off = [np.std(x[equation] - before[equation]) for x in (after, without)]
        assert off[0] < 1e-3 * off[1], equation


def test_white_with_a_load_and_a_bus_voltage_of_the_recording_s_own():
    entries = (
        {"place": "bus_voltage", "form": "drift", "at_start": 0.4, "at_end": 1.0},
        {"place": "torque", "form": "pulse", "jump": -0.008, "time": 0.0, "until": 1.0},
    )
    recording = recorded("reversal", unlisted=entries)
    machine = machine_of({"a.nc": recording})
    own = {"offset_bus_voltage.all@a.nc": 0.4, "drift_bus_voltage.all@a.nc": 0.6, "load.each@a.nc": 0.008}
    before, after = (mean_squares(machine, truth(machine, recording) | more) for more in ({}, own))
    for equation in ("bus", "torque"):
        assert 0.75 < after[equation] < 1.2 and before[equation] > 10.0, equation


def test_white_with_an_angle_whose_zero_drifts():
    """As of an encoder that is homed anew, and slips on its shaft."""
    recording = recorded("reversal", unlisted=({"place": "angle", "form": "drift", "at_start": 0.004, "at_end": 0.01},))
    machine = machine_of({"a.nc": recording})
    length = len(recording.time) * recording.interval
    own = {"offset_angle.all@a.nc": 0.004, "rate_angle.all": 0.006 / length}
    before, after = (mean_squares(machine, truth(machine, recording) | more) for more in ({}, own))
    for equation in ("electrical_a", "electrical_b", "electrical_c", "commutation"):
        assert before[equation] > 1.5, equation
        assert 0.75 < after[equation] < 1.2, equation


def test_the_columns_of_a_drifting_angle_are_derivatives():
    recording = recorded("reversal")
    machine = machine_of({"a.nc": recording})
    at = truth(machine, recording)
    blocks = {b.equation: b for b in machine.blocks(at, "a.nc")}
    for name, step in (("offset_angle.all@a.nc", 1e-4), ("rate_angle.all", 1e-4)):
        off = [
            {b.equation: b.residual for b in machine.blocks(at | {name: x}, "a.nc", wanted=())} for x in (step, -step)
        ]
        for equation in ("electrical_b", "sensor_speed", "commutation", "position"):
            wanted = (off[0][equation] - off[1][equation]) / (2.0 * step)
            found = blocks[equation].columns[name]
            size = max(np.std(wanted), np.mean(np.abs(wanted)))  # an offset does not show in all of them
            assert np.std(found - wanted) < 0.1 * size + 1e-6, (name, equation)


@pytest.mark.parametrize("beside", [{}, {"compliance": {"K": 5000.0, "C": 300.0}}])
def test_a_load_of_the_recording_s_own_is_that_of_the_catalogue(beside):
    recording = recorded("reversal", effects={"load_constant": {"T": 4.0}, **beside})
    machine = machine_of({"a.nc": recording})
    listed, own = (
        {b.equation: b.residual for b in machine.blocks(values, "a.nc", wanted=())}
        for values in (
            truth(machine, recording, {"load_constant": {"T": 4.0}, **beside}),
            truth(machine, recording, beside) | {"load.each@a.nc": 4.0 / machine.actuator.gear_ratio},
        )
    )
    for equation, residual in listed.items():
        np.testing.assert_allclose(own[equation], residual, atol=1e-9, err_msg=equation)


def test_the_controller_sees_the_speed_as_its_sensor_makes_it():
    recording = recorded("reversal", effects={"speed_latency": {"tau": 2e-3}})
    machine = machine_of({"a.nc": recording})
    off = truth(machine, recording)
    by_sensor, by_recorder = (
        mean_squares(machine, off | {f"lag.{channel}_filtered": 10.0}) for channel in ("speed_sensor", "speed")
    )
    assert by_sensor["sensor_speed"] == by_recorder["sensor_speed"] < 1.2
    assert by_sensor["control"] < 1.3 < by_recorder["control"]
    late = [mean_squares(machine, off | {f"lag.{c}_late": 1.0})["sensor_speed"] for c in ("speed_sensor", "speed")]
    assert late[0] == late[1]


def test_what_a_point_takes_off_the_angle_leaves_the_noise_as_it_is():
    """An error that is allowed to be larger or smaller would have a likelihood of its own, whatever it is."""
    recording = recorded("reversal", effects={"speed_latency": {"tau": 3e-4}})
    machine = machine_of({"a.nc": recording})
    before, after = (
        next(b for b in machine.blocks(truth(machine, recording) | lag, "a.nc", wanted=()) if b.equation == "control")
        for lag in ({}, {"lag.angle_late": 0.3})
    )
    assert np.max(np.abs(after.residual - before.residual)) > 0.0
    assert len(after.bands) == len(before.bands)
    assert np.allclose(before.bands[0], after.bands[0], rtol=0.03)


def test_a_lag_of_the_speed_is_where_it_fits_best():
    """A longer one smooths the noise of the angle that the speed is compared with, which tells nothing of the lag."""
    true = {"speed_latency": {"tau": 1e-5}}
    recording = recorded("sine", interval=5e-5, effects=true)
    machine = machine_of({"a.nc": recording})
    found = {}
    for tau in (0.0, 1e-5, 2e-5, 4e-5):
        values = truth(machine, recording, {"speed_latency": {"tau": tau}})
        for block, other in zip(
            machine.blocks(values, "a.nc", wanted=()),
            machine.blocks(values, "a.nc", disturbed=True, wanted=()),
            strict=True,
        ):
            if block.equation == "sensor_speed":
                white = compressed_columns(block, [], [block.residual], None)
                correct(white, disturbance(block, other, [], None))
                found[tau] = white.misfit
    assert min(found, key=lambda tau: found[tau]) == 1e-5


def test_a_small_inertia_has_more_of_the_currents_noise():
    """Else its covariance would not say so, and it would be believed for the noise that it amplifies."""
    machine = machine_of({"a.nc": recorded("parabolic", interval=1e-3)})
    off = {n: p.off for n, p in machine.parameters.items()}
    for scale in (1.0, 0.4):
        at = off | {"inertia.scale": scale}
        block, other = (
            next(b for b in machine.blocks(at, "a.nc", drawn, ()) if b.equation == "torque") for drawn in (False, True)
        )
        noise = whiten(block.bands, block.usable, (other.residual - block.residual)[:, None])[block.usable]
        assert np.mean(noise**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(noise)))


def test_a_current_that_flows_on_makes_torque():
    recording = recorded("step", interval=5e-5)
    machine = machine_of({"a.nc": recording})
    block = next(b for b in machine.blocks(truth(machine, recording), "a.nc") if b.equation == "torque")
    # switched off at speed it flows on past the flat part of the back-EMF: of the torque, a share that grows with speed
    share = block.coordinates["drivers"][3] * (np.abs(block.coordinates["rotor_speed"]) / 100.0) ** 1.5
    x, left = whiten(block.bands, block.usable, np.array([share, block.residual]).T).T
    assert np.abs(block.coordinates["rotor_speed"]).max() > 300.0
    assert abs(x @ left) / np.sqrt(x @ x) < 3.0


def test_a_supply_that_sags_gives_the_same_power_by_more_current():
    given = {"bus_resistance": {"R": 0.4}}
    recording = recorded("step", interval=1e-4, effects=given)
    machine = machine_of({"a.nc": recording})
    assert recording.bus_voltage.min() < 43.0
    assert mean_squares(machine, truth(machine, recording, given))["bus"] < 1.3


SUPPLIES = [{"bus_voltage": {"Vdc": 44.0}}, {"bus_voltage": {"Vdc": 49.0}, "bus_resistance": {"R": 0.3}}]
LEAP = {"amplitude": 0.06, "time": 0.02}


@pytest.mark.parametrize("given", SUPPLIES, ids=["voltage", "sag"])
def test_a_supply_that_is_not_recorded_shows_where_the_regulator_never_switches(given):
    recording = replace(recorded("step", interval=2e-4, effects=given, settings=LEAP), bus_voltage=None)
    machine = machine_of({"a.nc": recording})
    values = truth(machine, recording, given)
    block = next(b for b in machine.blocks(values, "a.nc") if b.equation == "bus")
    assert block.usable.sum() > 15
    assert mean_squares(machine, values)["bus"] < 1.3
    rows = np.column_stack([block.columns["bus_voltage.Vdc"] * np.ones(len(block.residual)), block.residual])
    column, left = whiten(block.bands, block.usable, rows).T
    assert abs(column @ left / (column @ column)) < 0.05  # V


@pytest.mark.parametrize("command", COMMANDS)
def test_where_the_regulator_switches_no_voltage_is_taken_for_the_supply(command):
    for interval in (1e-4, 1e-3):
        recording = replace(recorded(command, interval=interval), bus_voltage=None)
        machine = machine_of({"a.nc": recording})
        assert all(b.equation != "bus" for b in machine.blocks(truth(machine, recording), "a.nc"))


def test_the_largest_swing_of_the_ripple_at_a_constant_speed_is_no_supply():
    steady, quiet = {"amplitude": 0.06, "speed": 0.28}, SensorNoise(**{k: 0.5 * x for k, x in asdict(NOISE).items()})
    for seed in range(3):
        recording = recorded(
            "reversal", {"friction_level": {"scale": 1.97}}, seed=seed, interval=1e-4, theta_0=0.7 + seed, noise=quiet,
            settings=steady,
        )  # fmt: skip
        machine = machine_of({"a.nc": replace(recording, bus_voltage=None)})
        assert all(b.equation != "bus" for b in machine.blocks(truth(machine, recording), "a.nc"))


def test_beyond_its_plateau_a_phase_makes_less_torque():
    given = {"hall_displacement": {"d_a": -4.6, "d_b": -4.6, "d_c": -0.3}}
    recording = recorded("reversal", effects=given)
    machine = machine_of({"a.nc": recording})
    block = next(b for b in machine.blocks(truth(machine, recording, given), "a.nc") if b.equation == "torque")
    x, left = whiten(block.bands, block.usable, np.array([block.coordinates["drivers"][2], block.residual]).T).T
    assert abs(x @ left) / np.sqrt(x @ x) < 3.0


@pytest.mark.parametrize("effect", SIZES)
def test_each_effect_shows_in_its_equation_and_is_white_at_its_value(effect):
    given, equation = SIZES[effect]
    fault = (0.0,) * 5 + (30.0,)
    recording = recorded("reversal", effects={effect: given}, fault=fault)
    machine = machine_of({"a.nc": recording})
    on = mean_squares(machine, truth(machine, recording, {effect: given}, fault))
    loose = {"control": 2.0, "commutation": 4.0, "bus": 1.5}
    for name, value in on.items():
        assert value < loose.get(name, 1.3), (name, value)
    rows = next(b for b in machine.blocks(truth(machine, recording), "a.nc") if b.equation == equation).usable.sum()
    # a delay shows in the few rows at the reversals alone
    on, off = (mean_squares(machine, truth(machine, recording, e, fault), ()) for e in ({effect: given}, {}))
    assert rows * (off[equation] - on[equation]) > 10.0


def test_cogging_goes_along_the_angle_of_the_rotor_and_not_the_recorded_one():
    given = {"cogging": {"a": 0.01}, "angle_offset": {"offset": 4.0}}
    recording = recorded("sine", effects=given, settings={"amplitude": 0.004, "frequency": 5.0})
    machine = machine_of({"a.nc": recording})
    at = truth(machine, recording, given)
    assert mean_squares(machine, at)["torque"] < 1.2
    # of the offset, too: 72 periods a turn
    one, other = (
        next(b for b in machine.blocks(at | {"angle_offset.offset": x}, "a.nc") if b.equation == "torque")
        for x in (4.0, 4.01)
    )
    moved, column = (other.residual - one.residual) / 0.01, one.columns["angle_offset.offset"]
    assert moved @ column / (column @ column) == pytest.approx(1.0, abs=0.02)


def test_cogging_is_as_large_where_an_interval_sweeps_a_period_of_it():
    given = {"cogging": {"a": 0.01}}
    recording = recorded("reversal", interval=8e-4, effects=given)
    machine = machine_of({"a.nc": recording})
    at = truth(machine, recording, given)
    block = next(b for b in machine.blocks(at, "a.nc") if b.equation == "torque")
    assert 72 * np.abs(block.coordinates["half_sweep"]).max() > 2.5
    x, left = whiten(block.bands, block.usable, np.array([block.columns["cogging.a"], block.residual]).T).T
    assert abs(x @ left) / np.sqrt(x @ x) < 3.0
    assert mean_squares(machine, at)["torque"] < 1.2


def test_a_zero_of_the_angle_by_the_voltages_is_off_by_its_error():
    off, poles = 4e-3, 4
    plain = recorded("reversal")
    recording = replace(plain, rotor_angle=plain.rotor_angle + off / poles, known={"rotor_angle": {"zero_error": 2e-3}})
    machine = machine_of({"a.nc": recording})
    at = truth(machine, recording)
    assert "zero@a.nc" not in machine_of({"a.nc": plain}).parameters
    assert machine.parameters["zero@a.nc"].sd == 2e-3
    told = {}
    for block in machine.blocks(at, "a.nc"):
        if "zero@a.nc" in block.columns:
            x, left = whiten(block.bands, block.usable, np.array([block.columns["zero@a.nc"], block.residual]).T).T
            told[block.equation] = -x @ left / (x @ x), 1.0 / np.sqrt(x @ x)
    assert {"electrical_a", "commutation"} <= told.keys()
    for equation in ("electrical_a", "electrical_b", "electrical_c", "commutation"):
        found, error = told[equation]
        assert found == pytest.approx(off, abs=4.0 * error + 2e-4) and error < 0.3 * off, (equation, found, error)


def test_every_effect_has_a_size_here():
    assert set(SIZES) == set(EFFECTS) - {"speed_quantisation"}


@pytest.mark.parametrize("effect", SIZES)
def test_derivatives_against_differences(effect):
    given, _ = SIZES[effect]
    fault = (0.0,) * 5 + (30.0,)
    recording = recorded("reversal", effects={effect: given}, fault=fault)
    machine = machine_of({"a.nc": recording})
    values = truth(machine, recording, {effect: given}, fault)
    base = {b.equation: b for b in machine.blocks(values, "a.nc")}
    checked = 0
    for name in internal(effect, given):
        full = f"{effect}.{name}"
        step = 1e-3 * max(abs(values[full]), machine.parameters[full].sd)
        up = {b.equation: b for b in machine.blocks({**values, full: values[full] + step}, "a.nc")}
        down = {b.equation: b for b in machine.blocks({**values, full: values[full] - step}, "a.nc")}
        for equation, block in base.items():
            if full not in block.columns:
                continue
            difference = (up[equation].residual - down[equation].residual) / (2.0 * step)
            column = np.broadcast_to(block.columns[full], difference.shape)
            use = block.usable
            a, b = column[use], difference[use]
            if np.linalg.norm(b) < 1e-9 * np.linalg.norm(block.residual) / step:
                continue
            # columns are of smoothed signals, so that they are alike and not the same
            assert a @ b / (np.linalg.norm(a) * np.linalg.norm(b)) > 0.8, (equation, name)
            checked += 1
    assert checked > 0


@pytest.mark.parametrize(("command", "ends"), [("reversal", True), ("sine", False)])
def test_what_moves_a_residual_has_a_column(command, ends):
    """Else a fit does not see what it loses there by moving it."""
    recording = recorded(command, fault=FAULT, health="seeded")
    if not ends:
        recording = replace(recording, phase_current_end=None)
    recording = replace(recording, known={"rotor_angle": {"zero_error": 2e-3}})
    machine = machine_of({"a.nc": recording})
    at = {n: v for n, v in truth(machine, recording, fault=FAULT).items() if n in machine.parameters}
    base = {b.equation: b for b in machine.blocks(at, "a.nc")}
    own = {p.name for u in machine.units if u.on is not None for v in (u.on, *u.variants) for p in v.parameters}
    for name in set(at) - own:
        step = 1e-2 * machine.parameters[name].sd
        for block in machine.blocks(at | {name: at[name] + step}, "a.nc", wanted=()):
            if block.equation == "commutation" and not name.startswith(("controller", "skew", "lag", "hall")):
                continue  # what multiplies the currents has none there, for it would shrink their noise
            before = base[block.equation]
            change = whiten(before.bands, before.usable, (block.residual - before.residual)[:, None] / 1e-2)
            # of its prior's width; two standard deviations of the noise are not worth a column
            assert name in before.columns or np.sum(change**2) < 4.0, (name, block.equation)


def test_off_a_virtual_neutral_has_the_columns_that_it_has_next_to_off(nominal):
    off = {n: p.off for n, p in nominal.parameters.items()}
    pairs = zip(nominal.blocks(off, "a.nc"), nominal.blocks(off | {"virtual_neutral.on": 1e-9}, "a.nc"), strict=True)
    for x, y in ((x, y) for x, y in pairs if x.equation.startswith("electrical")):
        assert np.allclose(x.residual, y.residual, rtol=0.0, atol=1e-6)
        assert np.any(x.columns["virtual_neutral.on"])
        for name in y.columns:
            assert np.allclose(x.columns.get(name, 0.0), y.columns[name], rtol=1e-6, atol=1e-6), (x.equation, name)


def test_controller_gains_stand_in_the_control_equation_alone(nominal):
    values = {n: p.off for n, p in nominal.parameters.items()}
    for block in nominal.blocks(values, "a.nc"):
        gains = [n for n in block.columns if n.startswith("controller.") and n.endswith("_gain")]
        assert bool(gains) == (block.equation == "control")


def test_what_seeded_recordings_share_of_a_fault_is_the_same_as_their_own():
    one, two = (recorded(seed=n, fault=FAULT, health="seeded") for n in (0, 1))
    machine = machine_of({"a.nc": one, "b.nc": two})
    off = {n: p.off for n, p in machine.parameters.items()}
    own = off | {"Na@a.nc": 0.04, "Na@b.nc": 0.04, "xi_x@a.nc": 0.1, "xi_x@b.nc": 0.1}
    shared = off | {"seeded.Na": 0.04, "seeded.xi_x": 0.1}
    for name in ("a.nc", "b.nc"):
        for x, y in zip(machine.blocks(own, name), machine.blocks(shared, name), strict=True):
            assert np.allclose(x.residual, y.residual, rtol=0.0, atol=1e-12), x.equation
            if f"Na@{name}" in x.columns:
                assert np.allclose(x.columns[f"Na@{name}"], y.columns["seeded.Na"]), x.equation
    fault, common = machine.parameters["Na@a.nc"], machine.parameters["seeded.Na"]
    assert fault.sd == pytest.approx(common.sd) and np.hypot(fault.sd, common.sd) == pytest.approx(0.05)


def test_a_healthy_recording_has_nothing_of_what_seeded_ones_share():
    machine = machine_of({"a.nc": recorded(), "b.nc": recorded(fault=FAULT, health="seeded")})
    off = {n: p.off for n, p in machine.parameters.items()}
    for x, y in zip(machine.blocks(off, "a.nc"), machine.blocks(off | {"seeded.Na": 0.2}, "a.nc"), strict=True):
        assert np.array_equal(x.residual, y.residual), x.equation


@pytest.mark.parametrize("w_s", [8.0, 150.0])
def test_a_stribeck_friction_acts_with_the_speed_that_is_told(w_s):
    machine = machine_of({"a.nc": recorded("sine")})
    at = {n: p.off for n, p in machine.parameters.items()} | {"stribeck.a": 0.02}

    def of_torque(log_w_s):
        blocks = machine.blocks(at | {"stribeck.log_w_s": log_w_s}, "a.nc", wanted={"stribeck.log_w_s"})
        return next(b for b in blocks if b.equation == "torque")

    here, ahead, back = (of_torque(np.log(w_s) + x) for x in (0.0, 0.01, -0.01))
    moved, column = (ahead.residual - back.residual) / 0.02, here.columns["stribeck.log_w_s"]
    assert moved @ column / (column @ column) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("early", [0.0, 0.537])
def test_a_speed_without_noise_of_its_own_has_a_covariance(early):
    """What little is left out of that of a filtered rate of the angle had made its spectrum negative."""
    recording = recorded("reversal")
    machine = machine_of({"a.nc": recording})
    signals = machine.recordings["a.nc"]
    machine.recordings["a.nc"] = replace(signals, noise=replace(signals.noise, speed=1e-3))
    at = truth(machine, recording, {"speed_latency": {"tau": 2e-4}}) | {"lag.speed_early": early}
    block = next(b for b in machine.blocks(at, "a.nc", wanted=()) if b.equation == "sensor_speed")
    assert np.min(block.factor[0] ** 2 / block.bands[0]) > 1e-3
