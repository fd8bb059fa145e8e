"""Where most of a residual lies: coordinates have units, a machine's own where it states them."""

from emafault.machines.friction_axis import WORDS
from emafault.machines.statement import COORDINATES
from emafault.reporting import regions
from emafault.reporting.page import Page

ENTRY = {"equation": "torque", "along": "rotor_speed", "from": -0.0, "to": 72.5, "z": 361.0, "share": 0.65}


def cells(where, words=None):
    page = Page("x")
    regions.add_regions(page, where, words)
    return page.parts[-1]


def test_a_region_has_the_unit_of_its_coordinate():
    assert "<td class=words>rotor speed</td><td class=words>0 to 72.5 rad/s</td>" in cells([ENTRY])
    assert "<td class=words>speed</td><td class=words>0 to 72.5 m/s</td>" in cells([ENTRY], WORDS)
    assert ">0 to 72.5</td>" in cells([ENTRY | {"along": "direction"}])


def test_every_coordinate_that_rows_may_lie_along_has_words():
    assert set(regions.COORDINATES) == set(COORDINATES)
    for name in ("time", "position"):
        assert regions.coordinate(name, WORDS).endswith(("(s)", "(m)"))
    assert regions.coordinate("my_own") == "my own"
