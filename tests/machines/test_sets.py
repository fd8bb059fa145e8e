"""Every machine on the sets that travel with the project."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from emafault import provenance
from emafault.errors import InputError
from emafault.machines.adapter import Recorded
from emafault.machines.diagnose import Diagnosed, diagnose
from emafault.machines.library import MEASURED, build, flaw, read_cases, stated
from emafault.machines.recorded.dq_machine import steady_stretches
from emafault.machines.run import checked
from emafault.machines.withheld import check_left_out, names_of, placed_in

DATA = Path(__file__).parents[2] / "data" / "measured"
FILES = {
    "dq_machine": "lea_pmsm_temperature/profile24_first60.csv.gz",
    "six_step_bus": "bldc_sixstep_esc/f60_kotleta_bench_log.csv.gz",
    "propeller_sweep": "bldc_thruststand_sweeps/sweeps.csv.gz",
    "back_emf": "bldc_backemf_scope/backemf.npz",
    "slow_rotation": "odrive_cogging/cogging_maps.npz",
    "friction_axis": "emps/emps_estimation.npz",
    "induction_currents": "itsc_induction_motor/currents.npz",
}


@cache
def cases(name: str) -> dict:
    return read_cases(stated(name), DATA / FILES[name])


def arrays(name: str, case: str = "") -> tuple[str, dict]:
    case = case or next(iter(cases(name)))
    return case, cases(name)[case]


def diagnosed(name: str, case: str, given: dict) -> Diagnosed:
    found = diagnose(build(stated(name), case, given), experiments=False)
    checked(found.verdict)
    return found


@cache
def usual(name: str, case: str = "") -> Diagnosed:
    return diagnosed(name, *arrays(name, case))


def changed(name: str, what: str, case: str = "") -> dict:
    case, given = arrays(name, case)
    change = next(d for d in stated(name).distortions if d.name == what)
    return diagnosed(name, case, change.apply(given)).verdict


@pytest.mark.parametrize("name", MEASURED)
def test_every_set_is_read_and_states_a_machine_that_fits_together(name):
    for case, given in cases(name).items():
        machine = build(stated(name), case, given)
        assert flaw(machine) == "" and machine.explore and machine.confirm
        recorded = Recorded(machine, machine.explore)
        values = {n: p.off for n, p in recorded.parameters.items()}
        for recording in machine.explore:
            for block in recorded.blocks(values, recording, wanted=set(recorded.parameters)):
                assert np.isfinite(block.residual).all() and block.columns
                assert all(np.isfinite(c).all() for c in block.columns.values())
                assert np.isfinite(block.coordinates["phi"]).all()


@pytest.mark.parametrize("name", MEASURED)
def test_every_set_gets_a_verdict_of_the_format(name):
    verdict = usual(name).verdict
    assert sum(e["probability"] for e in verdict["which"]) == pytest.approx(1.0, abs=1e-3)
    assert all(np.isfinite(v) for k, v in verdict["shrinks"]["signal"].items() if k != "closed")


def test_the_gap_closes_on_recordings_that_took_no_part():
    for name in ("back_emf", "slow_rotation", "friction_axis"):
        signal = usual(name).verdict["shrinks"]["signal"]
        assert signal["closed"] > 0.95 and signal["placebo"] > 3 * signal["after"]


def test_what_fits_early_and_fails_later_is_not_claimed():
    """Iron loss fits the explored heat-up better than the copper's temperature and then fails on what comes later."""
    verdict = usual("dq_machine").verdict
    assert "iron_loss" not in names_of(verdict)
    assert {"magnet_temperature", "torque_from_map"} <= set(names_of(verdict))


@pytest.mark.parametrize("case", ["ITSC_A20", "ITSC_A40", "ITSC_B30", "ITSC_C20", "ITSC_C40"])
def test_the_shorted_phase_is_named(case):
    assert names_of(usual("induction_currents", case).verdict) == (f"shorted_turns_{case[5].lower()}",)


def test_repetitions_that_contradict_each_other_leave_no_name():
    assert names_of(usual("induction_currents", "ITSC_B20").verdict) == ()
    assert usual("induction_currents", "ITSC_HLT").verdict["verdict"] == "no_gap"


@pytest.mark.parametrize(
    ("name", "case", "what", "effects"),
    [
        ("propeller_sweep", "motor a", "voltage rises with speed x current", {"commutation_loss"}),
        ("friction_axis", "", "friction higher at low speed", {"stribeck"}),
        ("friction_axis", "", "force in proportion to position", {"load_spring"}),
        ("back_emf", "", "offset on the third channel", {"channel_offset"}),
        ("induction_currents", "ITSC_HLT", "second channel's gain +30 %", {"current_gain_b"}),
        ("induction_currents", "ITSC_HLT", "short in phase C", {"shorted_turns_c"}),
    ],
)
def test_a_change_put_in_is_named(name, case, what, effects):
    assert effects & set(names_of(changed(name, what, case)))


