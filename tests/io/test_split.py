"""How a bench is split into recordings that explore and recordings that confirm."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.actuator.commands import jumps_of
from emafault.io import split
from emafault.io.split import split_bench


def _plan(shop, count, healths):
    kinds = (
        ("parabolic", {"acceleration": 0.4}),
        ("ramp", {"speed": 0.2}),
        ("sine", {"amplitude": 0.03, "frequency": 2.0}),
        ("parabolic", {"acceleration": -0.5}),
    )
    plans = [(*kinds[n % 4], -30.0 + 15.0 * n, healths[n % len(healths)]) for n in range(count)]
    return shop.make_bench(plans=plans, duration=0.2, interval=1e-3)


@pytest.mark.parametrize(("count", "held"), [(1, 0), (2, 1), (3, 1), (4, 1), (6, 2), (8, 2)])
def test_how_many_are_held_out(shop, count, held):
    bench = _plan(shop, count, ["unknown"])
    explore, confirm = split_bench(bench)
    assert len(confirm) == held and sorted(explore + confirm) == sorted(bench)
    shuffled = dict(sorted(bench.items(), reverse=True))
    assert split_bench(shuffled) == (explore, confirm)


def test_explore_keeps_a_healthy_recording_and_every_fault_that_confirm_has(shop):
    bench = _plan(shop, 8, ["healthy", "unknown", "unknown", "healthy"])
    explore, _ = split_bench(bench)
    health = {n: r.health for n, r in bench.items()}
    assert {"healthy", "unknown"} <= {health[n] for n in explore}
    ambient = {n: r.ambient_temperature for n, r in bench.items()}
    assert max(ambient[n] for n in explore) == max(ambient.values())  # extremes explore, so that confirm interpolates
    one_of_each = dict(zip(("a", "b"), _plan(shop, 2, ["healthy", "unknown"]).values()))
    assert split_bench(one_of_each) == (["a", "b"], [])


def test_repetitions_of_a_condition_stay_on_one_side(shop):
    bench = _plan(shop, 4, ["unknown"])
    repeated = {f"{n}{k}": r for n, r in bench.items() for k in "xy"}
    explore, confirm = split_bench(repeated)
    assert confirm and {n[:-1] for n in explore}.isdisjoint({n[:-1] for n in confirm})


def test_steps_alone_neither_explore_nor_confirm(shop):
    moving, step = ("sine", {"amplitude": 0.03, "frequency": 2.0}), ("step", {"amplitude": 0.02, "time": 0.03})
    plans = [(*kind, 20.0 * n, "unknown") for n, kind in enumerate((moving, moving, step, step))]
    bench = shop.make_bench(plans=plans, duration=0.2, interval=1e-3)
    steps = {n for n, r in bench.items() if len(jumps_of(r.commanded_position))}
    assert len(steps) == 2
    for side in split_bench(bench):
        assert not set(side) <= steps


def test_a_temperature_is_not_left_to_a_step_alone(shop):
    moving, step = ("sine", {"amplitude": 0.03, "frequency": 2.0}), ("step", {"amplitude": 0.02, "time": 0.03})
    plans = [(*kind, t, "unknown") for kind, t in ((moving, 45.0), (moving, 60.0), (step, 0.0), (moving, 20.0))]
    bench = shop.make_bench(plans=plans, duration=0.2, interval=1e-3)
    explore, _ = split_bench(bench)
    smooth = [r for n, r in bench.items() if n in explore and not len(jumps_of(r.commanded_position))]
    assert np.ptp([r.ambient_temperature for r in smooth]) > 38.0


def test_the_one_recording_of_large_currents_explores(shop):
    quiet, hard = ("sine", {"amplitude": 0.004, "frequency": 2.0}), ("step", {"amplitude": 0.02, "time": 0.03})
    for place in range(4):
        plans = [(*(hard if n == place else quiet), 20.0 * n, "unknown") for n in range(4)]
        bench = shop.make_bench(plans=plans, duration=0.2, interval=1e-3)
        largest = max(bench, key=lambda n: np.abs(bench[n].phase_current).max())
        assert largest == sorted(bench)[place]
        assert largest in split_bench(bench)[0]


def _many(shop, count):
    """A bench of many conditions from few simulations: other commands' names, directions and temperatures."""
    rng = np.random.default_rng(count)
    made = list(_plan(shop, 8, ["unknown", "healthy"]).values())
    out = {}
    for n in range(count):
        r = made[n % len(made)]
        sign, command = rng.choice([-1.0, 1.0]), rng.choice(["sine", "ramp", "parabolic"])
        out[f"recording_{n:03d}.nc"] = replace(
            r, ambient_temperature=float(rng.uniform(-30.0, 80.0)), attributes=r.attributes | {"command": str(command)},
            rotor_angle=sign * r.rotor_angle, commanded_position=rng.uniform(0.5, 1.5) * sign * r.commanded_position,
        )  # fmt: skip
    return out


def test_exchanges_lead_to_a_split_about_as_good_as_the_best_of_all(shop, monkeypatch):
    for count in (9, 12, 14):
        bench = _many(shop, count)
        names = sorted(bench)
        lack = split._lack([bench[n] for n in names], round(count / 3.5))
        best = lack(tuple(names.index(n) for n in split_bench(bench)[1]))
        with monkeypatch.context() as patched:
            patched.setattr(split, "comb", lambda *_: split.MOST + 1)
            found = lack(tuple(names.index(n) for n in split_bench(bench)[1]))
        assert best <= found < best + 0.1


def test_a_long_bench_is_split_at_once_the_same_in_any_order(shop, monkeypatch):
    bench = _many(shop, 60)
    looked = []
    whole = split._lack

    def counted(*given):
        lack = whole(*given)
        return lambda confirm: looked.append(1) or lack(confirm)

    monkeypatch.setattr(split, "_lack", counted)
    explore, confirm = split_bench(bench)
    assert len(confirm) == 17 and sorted(explore + confirm) == sorted(bench)
    assert len(looked) < 2 * split.MOST
    assert split_bench(dict(sorted(bench.items(), reverse=True))) == (explore, confirm)
    ambient = {n: r.ambient_temperature for n, r in bench.items()}
    assert np.ptp([ambient[n] for n in explore]) > 0.98 * np.ptp(list(ambient.values()))
    assert np.ptp([ambient[n] for n in confirm]) > 0.5 * np.ptp(list(ambient.values()))


def test_a_motion_that_passes_few_angles_does_not_confirm_alone(shop):
    """Of what sits at an angle of the rotor it could not say whether it is there."""
    small, far = (("sine", {"amplitude": x, "frequency": 2.0}) for x in (0.002, 0.02))
    plans = [(*small, 20.0, "unknown"), *((*far, ambient, "unknown") for ambient in (0.0, 23.0, 40.0))]
    bench = shop.make_bench(plans=plans, duration=0.3, interval=1e-3)
    few = min(bench, key=lambda n: np.ptp(bench[n].rotor_angle))
    turned = {n: np.ptp(r.rotor_angle) for n, r in bench.items()}
    assert turned[few] < 3.0 and min(x for n, x in turned.items() if n != few) > 2.0 * np.pi
    assert few not in split_bench(bench)[1]
