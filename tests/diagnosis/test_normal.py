"""Steps of the point within the reach of the priors, and to where a set fits better."""

from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.evidence import Normal, Reduced
from emafault.diagnosis.fit import NOTHING, Bench
from emafault.diagnosis.model import TOLERANCES, Block, Parameter, Unit, Variant
from emafault.diagnosis.sets import OTHER_FORM, WIDTHS, Choice, Model
from emafault.diagnosis.settling import Began, between

ROWS = 4000


class Machine:
    """Two coefficients of nearly the same column, the first far beyond where its prior has any mass."""

    forms = units = ()
    parameters = {n: Parameter(n, 0.0, 0.0, 1.0) for n in ("a", "b")}  # noqa: RUF012

    def blocks(self, values, recording, wanted=None, disturbed=False):
        rng = np.random.default_rng(0)
        noise, one, other = rng.standard_normal((3, ROWS))
        columns = {"a": one, "b": one + 0.1 * other}
        residual = noise + sum((values[n] - true) * columns[n] for n, true in (("a", 5.0), ("b", -1.0)))
        return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]


def test_what_is_held_at_the_end_of_its_prior_is_held_while_the_others_are_fitted():
    """Cut off after a joint fit, the second would stay where it makes up for a first that is not there."""
    bench = Bench(Machine(), ["r"])
    bench.move(NOTHING, bench.normal(bench.linearise(NOTHING, corrected=False), NOTHING))
    normal = bench.normal(bench.linearise(NOTHING, corrected=False), NOTHING)
    assert bench.point["a"] == bench.reach
    b = normal.index["b"]
    assert abs(bench.point["b"] + normal.g[b]) < 1e-6 * normal.H[b, b]


def test_a_cause_is_fitted_beside_what_is_held_at_the_end_of_its_prior():
    """Fitted beside a nuisance that may go anywhere, a cause of nearly the same column would end where it makes up for
    a nuisance that is not there."""

    class WithCause(Machine):
        units = (Unit("b", "structural", ("torque",), [Variant([Machine.parameters["b"]])]),)
        parameters = {"a": Parameter("a", 0.0, 0.0, 1.0), "b": Parameter("b", 0.0, 0.0, 10.0)}  # noqa: RUF012

    bench = Bench(WithCause(), ["r"])
    model = Model((Choice("b", 0, 1.0),))
    found, normal = bench._fitted(model, corrected=False)
    assert found.deviations["b"] < 0.0  # with the nuisance at 5
    bench.move(found, normal)
    assert bench.point["a"] == bench.reach
    again = bench.normal(bench.linearise(model, corrected=False), model)
    assert abs(bench.point["b"]) < 0.05 and abs(again.g[again.index["b"]]) < 0.01 * again.H[0, 0]


def test_a_set_has_no_evidence_from_where_its_nuisances_may_not_go():
    """The linear model has its optimum beyond: a cause that is missing had hardly told against the set without it."""

    class WithOne(Machine):
        parameters = {"a": Machine.parameters["a"]}  # noqa: RUF012

        def blocks(self, values, recording, wanted=None, disturbed=False):
            return super().blocks({**values, "b": -1.0}, recording)

    def settled(reach):
        bench = Bench(WithOne(), ["r"])
        bench.reach = reach
        found = bench.settle(NOTHING)
        return found.log_posterior, bench._misfits(bench._fitted(NOTHING)[1], found, True)[0]

    (held, misfit), (free, lowest) = settled(4.5), settled(10.0)
    assert misfit - lowest > 300.0
    assert free - held == pytest.approx(misfit - lowest, abs=1.0)


def test_what_stands_beside_the_point_belongs_to_the_point_as_it_is():
    """A set's own optimum may lie elsewhere along what its own form makes up for: its own form there, beside the values
    here, had predicted nothing that was recorded."""
    names = ["a", "b", "own.c.torque.0"]
    columns = np.random.default_rng(1).standard_normal((ROWS, 3))
    columns[:, 2] = columns[:, 0] + 0.01 * columns[:, 2]
    residual = -columns @ [0.5, 0.0, 0.0] + np.random.default_rng(2).standard_normal(ROWS)  # 'a' lies 0.5 away
    normal = Normal(names, columns.T @ columns, columns.T @ residual, float(residual @ residual))
    there = Model((Choice("c", 0, 1.0),), deviations={"own.c.torque.0": 0.0})  # with 'a' moved

    class Held(Bench):
        def settle(self, model, normal=None, steps=3):
            return there

        def _fitted(self, model, corrected=True):
            return model, normal

        def widths(self, columns, model):
            return np.ones(len(columns))

    bench = Held(Machine(), ["r"])
    (beside,) = bench.inserted(there, normal).beside.values()
    left = residual + beside * columns[:, 2]
    assert left @ left < 1.01 * ROWS < residual @ residual
    assert bench.gained_beside(there, normal) == pytest.approx(0.5 * (residual @ residual - left @ left), rel=0.01)


