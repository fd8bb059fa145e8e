"""Pages of the documentation: links lead somewhere, and what a page tells of the configuration stands there."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from actuator.test_oracle import TOLERANCE
from emafault.actuator.conduction import BUS_FILTER, MAX_SEGMENT
from emafault.actuator.kernel import SHAFT_DAMPING
from emafault.actuator.state import COGGING_ORDER, MOTOR_SHARE
from emafault.diagnosis.forms import FORMS
from emafault.effects import EFFECTS

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
MADE = {"gallery.md", "verdict.md", "index.md"}  # by docs/generated.py


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", page.read_text())
    missing = [t for t in targets if t not in MADE and not (page.parent / t).exists()]
    assert not missing


def test_the_readme_is_one_screen():
    assert len((ROOT / "README.md").read_text().splitlines()) < 90


EQUATIONS = (ROOT / "docs/equations.md").read_text()
#: a table of defaults: its file, then its rows of symbol, quantity, default, unit and key
TABLE = re.compile(r"^\|.*\| key in `(conf/[^`]+)` \|\n\|[-|]+\|\n((?:\|.*\|\n)+)", re.M)
DEFAULTS = [
    (file, *(cell.strip() for cell in row.strip("|").split("|")))
    for file, rows in TABLE.findall(EQUATIONS)
    for row in rows.splitlines()
]


@pytest.mark.parametrize(("file", "symbol", "quantity", "told", "unit", "key"), DEFAULTS)
def test_the_defaults_of_the_equations_are_those_of_the_configuration(file, symbol, quantity, told, unit, key):
    text = (ROOT / file).read_text()
    value, key = yaml.safe_load(text), key.strip("`")
    for part in key.split("."):
        value = value[part]
    assert value == (told if isinstance(value, str) else float(told))
    comment = re.search(rf"^{key}: .*# (.*)", text, re.M)
    if comment and unit not in ("", "1"):
        assert re.match(rf"{re.escape(unit)}(?![\w/])", comment[1])


def test_the_equations_tell_every_parameter_of_the_default_actuator_once():
    told = {file: [row[-1].strip("`") for row in DEFAULTS if row[0] == file] for file, *_ in DEFAULTS}
    for file in ("conf/actuator/reference.yaml", "conf/sensors/reference.yaml"):
        assert sorted(told[file]) == sorted(yaml.safe_load((ROOT / file).read_text()))
    chosen = yaml.safe_load((ROOT / "conf/config.yaml").read_text())["defaults"]
    default = {f"conf/{group}/{name}.yaml" for d in chosen if isinstance(d, dict) for group, name in d.items() if name}
    assert {file for file in told if not file.startswith("conf/effect/")} <= default


def test_the_equations_tell_every_effect_and_the_figures_of_the_code():
    assert [effect for effect in EFFECTS if f"*{effect}*" not in EQUATIONS] == []
    text = " ".join(EQUATIONS.split())
    magnets = [yaml.safe_load((ROOT / f"conf/magnet/{m}.yaml").read_text())["coefficient"] for m in ("smco", "ndfeb")]
    for told, value in [
        (r"-a sin\((\d+) theta\)", COGGING_ORDER),
        (r"([\d.]+) at the rotor and", MOTOR_SHARE),
        (r"damper of ([\d.]+) N m s/rad", SHAFT_DAMPING),
        (r"first-order lag of ([\d.]+) ms", 1e3 * BUS_FILTER),
        (r"over ([\d.]+) us at most", 1e6 * MAX_SEGMENT),
        (r"alpha_m is (\S+) /K", magnets[0]),
        (r"and (\S+) /K of neodymium", magnets[1]),
        (r"\| speed, angle, output position \| (\S+)", TOLERANCE["speed"]),
        (r"\| bus voltage \| (\S+) \| rounding", TOLERANCE["bus"]),
        (r"phase currents \| (\S+)", TOLERANCE["current"]),
        (r"phase voltages, power \| (\S+)", TOLERANCE["voltage"]),
        (r"\(ripple\) \| (\S+)", TOLERANCE["ripple"]),
    ]:
        assert [float(x) for x in re.findall(told, text)] == [pytest.approx(value)], told
    assert TOLERANCE["speed"] == TOLERANCE["angle"] == TOLERANCE["position"]
    assert TOLERANCE["voltage"] == TOLERANCE["power"]


@pytest.fixture(scope="module")
def signatures():
    """The module that draws the pictures of the gallery."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        return importlib.import_module("signatures")


def test_each_effect_and_form_has_a_signature_that_is_something(signatures):
    assert set(signatures.VIEWS) == set(EFFECTS) and set(signatures.FORM_VIEWS) == set(FORMS)
    for name, views in signatures.VIEWS.items():
        for view in views:
            assert {"commutation": "control"}.get(view.equation, view.equation) in EFFECTS[name].equations, name
            shown = np.concatenate([c.value for c in signatures.curves(name, view)])
            assert np.all(np.isfinite(shown)) and np.ptp([0.0, *shown]) > 1e-6, name
    for name in FORMS:
        assert np.ptp(signatures.form_curve(name).value) > 0.5 * signatures.FORM_SIZE, name


def test_signatures_have_the_sizes_of_the_catalogue(signatures):
    """Three that are plain by hand."""
    actuator = signatures.machine().actuator

    def shown(name):
        (view,) = signatures.VIEWS[name]
        (curve,) = signatures.curves(name, view)
        return curve.along, curve.value, signatures.sizes(name)

    speed, torque, size = shown("viscous_friction")
    drag = actuator.viscous_friction * (size["scale"] - 1.0)
    assert np.polyfit(speed, torque, 1)[0] == pytest.approx(-drag, rel=0.02)
    angle, torque, size = shown("load_spring")
    assert np.polyfit(angle, torque, 1)[0] == pytest.approx(-size["c"] / actuator.gear_ratio, rel=0.02)
    speed, torque, size = shown("stribeck")
    wanted = -size["a"] * np.exp(-np.abs(speed) / size["w_s"]) * np.sign(speed)
    assert np.median(np.abs(torque - wanted)) < 0.02 * size["a"]


def test_a_picture_says_what_it_shows(signatures):
    for picture in (signatures.of_effect("unit_calibration"), signatures.of_form("bump")):
        assert (picture.svg.count("<svg") == 1 and "(N m)" in picture.svg) or "(V)" in picture.svg
        assert re.search(r"over .*; from .* to .* (V|N m)", picture.alt) and picture.apart
        assert not set('"[]') & set(picture.alt)
