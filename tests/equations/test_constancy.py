"""Whether a named effect has one size in all recordings: a fault of the machine has, what changes has not."""

from types import SimpleNamespace

import pytest

from emafault.diagnosis.constancy import PRIOR, log_odds_of_change
from emafault.diagnosis.fit import Bench, Fit
from emafault.diagnosis.search import Search
from emafault.diagnosis.sets import Choice, Model
from emafault.equations.diagnose import diagnose
from emafault.equations.verdict import remainder_sentence

from .conftest import ACTUATOR, NOISE, all_but, machine_of, recorded

PLANS = (("parabolic", 30.0), ("reversal", 30.0), ("sine", -20.0), ("parabolic", -20.0))


def bench_of(sizes):
    """Recordings of a unit with a spring on its shaft, of these sizes (N m/rad)."""
    return {
        f"r{n}.nc": recorded(command, {"load_spring": {"c": c}}, (0.0,) * 5 + (dT,), seed=n, theta_0=0.5 * n)
        for n, ((command, dT), c) in enumerate(zip(PLANS, sizes, strict=True))
    }


def fitted(sizes):
    """Such a bench at the optimum of a spring alone, its fit there, and the set with the spring."""
    machine = machine_of(bench_of(sizes))
    bench = Bench(machine, list(machine.recordings))
    bench.settle(Model((Choice("load_spring", 0, 1.0),)))
    whites = bench.linearise(renew=True)
    normal = bench.normal(whites)
    reduced = bench.reduce(normal)
    search = Search(reduced, *bench.candidates(reduced))
    model = search.fit((("load_spring", 0),))
    return bench, Fit(bench.values(), whites, bench.carried, [model], normal, search), model


def test_one_size_in_all_recordings_speaks_for_an_effect():
    assert log_odds_of_change(*fitted([60.0] * 4), "load_spring") < -5.0


def test_another_size_in_each_speaks_against_it():
    assert log_odds_of_change(*fitted([60.0, -60.0, 20.0, -40.0]), "load_spring") > 5.0


def test_recordings_that_do_not_show_an_effect_say_nothing_of_it():
    """An effect that one recording alone shows has about the odds that it had before."""
    bench, fit, model = fitted([60.0] * 4)
    fit.whites[:] = [w for w in fit.whites if w.recording == "r0.nc" or w.equation != "torque"]
    assert log_odds_of_change(bench, fit, model, "load_spring") == pytest.approx(PRIOR, abs=2.0)


@pytest.mark.long
def test_what_changes_is_not_named_but_told():
    recordings = bench_of([60.0, -60.0, 20.0, -40.0])
    names = list(recordings)[1:]
    recordings = {n: recordings[n] for n in names}
    others = all_but("load_spring", "load_constant", "cogging")
    verdict = diagnose("bench", recordings, (names[:2], names[2:]), ACTUATOR, NOISE, others).verdict
    assert "load_spring" not in verdict["which"][0]["effects"] and verdict["inclusion"]["load_spring"] < 0.9
    assert "torque" in {e["equation"] for e in verdict["discovered"]}


def test_a_remainder_says_what_it_looks_like_in_each_recording():
    search = SimpleNamespace(units={"load_spring": SimpleNamespace(equations=("torque",))})
    said = remainder_sentence(search, "torque", {"load_spring": 4.0})
    assert said.endswith("it looks as if a spring acts on the user shaft, by another amount each time.")
    for other in (("torque", {"load_spring": -4.0}), ("bus", {"load_spring": 4.0})):
        assert "looks as if" not in remainder_sentence(search, *other)


def test_a_remainder_that_is_one_of_several_forms_says_which():
    search = SimpleNamespace(units={})
    said = remainder_sentence(search, "torque", {}, ["a torque goes with the speed (48 %)", "a drag with time (45 %)"])
    assert said == (
        "The torque equation leaves more than noise: perhaps a torque goes with the speed (48 %), or a drag with time"
        " (45 %)."
    )