class Bent(Machine):
    """A cause whose derivative vanishes far from where it is, at 3: each full Gauss-Newton step goes further away."""

    units = (Unit("c", "structural", ("torque",), [Variant([Parameter("c", 0.0, 0.0, 50.0)])]),)
    parameters = {"a": Parameter("a", 0.0, 0.0, 1.0), "c": Parameter("c", 0.0, 0.0, 50.0)}  # noqa: RUF012

    def blocks(self, values, recording, wanted=None, disturbed=False):
        noise, one, other = np.random.default_rng(1).standard_normal((3, ROWS))
        off = values["c"] - 3.0
        columns = {"a": one, "c": 10.0 * other / (1.0 + off**2)}
        residual = noise + values["a"] * one + 10.0 * np.arctan(off) * other
        return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]


def test_a_step_after_which_a_set_fits_worse_is_shortened():
    bench = Bench(Bent(), ["r"])
    model = Model((Choice("c", 0, 1.0),))
    assert bench._fitted(model, corrected=False)[0].deviations["c"] > 9.0
    bench.settle(model, steps=6)
    assert bench.point["c"] == pytest.approx(3.0, abs=0.01)


def test_what_is_approached_in_steps_has_the_others_fitted_beside_it_and_the_step_holds_what_it_promises():
    """Cut off after the joint fit, the step would leave the nuisance where it makes up for a cause of its full size."""

    class Stepped(Machine):
        c = Parameter("c", 0.0, 0.0, 0.5)
        parameters = {"a": Parameter("a", 0.0, 0.0, 10.0), "c": c}  # noqa: RUF012
        units = (Unit("c", "structural", ("torque",), [Variant([c]), Variant([c])], on=Variant([c])),)

        def blocks(self, values, recording, wanted=None, disturbed=False):
            noise, one, other = np.random.default_rng(3).standard_normal((3, ROWS))
            columns = {"a": one, "c": one + 0.3 * other}
            residual = noise + (values["a"] + 4.0) * one + (values["c"] - 5.0) * columns["c"]
            return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]

    bench, model = Bench(Stepped(), ["r"]), Model((Choice("c", 0, 1.0),))
    bench.on = {"c"}
    found, normal = bench._fitted(model, corrected=False)
    assert found.deviations["c"] > 2.0
    before = bench._misfits(normal, found, False)[0]
    promised = bench.move(found, normal)
    again, at_point = bench._fitted(model, corrected=False)
    assert bench.point["c"] == 0.5 and abs(bench.point["a"] - 0.5) < 0.2
    assert before - bench._misfits(at_point, again, False)[0] == pytest.approx(promised, rel=1e-6)
    assert abs(at_point.g[at_point.index["a"]]) < 0.01 * at_point.H[0, 0]


def test_a_step_is_shortened_to_the_lowest_point_of_the_parabola():
    """Of a misfit with the slope -2 promised and the value at the whole step, here 10 (1 - 3 s)^2 / 9, least at 1/3."""
    began = Began({"a": 0.0}, (10.0 / 9.0, None), promised=10.0 / 3.0, instead={})
    assert began.rise((40.0 / 9.0, None)) == pytest.approx(30.0 / 9.0)
    assert began.shorter(1.0, 30.0 / 9.0) == pytest.approx(1.0 / 3.0)
    assert began.shorter(0.5, 1e9) == pytest.approx(0.05) and began.shorter(0.5, 0.0) == pytest.approx(0.25)
    assert Began({}, (0.0, None), promised=np.inf, instead={}).shorter(0.2, 1.0) == pytest.approx(0.1)
    assert between({"a": 1.0}, {"a": 3.0}, 0.25) == {"a": 1.5}


def test_one_of_variants_that_look_alike_near_off_is_the_best_at_its_own_optimum():
    class Alike(Machine):
        a, c, d = (Parameter(n, 0.0, 0.0, 1.0) for n in "acd")
        parameters = {"a": a, "c": c, "d": d}  # noqa: RUF012
        units = (Unit("u", "form", ("torque",), [Variant([c]), Variant([d])], alike=True),)

        def blocks(self, values, recording, wanted=None, disturbed=False):
            noise, one, other, second = np.random.default_rng(2).standard_normal((4, ROWS))
            c, d = values["c"], values["d"]
            columns = {"a": one, "c": other + 2.0 * c * second, "d": other - 2.0 * d * second}
            made = (c + d) * other + (c**2 - d**2) * second
            residual = noise + values["a"] * one + made - (0.5 * other - 0.25 * second)  # it is d
            return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]

    bench = Bench(Alike(), ["r"])
    taken = bench.settle(Model((Choice("u", 0, 1.0),)))
    assert bench.point["c"] > 0.2
    best = bench._by_own_variants(taken)
    assert [c.variant for c in best.choices] == [1]
    assert bench.point["c"] == 0.0 and bench.point["d"] == pytest.approx(0.5, abs=0.1)