@pytest.mark.parametrize(
    ("name", "case", "what", "equation"),
    [
        ("propeller_sweep", "motor a", "speed 2 % high and low by propeller", "electrical"),
        ("friction_axis", "", "force that waves in time", "torque"),
        ("induction_currents", "ITSC_HLT", "pick-up that beats with the line", "sensor_current"),
    ],
)
def test_a_change_that_no_effect_can_express_is_unknown_in_its_equation(name, case, what, equation):
    verdict = changed(name, what, case)
    assert names_of(verdict) == () and placed_in(verdict) == (equation,)


def test_the_strongest_effect_left_out_leaves_a_remainder():
    case, given = arrays("friction_axis")
    (row,) = check_left_out(stated("friction_axis"), case, given, usual("friction_axis"))
    assert row.kind == "left out" and row.right and "viscous_asymmetry" in row.what


def test_the_seal_of_a_set_does_not_depend_on_what_is_set_aside():
    case, given = arrays("propeller_sweep", "motor d")
    plain = usual("propeller_sweep", "motor d").verdict
    late = np.isin([f"propeller {p:g}" for p in given["propeller"]], plain["recordings"]["confirm"])
    other = diagnosed("propeller_sweep", case, given | {"v_bus_V": np.where(late, 1.3, 1.0) * given["v_bus_V"]})
    assert late.any() and other.verdict["sealed"] == plain["sealed"]
    assert other.verdict["verdict"] != plain["verdict"] or other.verdict["which"] != plain["which"]


def test_two_phases_exchanged_in_one_file_are_no_shorted_turn():
    case, given = arrays("induction_currents", "ITSC_HLT")
    other = {**given, "healthy": cases("induction_currents")["ITSC_A10"]["healthy"]}
    verdict = diagnosed("induction_currents", case, other | {"i": given["i"][..., [0, 2, 1]]}).verdict
    assert names_of(verdict) == ("phases_exchanged",) and "exchanged" in " ".join(verdict["notes"])


def test_a_steady_record_without_load_is_read():
    """What is called a transient of i_q does not depend on i_q being large."""
    _, given = arrays("dq_machine")
    rng = np.random.default_rng(4)
    noise = 0.05 * rng.standard_normal(given["i_q"].size)
    idle = given | {"i_q": noise, "i_d": np.full(noise.size, -60.0), "motor_speed": np.full(noise.size, 5500.0)}
    assert sum(s.size for s in steady_stretches(idle)) > 0.9 * noise.size
    free = idle | {"i_d": 0.05 * rng.standard_normal(noise.size)}
    assert sum(s.size for s in steady_stretches(free)) > 0.9 * noise.size
    with pytest.raises(InputError, match="steady rows"):
        jumping = given | {"motor_speed": np.where(np.arange(noise.size) % 7 < 3, 1000.0, 5500.0)}
        build(stated("dq_machine"), "jumping", jumping)


def test_motion_in_one_direction_leaves_asymmetries_open():
    """What differs between directions cannot be seen from one: it is neither ruled out nor is there surely no gap."""
    case, given = arrays("friction_axis")
    machine = build(stated("friction_axis"), case, given)
    recorded = Recorded(machine, (*machine.explore, *machine.confirm))
    values = {n: p.off for n, p in recorded.parameters.items()}
    values |= {"M": 95.0, "F_v": 200.0, "F_c": 20.0}
    rng = np.random.default_rng(2)
    rows = []
    for r in machine.rows:
        forward = np.flatnonzero(r.inputs["v"] > 0.0)
        inputs = {n: x[forward] if len(x) == r.size else x for n, x in r.inputs.items()}
        noise = np.sqrt(r.variance[forward]) * rng.standard_normal(forward.size)
        one = replace(
            r, low=r.low[forward], high=r.high[forward], variance=r.variance[forward], inputs=inputs,
            labels=[r.labels[k] for k in forward], beside={n: x[forward] for n, x in r.beside.items()},
            observed=recorded.predict(r, [values])[0][forward] + noise,
        )  # fmt: skip
        rows.append(one)
    verdict = diagnose(replace(machine, rows=rows), experiments=False).verdict
    assert {"offset", "viscous_asymmetry"} & set(verdict["untold"])
    assert verdict["which"][0]["probability"] < 0.8 and names_of(verdict) == ()


def test_the_workflow_sees_every_machine():
    """A change of a machine's file makes its page anew."""
    pending, seen = [Path(__file__).parents[2] / "workflow" / "scripts" / "diagnose_machines.py"], set()
    while pending:
        path = pending.pop()
        if path not in seen:
            seen.add(path)
            pending += provenance._read_source(path)[1]
    parts = {p.relative_to(provenance.PACKAGE) for p in seen if p.is_relative_to(provenance.PACKAGE)}
    assert {Path("machines") / f"{name}.py" for name in MEASURED} <= parts
