"""The reference actuator as the diagnosis sees it: its priors, and that a fit stands still at its optimum."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.actuator.shape import trapezoid_swept
from emafault.diagnosis.fit import NOTHING, Bench
from emafault.diagnosis.linear import disturbance, raw_columns
from emafault.diagnosis.sets import OTHER_FORM
from emafault.effects import EFFECTS
from emafault.equations import commutation, electrical, waveform
from emafault.equations.coordinates import OWN_ALONG
from emafault.equations.machine import ReferenceActuator
from emafault.equations.point import Point, State
from emafault.equations.signals import Signals

from .conftest import ACTUATOR, NOISE, machine_of, recorded

FAULT = (0.05, 0.03, 0.06, 0.02, 0.01, 20.0)


def test_a_prior_on_one_side_of_off_has_the_whole_range_of_the_catalogue(nominal):
    """What the fit has off need not be the catalogue's nominal value: a compliance damps with 300, not 0."""
    for unit in nominal.units:
        effect = EFFECTS.get(unit.id)
        for variant in (*unit.variants, *([unit.on] if unit.on else ())) if effect else ():
            for p, sign in zip(variant.parameters, variant.signs, strict=False):
                known = effect.parameters.get(p.name.split(".")[-1])
                if sign != 0 and known is not None:
                    side = (known.low - p.off, known.high - p.off)
                    assert min(sign * x for x in side) >= 0.0, p.name


@pytest.mark.parametrize(("lacking", "there"), [((), False), (("back_emf_shape",), True), (("cogging",), False)])
def test_the_back_emf_has_harmonics_of_its_own_where_no_effect_is_another_shape(lacking, there):
    machine = machine_of({"a.nc": recorded()}, lacking)
    assert ("~harmonics_emf" in {u.id for u in machine.units}) is there
    wanted = {p.name for u in machine.units for p in u.parameters}
    off = {n: p.off for n, p in machine.parameters.items()}
    assert ("emf.h13" in wanted) is there
    assert ("emf.h13" in next(iter(machine.blocks(off, "a.nc", wanted=wanted))).columns) is there


def test_a_shape_in_the_library_may_have_other_harmonics_and_rounded_corners():
    """Their columns are there for its own form alone: they are no nuisances, and no other unit has them."""
    machine = machine_of({"a.nc": recorded()})
    (beside,) = machine.own_parameters.values()
    assert all(machine.parameters[n].fixed for n in beside)
    assert not {p.name for u in machine.units for p in u.parameters} & set(beside)
    off = {n: p.off for n, p in machine.parameters.items()}
    for block in machine.blocks(off, "a.nc", wanted={"back_emf_shape.width", *beside}):
        seen = "back_emf_shape.width" in block.columns
        assert set(beside) <= set(block.columns) if seen else not set(beside) & set(block.columns)


@pytest.mark.parametrize("ramp", [np.pi / 6.0, 0.3])
def test_corners_are_rounded_as_by_an_average_over_the_ramp(ramp):
    x = np.linspace(-7.0, 7.0, 40001)

    def swept(at):
        return trapezoid_swept(at, ramp)[0]

    average = np.mean([swept(x + s) for s in np.linspace(-0.5 * ramp, 0.5 * ramp, 401)], axis=0)
    column = waveform.swept(Point({waveform.CORNERS: 0.0}, "a.nc"), x[:-1], x[1:], ramp).slopes[waveform.CORNERS]
    np.testing.assert_allclose(column, np.diff(average - swept(x)), atol=1e-6)


def test_corners_are_rounded_over_the_ramp_of_the_point():
    machine = machine_of({"a.nc": recorded()})
    wide = {n: p.off for n, p in machine.parameters.items()} | {"back_emf_shape.width": 140.0}
    machine.prepare("a.nc", wide)
    rec = machine.recordings["a.nc"]
    state = State(rec, Point(wide, "a.nc", (waveform.CORNERS,)))
    ramp, poles = np.deg2rad(20.0), rec.actuator.pole_pairs
    before, after = (waveform.rounding(poles * a - rec.axis[0], ramp) for a in (rec.before, rec.angle))
    expected = (after - before) / (poles * rec.interval)
    np.testing.assert_allclose(state.swept[0].slopes[waveform.CORNERS], expected, atol=1e-12)