def test_an_effect_far_from_its_secant_takes_the_place_of_a_form_that_looks_like_it_from_off():
    """The linear model has it at its library's size alone, where it looks another way than where it is."""

    class Shaped(Machine):
        form, tau = Parameter("f", 0.0, 0.0, 1.0), Parameter("s.t", 0.0, 0.0, 1.0)
        secant = Parameter("s#0", 0.0, 0.0, 2.0, secant={"s.t": 2.0})
        parameters = {p.name: p for p in (Parameter("a", 0.0, 0.0, 1.0), form, tau, secant)}  # noqa: RUF012
        units = (
            Unit("s", "structural", ("torque",), [Variant([secant])], Variant([tau])),
            Unit("~lag", "form", ("torque",), [Variant([form])], among=10.0),
        )

        def blocks(self, values, recording, wanted=None, disturbed=False):
            noise, one, other, free = np.random.default_rng(6).standard_normal((4, ROWS))

            def made(t):
                return t * one + 0.2 * t**2 * other

            t = values.get("s.t", 0.0)
            columns = {"a": free, "f": one, "s#0": made(2.0), "s.t": one + 0.4 * t * other}
            residual = noise + values["a"] * free + values.get("f", 0.0) * one + made(t) - made(0.3)
            return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]

    bench, both = Bench(Shaped(), ["r"]), Model((Choice("s", 0, 1.0), Choice("~lag", 0, 1.0)))
    normal = bench.normal(bench.linearise(both, corrected=False), both)
    search = bench._searched(normal, remainders=False)
    assert search.ranked()[0].units == ("~lag",)
    assert bench._leave_out(search, normal)
    assert bench.on == {"s"} and bench.point["s.t"] == pytest.approx(0.3, abs=0.05)
    again = bench._searched(bench.normal(bench.linearise(both, corrected=False), both), remainders=False)
    assert again.ranked()[0].units == ("s",)


def test_an_effect_by_secant_finds_its_place_beside_a_form_that_is_there():
    """Without the form, which explains far more, it had found none."""

    class Mixed(Machine):
        form, tau = Parameter("f", 0.0, 0.0, 100.0), Parameter("s.t", 0.0, 0.0, 1.0)
        secants = [Parameter(f"s#{n}", 0.0, 0.0, 2.0, secant={"s.t": t}) for n, t in enumerate((2.0, 0.5))]  # noqa: RUF012
        parameters = {p.name: p for p in (Parameter("a", 0.0, 0.0, 1.0), form, tau, *secants)}  # noqa: RUF012
        units = (
            Unit("s", "structural", ("torque",), [Variant([s]) for s in secants], Variant([tau])),
            Unit("~f", "form", ("torque",), [Variant([form])], among=10.0, proposed=True),
        )

        def blocks(self, values, recording, wanted=None, disturbed=False):
            noise, one, other, free = np.random.default_rng(6).standard_normal((4, ROWS))

            def made(t):
                return t * one + 0.2 * t**2 * other

            t, steep = values.get("s.t", 0.0), one + 0.1 * free
            columns = {"a": free, "f": steep, "s#0": made(2.0), "s#1": made(0.5), "s.t": one + 0.4 * t * other}
            residual = noise + values["a"] * free + (values.get("f", 0.0) + 40.0) * steep + made(t) - made(1.0)
            return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]

    class Scanned(Bench):
        described = (SimpleNamespace(id="~f"),)

    bench, both = Scanned(Mixed(), ["r"]), Model((Choice("s", 0, 1.0), Choice("~f", 0, 1.0)))
    normal = bench.normal(bench.linearise(both, corrected=False), both)
    found, _ = bench._fitted(both, corrected=False)
    bench.settle(found, normal)
    assert bench.on == {"s", "~f"}
    assert bench.point["s.t"] == pytest.approx(1.0, abs=0.2) and bench.point["f"] == pytest.approx(-40.0, abs=0.3)


