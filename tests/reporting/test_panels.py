"""Charts and tables of a page: what they carry is what was fitted."""

import base64
import html.parser
import json
import re

import numpy as np
import pytest

from emafault.reporting.numbers import Number, Numbers, add_numbers, as_told, trading
from emafault.reporting.page import Page
from emafault.reporting.panels import MOST, Curves, Panel, said


def curves(name="a.nc", size=5000, aside=False, seed=0):
    """A gap of two standard deviations at speeds above zero, none after."""
    rng = np.random.default_rng(seed)
    time, noise = np.linspace(0.0, 1.0, size), rng.standard_normal(size)
    speed = 10.0 * np.sin(20.0 * time)
    before = noise + 2.0 * (speed > 0)
    squares = float(before @ before), float(noise @ noise)
    along = {"time (s)": time, "rotor speed (rad/s)": speed}
    return Curves(name, along, before, noise, np.full(size, 0.5), speed + before, squares, aside)


def carried(text):
    """The data of each chart of a page."""
    return [json.loads(x) for x in re.findall(r'<script type="application/json">(.*?)</script>', text)]


def numbers(packed):
    whole = np.frombuffer(base64.b64decode(packed["data"]), "<u2").astype(float)
    return packed["low"] + packed["step"] * whole


@pytest.fixture
def written(tmp_path):
    page = Page("A </script> of <names>")
    for heading in ("One", "Two", "Two"):
        page.heading(heading)
    page.panels([Panel("sensor_speed", "speed", [curves("</script><b>.nc"), curves("v", aside=True, seed=1)])])
    page.write(tmp_path / "page.html")
    return (tmp_path / "page.html").read_text()


def test_a_chart_carries_its_rows_to_sixteen_bits_spread_evenly(written):
    (panel,) = carried(written)
    first = panel["recordings"][0]
    time, speed = (numbers(p) for p in first["along"])
    assert len(time) == MOST // 2 and np.max(np.diff(time)) < 3.0 / len(time)
    assert speed == pytest.approx(10.0 * np.sin(20.0 * time), abs=2e-2)
    predicted = numbers(first["measured"]) - numbers(first["before"]) * first["deviation"]
    assert predicted == pytest.approx(speed + 0.5 * numbers(first["before"]), abs=2e-3)


def test_means_over_a_coordinate_show_what_single_rows_hide(written):
    (panel,) = carried(written)
    means = panel["means"][panel["along"].index("rotor speed (rad/s)")]
    x, before, after = (numbers(means[k]) for k in ("x", "before", "after"))
    assert np.abs(before[x > 0.5] - 2.0).max() < 0.6 and np.abs(before[x < -0.5]).max() < 0.6
    assert np.abs(after).max() < 0.6


def test_the_result_is_said_to_who_cannot_see_it():
    text = said(Panel("sensor_speed", "", [curves(), curves(aside=True, seed=1)]))
    assert re.fullmatch(
        r"Sensor speed: the residual over the noise falls from 1\.[67]\d? to (1(\.0\d)?|0\.99\d) \(root mean square\); "
        r"it is (1(\.0\d)?|0\.9\d+) on the validation recordings alone\.", text
    )  # fmt: skip


class Tags(html.parser.HTMLParser):
    """Ids, links within the page and open tags."""

    def __init__(self):
        super().__init__()
        self.ids, self.links, self.open = [], [], []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found["href"][1:]] if found.get("href", "").startswith("#") else []
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_a_page_is_whole_and_its_contents_lead_somewhere(written):
    tags = Tags()
    tags.feed(written)
    assert not tags.open and len(tags.links) == 4 and set(tags.links) <= set(tags.ids)
    assert len(set(tags.ids)) == len(tags.ids)
    assert "Permission is hereby granted" in written and "://" not in written


def fitted(*correlations):
    one = [Number(n, "unit", 1.0, -1e-17, 0.1, 1.0, "kg") for n in ("mass", "gain")]
    many = [*one, Number("zero, a", "recording", 0.0, 0.0, 1.0, 1.0, "rad")]
    matrix = np.eye(3)
    for (i, k), r in zip(((0, 1), (0, 2), (1, 2)), correlations, strict=True):
        matrix[i, k] = matrix[k, i] = r
    return Numbers(many, matrix)


def test_what_trades_off_is_told_with_its_sign_and_never_of_one_recording():
    assert trading(fitted(0.4, 0.9, 0.9)) == []
    page = Page("x")
    add_numbers(page, fitted(-0.8, 0.99, 0.0))
    text = "".join(page.parts)
    assert "mass and gain" in text and "a larger value of the first goes with a smaller one of the second" in text
    assert "were one known, the other would be 60 % as uncertain" in text
    assert text.index("mass") < text.index("<details>") < text.index("zero, a") < text.index("</details>")


def test_a_number_has_one_interval_on_a_page():
    a = {"value": 2.0, "low": 1.0, "high": 3.0, "effect": "x_y"}
    told = {"which": [{"effects": []}, {"effects": ["x_y"], "parameters": {"a": a}}],
            "controller": {"gain": {"value": 5.0, "low": 4.0, "high": 6.0}}}  # fmt: skip
    names = ("x y: a", "controller: gain", "mass")
    found = as_told(Numbers([Number(n, "unit", 0.0, 1.0, 0.1, 1.0, "1") for n in names], np.eye(3)), told, ["x_y"])
    assert [n.value for n in found.numbers] == [2.0, 5.0, 1.0]
    assert [n.sd for n in found.numbers] == pytest.approx([1 / 1.645, 1 / 1.645, 0.1])


def test_every_number_has_a_unit_and_is_called_by_its_words():
    numbers = [Number("x: a", "unit", 0.0, 1.0, 0.1, 1.0, "1", "share of x"), Number("b", "unit", 0, 1, 0.1, 1, "")]
    page = Page("x")
    add_numbers(page, Numbers(numbers, np.eye(2)))
    rows = re.findall(r"<tr><td.*?</tr>", "".join(page.parts))
    cells = [re.findall(r"<td.*?>(.*?)</td>", row) for row in rows]
    assert [(c[0], c[5]) for c in cells] == [("share of x", "1"), ("b", "1")]


def test_no_number_is_minus_zero():
    page = Page("x")
    tiny = Number("m", "unit", -0.0, -0.0, 0.0, 1.0, "1")
    add_numbers(page, Numbers([tiny], np.eye(1)))
    assert not re.search(r"-0(?![.\d])", re.sub("<[^>]*>", " ", "".join(page.parts)))