def test_the_form_of_an_effect_may_differ_along_every_coordinate(nominal):
    """Each function of an own form is the constant or goes along one coordinate, the temperature beside time."""
    name, rec = next(iter(nominal.recordings.items()))
    block = next(
        b for b in nominal.blocks({n: p.off for n, p in nominal.parameters.items()}, name) if b.equation == "torque"
    )
    own = block.coordinates["own"]
    assert set().union(*OWN_ALONG) == set(range(len(own)))
    temperature = next(along for along in OWN_ALONG if len(own) - 1 in along)
    assert np.ptp(own[-1]) == 0.0 and own[-1][0] == pytest.approx(rec.dT_measured / 50.0)
    assert np.corrcoef(own[temperature[1]], block.coordinates["time"])[0, 1] == pytest.approx(1.0)


def test_a_fit_stands_still_at_its_optimum():
    """Turns, k, R and L of all phases make up for one another along a line on which noise in the regressors, taken out
    as it was elsewhere, would drive the point on and on."""
    plans = (("parabolic", 0.3), ("reversal", 1.1), ("sine", 2.0))
    named = {
        f"r{n}": recorded(c, None, FAULT, seed=n, theta_0=theta_0, health="seeded")
        for n, (c, theta_0) in enumerate(plans)
    }
    bench = Bench(machine_of(named), list(named))
    bench.settle(NOTHING, steps=6)
    bench.linearise(renew=True)
    steps = []
    for _ in range(6):
        found, normal = bench._fitted(NOTHING)
        deviations = bench.nuisance_deviations(normal, found.deviations)
        turns = [n for n in deviations if n.startswith(("N", "seeded.N"))]
        steps.append(max(abs(deviations[n]) / bench.prior(n)[1] for n in turns))
        bench.move(found, normal)
    assert max(steps[2:]) < 1e-5, steps


def test_a_full_model_does_not_take_noise_for_what_its_columns_explain():
    """All terms of a voltage times one factor leave it as wrong as before but for their noise: where that is most of
    what is left, a fit that does not take it out of its columns shrinks them, and so the noise that is weighed by."""
    noisy = replace(NOISE, angle=10.0 * NOISE.angle)
    named = {f"r{n}": recorded(c, seed=n, noise=noisy) for n, c in enumerate(("parabolic", "reversal", "sine"))}
    machine = ReferenceActuator(ACTUATOR, {n: Signals.of(n, r, ACTUATOR, noisy) for n, r in named.items()})
    bench = Bench(machine, list(named))
    bench.settle(NOTHING)
    bench.linearise(renew=True)
    for weights in bench.carried.values():
        for phase in electrical.NAMES:
            assert np.median(weights[phase].variance) > 0.5, phase


def test_an_edge_at_the_end_of_an_interval_is_no_corner(nominal):
    """Where a current passes from one interval into the next, the residual's derivative is that of differences."""
    edge = "hall_displacement.d_a"
    off = {n: p.off for n, p in nominal.parameters.items()}

    def at(x):
        blocks = nominal.blocks({**off, edge: x}, "a.nc", wanted={edge})
        return next(b for b in blocks if b.equation == "commutation")

    step = 1e-3
    _, _, high, now = commutation._edges(State(nominal.recordings["a.nc"], Point(off, "a.nc", ())), 0)
    for x in np.rad2deg(now.value - high)[np.abs(high) < 0.02][:6]:
        slope = np.broadcast_to(at(x).columns[edge], len(at(x).residual))
        difference = (at(x + step).residual - at(x - step).residual) / (2.0 * step)
        assert np.all(np.abs(slope - difference) <= 0.02 * np.maximum(np.abs(slope), np.abs(difference)) + 1e-3)