def test_a_step_takes_out_what_the_point_holds_of_another_variant():
    """The linear model has it off; left where it was, both would act."""

    class Variants(Machine):
        a, c, d = (Parameter(n, 0.0, 0.0, 1.0) for n in "acd")
        parameters = {"a": a, "c": c, "d": d}  # noqa: RUF012
        units = (Unit("u", "form", ("torque",), [Variant([c]), Variant([d])]),)

        def blocks(self, values, recording, wanted=None, disturbed=False):
            noise, one, other, more = np.random.default_rng(4).standard_normal((4, ROWS))
            columns = {"a": one, "c": other, "d": other + 0.2 * more}
            residual = noise + values["a"] * one + values["c"] * other + (values["d"] - 0.5) * columns["d"]
            return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]

    bench = Bench(Variants(), ["r"])
    bench.settle(Model((Choice("u", 0, 1.0),)))
    assert bench.point["c"] > 0.4
    both = Model((Choice("u", 0, 1.0), Choice("u", 1, 1.0)))
    normal = bench.normal(bench.linearise(both, corrected=False), both)
    reduced = bench.reduce(normal)
    bench.move(bench.searching(reduced, *bench.candidates(reduced)).fit((("u", 1),)), normal)
    assert bench.point["c"] == 0.0 and bench.point["d"] == pytest.approx(0.5, abs=0.1)


def test_a_unit_at_the_end_of_its_tolerance_is_within_reach():
    """0.61 is within four tolerances of 10 %, though its logarithm is 4.9 of them from that of 1."""

    class Scaled(Machine):
        parameters = {"k": Parameter("k", 1.0, 1.0, 0.1, vanishes=0.0)}  # noqa: RUF012

    bench = Bench(Scaled(), ["r"])
    for wanted, held in ((0.61, 0.61), (0.5, 0.6), (1.45, 1.45), (2.0, np.exp(0.4))):
        assert np.exp(np.clip(np.log(wanted), *bench._reach_of("k"))) == pytest.approx(held)


def test_the_hole_of_a_calibration_has_its_edges_at_values_of_the_unit():
    """Four tolerances of 10 % below one are 0.6, whose logarithm is further from one's than that of 1.4."""

    class Scaled(Machine):
        parameters = {  # noqa: RUF012
            "k": Parameter("k", 1.0, 1.0, 0.1, vanishes=0.0),
            "k+": Parameter("k+", 0.0, 0.0, 0.5, alias="k", vanishes=0.0),
        }

    variant = Variant([Scaled.parameters["k+"]], hole=[TOLERANCES * 0.1 / 0.5])
    low, high = Bench(Scaled(), ["r"])._hole(variant)[:, 0] * 0.5
    assert np.exp([low, high]) == pytest.approx([0.6, 1.4])


@pytest.mark.parametrize(("size", "widths"), [(0.02, WIDTHS), (2.0, (1.0, 0.3)), (40.0, (1.0,))])
def test_an_own_form_goes_with_no_prior_that_its_unit_is_too_large_for(size, widths):
    """In proportion to the unit's size it would stand in for all that such a prior has no room for."""

    class Shaped(Machine):
        units = (Unit("b", "structural", ("torque",), [Variant([Parameter("b", 0.0, 0.0, 10.0)])]),)
        parameters = {"a": Parameter("a", 0.0, 0.0, 1.0), "b": Parameter("b", 0.0, 0.0, 10.0)}  # noqa: RUF012

        def own_families(self, equation):
            return ()

    bench = Bench(Shaped(), ["r"])
    bench.sizes = {"b": {"b": -size}}
    names = ["a", "b", "own.b.torque.0"]
    reduced = Reduced(names, np.eye(3), np.zeros(3), 0.0, np.zeros(3))
    _, candidates = bench.candidates(reduced)
    assert candidates["b", 0].widths == WIDTHS
    assert {c.widths for (_, v), c in candidates.items() if v >= OTHER_FORM} == {widths}


def test_a_step_of_a_factor_is_taken_in_its_value_where_that_fits_better():
    """A torque is linear in its friction, however many times as large that is: in logarithms a step goes too far by as
    much as the data tell it, and is shortened again and again."""

    class Friction(Machine):
        c = Parameter("c", 1.0, 1.0, 2.0, vanishes=0.0)
        parameters = {"a": Parameter("a", 0.0, 0.0, 10.0), "c": c}  # noqa: RUF012
        units = (Unit("c", "structural", ("torque",), [Variant([c])]),)

        def blocks(self, values, recording, wanted=None, disturbed=False):
            noise, one, other = np.random.default_rng(3).standard_normal((3, ROWS))
            one, other = 1e3 * one, 1e3 * (one + 0.03 * other)
            residual = noise + (values["a"] + 4.0) * one + (values["c"] - 7.0) * other
            columns = {"a": one, "c": other}
            return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]

    bench = Bench(Friction(), ["r"])
    bench.settle(Model((Choice("c", 0, 1.0),)))
    assert bench.point["c"] == pytest.approx(7.0, abs=0.01) and bench.point["a"] == pytest.approx(-4.0, abs=0.01)
