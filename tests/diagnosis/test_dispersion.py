"""What a unit is told by, over what its score scatters by."""

from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.dispersion import overdispersion
from emafault.diagnosis.fit import Bench
from emafault.diagnosis.model import Block, Parameter, Unit, Variant
from emafault.diagnosis.search import Search
from emafault.diagnosis.sets import Choice, Model
from emafault.diagnosis.whitening import Weights

ROWS = 2000
DRAG = Parameter("drag.c", 0.0, 0.0, 1.0)


class Machine:
    """A coefficient of a driver, and a level, in white noise and a burst that goes with the driver at times."""

    forms = ()
    units = (Unit("drag", "structural", ("torque",), [Variant([DRAG])]),)
    parameters = {"drag.c": DRAG, "level": Parameter("level", 0.0, 0.0, 0.1)}  # noqa: RUF012

    def __init__(self, burst):
        self.noise, self.driver = {}, {}
        for k in range(4):
            rng = np.random.default_rng(k)
            self.driver[f"r{k}"] = rng.standard_normal(ROWS)
            comes_and_goes = np.repeat(rng.standard_normal(ROWS // 100), 100)
            self.noise[f"r{k}"] = rng.standard_normal(ROWS) + burst * comes_and_goes * self.driver[f"r{k}"]

    def blocks(self, values, recording, wanted=None, disturbed=False):
        driver = self.driver[recording]
        residual = self.noise[recording] - 0.1 * driver + values["drag.c"] * driver + values["level"]
        columns = {"drag.c": driver, "level": np.ones(ROWS)}
        return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]


def fitted(burst, kind=Machine):
    """Such a bench, its fit, and the set with the coefficient."""
    machine = kind(burst)
    bench = Bench(machine, list(machine.noise))
    white = Weights(np.ones(ROWS, bool), np.zeros(0), np.ones(ROWS))
    bench.carried = {n: {"torque": white, "bus": white} for n in machine.noise}
    drag = Model((Choice("drag", 0, 1.0),))
    normal = bench.normal(bench.linearise(drag, corrected=False), drag)
    reduced = bench.reduce(normal)
    search = Search(reduced, *bench.candidates(reduced))
    search.run()
    return bench, SimpleNamespace(normal=normal, search=search, models=search.ranked()), search.fit((("drag", 0),))


def test_a_score_in_noise_as_stated_is_not_dispersed():
    assert overdispersion(*fitted(0.0), "drag") == 1.0


def test_what_comes_and_goes_along_a_unit_disperses_its_score():
    """100 rows of variance 1 have a score of variance 100, to which a burst adds its square times 100^2."""
    found = overdispersion(*fitted(0.5), "drag")
    assert found == pytest.approx(1.0 + 0.25 * 100.0, rel=0.5)


class Shared(Machine):
    """The coefficient's equation has the nuisance along the same driver, and another equation tells the nuisance."""

    parameters = {"drag.c": DRAG, "level": Parameter("level", 0.0, 0.0, 10.0)}  # noqa: RUF012

    def blocks(self, values, recording, wanted=None, disturbed=False):
        driver, level = self.driver[recording], values["level"]
        quiet = np.random.default_rng(int(recording[1:]) + 100).standard_normal(ROWS)
        own = quiet + (values["drag.c"] - 0.1 + level) * driver
        other = self.noise[recording] + level * driver
        bands, usable = [np.ones(ROWS)], np.ones(ROWS, bool)
        columns = {"drag.c": driver, "level": driver}
        return [
            Block(recording, "torque", own, columns, bands, usable),
            Block(recording, "bus", other, {"level": driver}, bands, usable),
        ]


def test_the_score_is_that_of_all_equations_that_an_estimate_rests_on():
    """The burst is in the equation that tells the nuisance, in which the unit does not act."""
    assert overdispersion(*fitted(0.0, Shared), "drag") == 1.0
    assert overdispersion(*fitted(0.5, Shared), "drag") > 5.0


def test_a_set_without_a_unit_that_the_point_has_leaves_what_the_unit_adds():
    """The same score, whether the point has a unit that is no member of the set or not."""
    bench, fit, _ = fitted(0.0)
    nothing = Model(())
    assert "drag.c" not in bench.own_deviations(nothing, fit.normal)
    bench.point["drag.c"], bench.on = 0.1, {"drag"}
    drag = Model((Choice("drag", 0, 1.0),))
    normal = bench.normal(bench.linearise(drag, corrected=False), drag)
    assert bench.own_deviations(nothing, normal)["drag.c"] == pytest.approx(-0.1)