def test_a_remainder_has_the_noise_of_what_it_is_driven_by():
    """It may be the very column that a coefficient has: were the noise taken out of one of both alone, their
    difference, which is nothing, would have less than no power, and the fit would go wherever that leads."""
    machine = machine_of({"a.nc": recorded()})
    values = {n: p.off for n, p in machine.parameters.items()}
    k, same = "unit_calibration.k_scale", "remainder.torque.2.0"
    blocks, disturbed = ([*machine.blocks(values, "a.nc", disturbed=d, wanted={k})] for d in (False, True))
    block, other = (next(b for b in bs if b.equation == "torque") for bs in (blocks, disturbed))
    names, columns = raw_columns(block, [k], True)
    found = dict(zip(names, columns, strict=False))
    share = float(found[k] @ found[same] / (found[same] @ found[same]))
    assert np.allclose(found[k], share * found[same], rtol=1e-4, atol=1e-9 * abs(found[k]).max())
    noise = disturbance(block, other, names, None)
    at, remains = names.index(k), names.index(same)
    assert noise[at, at] > 0.0
    difference = noise[at, at] - 2.0 * share * noise[at, remains] + share**2 * noise[remains, remains]
    assert abs(difference) < 1e-4 * noise[at, at]


def test_normal_matrices_are_the_same_in_any_number_of_processes():
    """What is computed once is not that of the point at which a process first looked."""
    named = {f"r{n}": recorded(c, seed=n) for n, c in enumerate(("parabolic", "sine"))}
    found = []
    for processes in (1, 2):
        bench = Bench(machine_of(named), list(named), processes)
        bench.point["unit_calibration.k_scale"] *= 1.01
        found.append(bench.linearise(renew=True))
    assert all(np.array_equal(a.gram, b.gram) for a, b in zip(*found, strict=True))


def test_a_large_drag_of_some_power_is_that_and_no_sum_of_other_frictions():
    """Beside whatever else might explain it a scan cannot tell the exponent; by itself it is told."""
    fan = {"place": "drag", "form": "power", "exponent": 2.0, "at_100_rad_s": 0.04}
    motions = {
        "reversal": {"amplitude": 0.056, "speed": 0.45},
        "sine": {"amplitude": 0.013, "frequency": 4.0},
        "parabolic": {"acceleration": 0.37},
    }
    recordings = {
        f"{command}.nc": recorded(command, settings=settings, seed=n, theta_0=0.5 * n, unlisted=(fan,))
        for n, (command, settings) in enumerate(motions.items())
    }
    bench = Bench(machine_of(recordings), list(recordings))
    leading = bench.fit().models[0]
    (form,) = [f for f in bench.described if f.id in leading.units]
    assert len(leading.units) == 1 and form.word == "power"
    assert form.values["exponent"] == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(("own", "beyond"), [(1.0, 0.0), (0.6, 0.0), (0.7, -0.2), (1.2, 0.3)])
def test_a_value_beyond_tolerance_lies_beyond_it_from_wherever_the_point_is(nominal, own, beyond):
    """At the edges of the hole a friction has 0.6 and 1.4; taken from a point at 0.6, one of 0.55 had been within."""
    fit = Bench(nominal, list(nominal.recordings))
    fit.point |= {"friction_level.scale": own, "friction_level.scale+": beyond}
    (variant,) = next(u for u in fit.units if u.id == "friction_level").variants
    (name,) = (p.name for p in variant.parameters)
    _, width, off = fit.prior(name)
    for edge, value in zip(fit._hole(variant)[:, 0], (0.6, 1.4), strict=True):
        there = fit.after({"friction_level.scale": fit.prior("friction_level.scale")[2], name: off + edge * width})
        assert sum(there.values()) == pytest.approx(value)


def test_a_unit_s_variants_are_no_other_forms():
    machine = machine_of({"a.nc": recorded()})
    assert max(len(u.variants) for u in machine.units) < OTHER_FORM
