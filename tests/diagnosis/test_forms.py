"""Described forms: each is found where it is, none where there is none, and found forms are columns like any other."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.described import ALSO, Described, WithForms
from emafault.diagnosis.describing import Describing
from emafault.diagnosis.forms import FORMS, function
from emafault.diagnosis.forms.memory import columns
from emafault.diagnosis.left import Left, gain
from emafault.diagnosis.model import Block
from emafault.diagnosis.scanning import proposed, refined, scanned
from emafault.diagnosis.wandering import log_odds
from emafault.diagnosis.whitening import WANDERING, Weights, coloured, filtered

H, SIZE, NAMES = 2e-4, 4000, ("one", "two", "three")


def coordinates(number):
    """Of a recording that turns to and fro at its own rate."""
    time = (np.arange(SIZE) + 0.5) * H
    speed = 150.0 * np.sin(2.0 * np.pi * (1.5 + 0.3 * number) * time + number)
    angle = np.cumsum(speed) * H + number
    current = 4.0 + 2.0 * np.cos(2.0 * np.pi * 3.0 * time + number)
    return {
        "time": time, "rotor_speed": speed, "angle": angle, "rotor_angle": np.mod(angle, 2.0 * np.pi),
        "current": current, "output_angle": angle / 100.0, "temperature": np.full(SIZE, 20.0 + number),
        "drivers": np.array([np.ones(SIZE), np.sign(speed)]), "direction": np.sign(speed),
    }  # fmt: skip


class Machine:
    """One equation with white noise and a form in it, or none."""

    recordings, units, parameters = NAMES, (), {}

    def __init__(self, word=None, shape=None, sizes=(), driver=0):
        self.found, drivers = [], []
        for number, name in enumerate(NAMES):
            rng = np.random.default_rng(number)
            along = coordinates(number)
            left = rng.standard_normal(SIZE)
            if word is not None:
                # a form of each recording's own has its coefficients another way round in the next
                own = np.roll(sizes, number) if FORMS[word].EACH else np.asarray(sizes)
                left = left + own @ FORMS[word].columns(along, shape) * along["drivers"][driver]
            usable = np.ones(SIZE, bool)
            drivers.append(along["drivers"])
            self.found.append(Block(name, "torque", left, {}, [np.ones(SIZE)], usable, along))
        # drivers have coefficients of their own, which have been fitted
        X, y = np.hstack(drivers).T, np.concatenate([b.residual for b in self.found])
        fitted = np.split(X @ np.linalg.lstsq(X, y, rcond=None)[0], len(NAMES))
        for b, part in zip(self.found, fitted, strict=True):
            b.residual = b.residual - part
        self.carried = {n: {"torque": Weights(np.ones(SIZE, bool), np.zeros(0), np.ones(SIZE))} for n in NAMES}

    moving = ()

    def channels(self, equation, driver):
        return ()

    def coefficients(self, equation, driver):
        return ()

    def blocks(self, values, name, disturbed=False, wanted=None):
        b = self.found[NAMES.index(name)]
        return [Block(b.recording, b.equation, b.residual.copy(), {}, b.bands, b.usable, b.coordinates)]

    def proposed(self):
        return proposed(self, scanned(self, self.found, self.carried, {}, "x"))


CASES = [
    ("order", {"order": 3.27}, (0.15, 0.1), 0),
    ("order", {"order": 2.0}, (0.15, 0.1), 1),
    ("order", {"order": 78.0}, (0.15, 0.1), 0),  # of teeth
    ("order", {"order": 1.0}, (0.3, 0.2), 0),  # and no bump as wide as the turn
    ("frequency", {"frequency": 41.7}, (0.2, 0.1), 0),
    ("bump", {"centre": 2.1, "width": 0.25}, (0.4,), 0),
    ("step_change", {"time": 0.31}, (0.5,), 1),
    ("pulse", {"time": 0.21, "until": 0.34}, (0.5,), 0),
    ("function", {"coordinate": 0.0, "from": -150.0, "to": 150.0}, (0.3, -0.2, 0.1, 0.2, -0.2), 0),
    ("power", {"exponent": 2.0}, (0.4,), 1),
    ("memory", {"source": 0.0, "time_constant": 0.12}, (0.05,), 1),
    ("memory", {"source": 2.0, "time_constant": 0.1}, (0.6,), 0),
    ("travel", {"length": 1.5}, (0.4,), 0),
]


@pytest.mark.parametrize(("word", "shape", "sizes", "driver"), CASES, ids=[f"{c[0]}{c[3]}" for c in CASES])
def test_a_form_is_found_where_it_is(word, shape, sizes, driver):
    machine = Machine(word, shape, sizes, driver)
    first = machine.proposed()[0]
    first = refined(WithForms(machine, [first]), first, machine.found, machine.carried, {}, {})
    assert first.word == word
    assert first.driver == driver or word == "function"  # of the speed, its sign makes another one
    for name, value, deviation, _ in first.shape:
        if word != "function":
            assert abs(value - shape[name]) < 5.0 * max(deviation, 1e-9) + 0.02 * abs(shape[name]), name
    if word == "order" and shape["order"] in (1.0, 2.0):
        assert first.values["order"] == shape["order"]  # what turns with the rotor


def test_what_builds_up_from_the_start_may_be_what_goes():
    found = Machine("memory", {"source": 2.0, "time_constant": 0.1}, (0.6,), 0).proposed()
    first, also = (d for d in found if d.word == "memory")
    assert {first.values["source"], also.values["source"]} == {2.0, 3.0}
    assert first.values["time_constant"] == also.values["time_constant"] and also.id == first.id + ALSO
    built, gone = (columns(coordinates(0), {"source": k, "time_constant": 0.1}) for k in (2.0, 3.0))
    np.testing.assert_allclose(built + gone, 1.0)


def test_a_function_may_be_one_over_a_part_of_the_range_and_nothing_on_a_side_of_that():
    part = {"coordinate": 3.0, "from": 0.31, "to": 0.42, "nothing": 1.0}
    found = Machine("function", part, (0.5, 0.9, 1.1, 0.9, 0.6), 0).proposed()
    first, also = (d for d in found if d.word == "function")
    assert {first.values["nothing"], also.values["nothing"]} == {1.0, 2.0} and also.id == first.id + ALSO
    for end in ("from", "to"):
        assert first.values[end] == also.values[end] == pytest.approx(part[end], abs=0.05)  # of 0.8 s
    machine = Machine("function", part, (0.5, 0.9, 1.1, 0.9, 0.6), 0)
    better = refined(WithForms(machine, [first]), first, machine.found, machine.carried, {}, {})
    assert better.values["from"] < better.values["to"]


@pytest.mark.parametrize("part", [(0.5, 1.0 + 1e-12), (-1e-12, 0.5)])
def test_ends_of_a_part_stay_within_the_range_whatever_rounding_makes_of_them(part):
    machine = Machine()
    left = Left("torque", machine.found, [machine.carried[n]["torque"] for n in NAMES])
    low, high = (float(f(machine.found[0].coordinates["time"])) for f in (np.min, np.max))
    ends = {end: low + share * (high - low) for end, share in zip(("from", "to"), part, strict=True)}
    for found in function.fine(left, 0, {"coordinate": 3.0, **ends, "nothing": 0.0}):
        shape = {n: v for n, v, _, _ in found.shape}
        assert low - 1e-9 <= shape["from"] < shape["to"] <= high + 1e-9


@pytest.mark.parametrize(("word", "shape", "possible"), [
    ("function", {"coordinate": 3.0, "from": 0.2, "to": 0.2}, False), ("pulse", {"time": 0.3, "until": 0.2}, False),
    ("function", {"coordinate": 3.0, "from": 0.2, "to": 0.3}, True), ("bump", {"centre": 1.0, "width": 0.0}, False),
    ("power", {"exponent": 0.5}, True),
])  # fmt: skip
def test_ends_are_in_order_and_sizes_above_zero(word, shape, possible):
    form = Described("~x", word, "torque", 0, tuple((n, v, 1.0, "") for n, v in shape.items()), 1.0, 1.0)
    assert form.possible is possible


def test_columns_that_no_row_tells_apart_explain_what_one_of_them_does():
    """A part of a range that no row lies in has as many columns of a step."""
    step = np.ones((3, 3))
    one = gain(np.array([30.0]), np.array([[10.0]]))
    alike = gain(np.full(3, 30.0), 10.0 * step + 1e-5 * np.triu(step, 1) + 1e-5 * np.tril(step, -1))
    assert np.isfinite(alike) and alike == pytest.approx(one, abs=4.0)


WHOLE = (("coordinate", 2.0, 0.0, ""), ("from", -0.02, 0.0, "rad"), ("to", 0.1, 0.0, "rad"), ("nothing", 0.0, 0.0, ""))


def test_over_more_recordings_a_function_is_the_same_over_their_range():
    wide = function.widened(WHOLE, {"output_angle": (-0.05, 0.08)})
    before, after = ({n: v for n, v, _, _ in shape} for shape in (WHOLE, wide))
    assert (after["from"], after["to"]) == (-0.05, 0.1)
    x = {"output_angle": np.linspace(0.0, 0.1, 9)}
    cubic = np.linalg.lstsq(function.columns(x, before).T, 1e3 * x["output_angle"] ** 3)[0]
    straight = np.linalg.lstsq(function.columns(x, before).T, x["output_angle"])[0]
    for coefficients in (cubic, straight):
        same = function.converted(coefficients, before, after)
        inside = {"output_angle": np.linspace(0.02, 0.1, 9)}  # near the end that it had a kink comes in
        was, is_now = coefficients @ function.columns(inside, before), same @ function.columns(inside, after)
        np.testing.assert_allclose(is_now, was, atol=0.02 * np.ptp(was))
    part = tuple((n, v, 0.01 if n == "from" else 0.0, unit) for n, v, _, unit in WHOLE)
    assert function.widened(part, {"output_angle": (-0.05, 0.2)}) == part


@pytest.mark.parametrize(("equation", "seen", "channel"), [("torque", "", ""), ("sensor_speed", "torque", "speed")])
def test_a_function_goes_over_what_the_equation_that_showed_it_lies_along(equation, seen, channel):
    form = Described("~f", "function", equation, 0, WHOLE, 1.0, 1.0, seen=seen, channel=channel)
    machine = Machine()
    wide = Describing(machine, list(NAMES))._over_all(form)
    angle = np.concatenate([b.coordinates["output_angle"] for b in machine.found])
    assert (wide.values["from"], wide.values["to"]) == (min(angle.min(), -0.02), max(angle.max(), 0.1))


def test_rows_beyond_where_a_function_was_seen_say_nothing_of_it():
    machine = Machine()
    shape = (("coordinate", 2.0, 0.0, ""), ("from", 0.0, 0.0, "rad"), ("to", 0.01, 0.0, "rad"))
    form = Described("~f", "function", "torque", 0, shape, 1.0, 1.0)
    (block,) = WithForms(machine, [form]).blocks({}, "one", wanted=())
    angle = machine.found[0].coordinates["output_angle"]
    assert block.usable.any() and np.array_equal(block.usable, (angle >= 0.0) & (angle <= 0.01))
    part = replace(form, shape=tuple((n, v, 1e-3 * (n == "to"), unit) for n, v, _, unit in shape))
    assert WithForms(machine, [part]).blocks({}, "one", wanted=())[0].usable.all()


def test_beyond_a_part_a_function_is_nothing_on_one_side():
    x = np.array([0.0, 0.25, 1.0])
    part = {"coordinate": 3.0, "from": 0.2, "to": 0.3}
    above, below = (FORMS["function"].columns({"time": x}, part | {"nothing": k}) for k in (1.0, 2.0))
    for of, nothing, acts in ((above, 0, 2), (below, 2, 0)):
        np.testing.assert_allclose(of[:, nothing], 0.0, atol=1e-12)
        assert abs(of[:, acts]).max() == pytest.approx(1.0) and abs(of[:, 1]).sum() > 0.1
    told = FORMS["function"].told(np.arange(1.0, 6.0), part | {"nothing": 2.0})
    assert list(told.values()) == [1.0, 2.0, 3.0, 4.0, 5.0, 0.0]


SIZES = [(c[0], c[1], c[2], c[3], n) for c in CASES for n in FORMS[c[0]].POSITIVE]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("word", "shape", "sizes", "driver", "size"), SIZES, ids=[f"{c[0]}{c[3]}" for c in SIZES])
def test_a_size_that_is_known_roughly_is_looked_for_above_zero(word, shape, sizes, driver, size):
    machine = Machine(word, shape, sizes, driver)
    first = machine.proposed()[0]
    wide = tuple((n, v, 1.01 * v if n == size else d, unit) for n, v, d, unit in first.shape)
    rough = Described(first.id, word, "torque", driver, wide, first.scale, 1.0)
    found = refined(WithForms(machine, [rough]), rough, machine.found, machine.carried, {}, {})
    assert found.values[size] > 0.0


def test_a_shape_ends_at_its_optimum_however_far_it_begins():
    machine = Machine("power", {"exponent": 2.0}, (4.0,), 1)
    scale = machine.proposed()[0].scale
    ends = []
    for begun in (1.6, 2.0, 2.9):
        rough = Described("~p", "power", "torque", 1, (("exponent", begun, 0.03, "1"),), scale, 1.0)
        found = refined(WithForms(machine, [rough]), rough, machine.found, machine.carried, {}, {})
        ends.append(found.values["exponent"])
    assert np.ptp(ends) < 0.1 * 0.03
    assert np.mean(ends) == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("parts", [2, 3])
def test_a_scan_in_parts_finds_what_one_does(parts):
    machine = Machine("order", {"order": 3.27}, (0.15, 0.1))
    other = [Block("one", "speed", b.residual, {}, b.bands, b.usable, b.coordinates) for b in machine.found]
    blocks = [*machine.found, *other]
    carried = {n: {**w, "speed": w["torque"]} for n, w in machine.carried.items()}
    whole = scanned(machine, blocks, carried, {}, "x")
    in_parts = [f for k in range(parts) for f in scanned(machine, blocks, carried, {}, "x", k, parts)]
    assert {f.equation for _, f in whole} == {"torque", "speed"}
    assert sorted(f.id for _, f in in_parts) == sorted(f.id for _, f in whole)
    assert proposed(machine, in_parts) == proposed(machine, whole)


def test_a_recording_of_a_row_is_passed_over():
    machine = Machine("order", {"order": 3.27}, (0.15, 0.1))
    whole = machine.proposed()
    b = machine.found[0]
    along = {n: np.asarray(x)[..., :1] if n != "slow" else x for n, x in b.coordinates.items()}
    one = Block("short", "torque", b.residual[:1], {}, [b.bands[0][:1]], b.usable[:1], along)
    carried = {**machine.carried, "short": {"torque": Weights(b.usable[:1], np.zeros(0), np.ones(1))}}
    assert proposed(machine, scanned(machine, [*machine.found, one], carried, {}, "x")) == whole


def test_what_is_free_beside_a_form_is_taken_out():
    machine = Machine("power", {"exponent": 2.0}, (1.0,), 1)
    free = {"level": (0.0, 10.0), "slope": (0.0, 10.0)}
    for b in machine.found:  # what every machine has beside it, away from where it would be fitted with it
        drag = b.coordinates["drivers"][1]
        b.columns |= {"level": -drag, "slope": -np.abs(b.coordinates["rotor_speed"]) / 100.0 * drag}
        b.residual = b.residual + 0.8 * b.columns["slope"]
    seen = {d.word: (v, d.values) for v, d in scanned(machine, machine.found, machine.carried, free, "x")}
    assert max(seen, key=lambda w: seen[w][0]) == "power" and seen["power"][1]["exponent"] == pytest.approx(
        2.0, rel=0.2
    )
    blind = {d.word: (v, d.values) for v, d in scanned(machine, machine.found, machine.carried, {}, "x")}
    assert abs(blind["power"][1]["exponent"] - 2.0) > 0.4


def test_a_form_that_is_free_anyway_is_none():
    machine = Machine()
    for b in machine.found:
        power = FORMS["power"].columns(b.coordinates, {"exponent": 2.0})[0] * b.coordinates["drivers"][1]
        b.columns |= {"drag": -power, "level": -b.coordinates["drivers"][1]}
        b.residual = b.residual + 0.4 * power
    assert scanned(machine, machine.found, machine.carried, {}, "x")
    assert not scanned(machine, machine.found, machine.carried, {"drag": (0.0, 10.0), "level": (0.0, 10.0)}, "x")


def test_noise_alone_has_no_form():
    assert Machine().proposed() == []


def test_a_found_form_is_taken_out_by_its_coefficients():
    machine = Machine("order", {"order": 3.27}, (0.5, 0.2))
    form = Described("~order", "order", "torque", 0, (("order", 3.27, 0.01, "1"),), 1.0, 100.0)
    both = WithForms(machine, [form])
    names = form.names("one")
    assert [p.name for p in both.units[0].parameters] == names and both.units[0].among == 100.0
    at = dict(zip(names, (0.5, 0.2), strict=True))
    before, after = both.blocks({}, "one")[0], both.blocks(at, "one")[0]
    assert np.var(after.residual) < 0.95 * np.var(before.residual)
    step = 1e-3
    more = both.blocks({**at, names[0]: at[names[0]] + step}, "one")[0]
    assert np.allclose((more.residual - after.residual) / step, after.columns[names[0]])
    assert both.blocks({}, "one", wanted=())[0].columns == {}


def test_a_form_of_each_recording_has_coefficients_of_each():
    form = Described("~f", "frequency", "torque", 0, (("frequency", 40.0, 0.1, "Hz"),), 1.0, 100.0)
    names = [p.name for p in form.unit(NAMES).parameters]
    assert len(names) == 6 and names[0].endswith("@one") and names[-1].endswith("@three")


def test_what_comes_and_goes_counts_less():
    rng = np.random.default_rng(4)
    white = rng.standard_normal(6000)
    white[2000:2600] *= 8.0
    keep = np.ones(len(white), bool)
    weights = coloured(white, keep)
    assert np.median(weights.variance[2100:2500]) > 20.0 * np.median(weights.variance[4000:])
    assert np.mean(filtered(white[:, None], weights) ** 2) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("changing", [False, True])
def test_the_noise_of_a_converter_s_steps_is_no_less_for_rows_that_leave_nothing(changing):
    """Most rows may leave nothing as all of a current is rounded off; the others have all of the error."""
    rng = np.random.default_rng(7)
    white = np.where(rng.random(6000) < 0.1, rng.standard_normal(6000), 0.0)
    keep = np.ones(len(white), bool)
    assert np.median(coloured(white, keep, changing).variance) < 0.2
    weights = coloured(white, keep, changing, 1.0)
    assert weights.variance.min() == pytest.approx(1.0) and not len(weights.coefficients)


def test_a_level_that_wanders_does_not_look_like_a_constant():
    rng = np.random.default_rng(5)
    keep = np.ones(8000, bool)
    white = rng.standard_normal(8000) + np.cumsum(0.1 * rng.standard_normal(8000))
    weights = coloured(white, keep)
    assert weights.wander > 0.0
    assert np.argmax(weights.wandering) == WANDERING.index(weights.wander) and max(weights.wandering) > 100.0
    constant = filtered(np.ones((8000, 1)), weights)[:, 0]
    assert constant @ constant < 200.0  # white noise would have 8000
    steady = coloured(rng.standard_normal(8000), keep)
    assert steady.wander == 0.0 and max(steady.wandering) < 5.0


@pytest.mark.parametrize("span", [3, 5, 10])
def test_noise_that_is_a_moving_average_does_not_wander(span):
    """What an autoregression of the spectrum without dips lacks of it, a level must not be found to take up."""
    noise = np.random.default_rng(span).standard_normal(4000 + span - 1)
    weights = coloured(np.convolve(noise, np.ones(span), "valid") / np.sqrt(span), np.ones(4000, bool))
    assert weights.wander == 0.0 and max(weights.wandering[1:]) < 0.0


def test_a_beat_of_counts_with_samples_is_the_colour_of_rounding_and_a_wave_where_nothing_is_rounded():
    values = []
    for rounded in (False, True):
        machine = Machine("frequency", {"frequency": 700.0}, (1.2, 0.5))
        for b in machine.found:
            b.rounded = rounded
            machine.carried[b.recording]["torque"] = coloured(np.asarray(b.residual), b.usable, False)
        found = scanned(machine, machine.found, machine.carried, {}, "x")
        values.append(max((v for v, d in found if d.word == "frequency"), default=0.0))
    assert values[0] > 1000.0 and values[1] < 0.1 * values[0]


def test_wandering_is_asked_of_all_recordings_together():
    def bench(*levels):
        rng = np.random.default_rng(6)
        keep = np.ones(4000, bool)
        carried = {
            f"r{n}": {
                "torque": coloured(rng.standard_normal(4000) + np.cumsum(level * rng.standard_normal(4000)), keep)
            }
            for n, level in enumerate(levels)
        }
        return SimpleNamespace(carried=carried, recordings=list(carried))

    assert log_odds(bench(0.0, 0.0, 0.0))["torque"] < -1.0
    assert log_odds(bench(0.05, 0.05, 0.05))["torque"] > 10.0
    short = {"a": {"torque": coloured(np.ones(50), np.ones(50, bool), False)}}
    assert log_odds(SimpleNamespace(carried=short, recordings=["a"])) == {}
    # what the explored recordings do not show, or those that confirm do not, is not there
    assert log_odds(bench(0.05, 0.05, 0.05), ["r2"])["torque"] > 10.0
    assert log_odds(bench(0.05, 0.05, 0.0), ["r2"])["torque"] < 0.0
    assert log_odds(bench(0.0, 0.0, 0.05), ["r2"])["torque"] < 0.0


def test_what_goes_with_the_current_is_nothing_at_none():
    """There the machine is as it is: a constant of what goes with anything else is a coefficient of its own."""
    shape = {"coordinate": 1.0, "from": 0.0, "to": 6.0}
    current = np.linspace(0.0, 6.0, 61)
    of_current = np.arange(1.0, 6.0) @ FORMS["function"].columns({"current": current}, shape)
    assert of_current[0] == pytest.approx(0.0, abs=1e-12)
    told = FORMS["function"].told(np.arange(1.0, 6.0), shape)
    np.testing.assert_allclose(of_current[::12], list(told.values()), atol=1e-9)
    of_speed = FORMS["function"].told(np.arange(1.0, 6.0), {**shape, "coordinate": 0.0})
    assert sum(of_speed.values()) == pytest.approx(0.0, abs=1e-9)


def test_what_goes_with_the_output_angle_is_nothing_at_its_zero():
    """A spring that stiffens needs no constant torque beside it, which no machine has."""
    shape = {"coordinate": 2.0, "from": -0.02, "to": 0.118}
    angle = np.append(np.linspace(-0.02, 0.118, 60), 0.0)
    columns = FORMS["function"].columns({"output_angle": angle}, shape)
    np.testing.assert_allclose(columns[:, -1], 0.0, atol=1e-12)
    stiffening = 120.0 * angle**3
    found, *_ = np.linalg.lstsq(columns.T, stiffening, rcond=None)
    np.testing.assert_allclose(found @ columns, stiffening, atol=1e-9)
    told = FORMS["function"].told(found, shape)
    np.testing.assert_allclose(list(told.values()), 120.0 * np.linspace(-0.02, 0.118, 6) ** 3, atol=1e-9)
    beyond = {**shape, "from": -0.2, "to": -0.1}  # nothing where it is nearest to zero
    nearest = FORMS["function"].columns({"output_angle": np.array([-0.1])}, beyond)
    np.testing.assert_allclose(nearest, 0.0, atol=1e-12)
