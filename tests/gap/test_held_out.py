"""What the confirm recordings leave of a verdict."""

from types import SimpleNamespace

import pytest

from emafault.gap.decide import share_left
from emafault.gap.held_out import claim
from emafault.gap.misfit import MOST


def verdict():
    first = {"effects": ["magnet_temperature", "iron_loss"], "probability": 0.9, "group": None}
    first["parameters"] = {"alpha_m": {"effect": "magnet_temperature"}, "G": {"effect": "iron_loss"}}
    rest = [
        {"effects": [], "probability": 0.02, "group": None},
        {"effects": ["unknown"], "probability": 0.08, "group": None},
    ]
    return SimpleNamespace(verdict={"verdict": "explained", "which": [first, *rest]})


def test_what_rivals_share_is_claimed():
    found = verdict()
    claim(found, {"outcome": "rival", "claimed": ["magnet_temperature"]})
    first = found.verdict["which"][0]
    assert found.verdict["verdict"] == "partly" and first["effects"] == ["magnet_temperature"]
    assert first["probability"] == 0.9 and list(first["parameters"]) == ["alpha_m"]
    assert sum(e["probability"] for e in found.verdict["which"]) == pytest.approx(1.0)


def test_nothing_is_claimed_where_rivals_share_nothing():
    found = verdict()
    claim(found, {"outcome": "rival", "claimed": []})
    assert found.verdict["verdict"] == "unknown" and found.verdict["which"][0]["effects"] == ["unknown"]
    assert sum(e["probability"] for e in found.verdict["which"]) == pytest.approx(1.0)


def test_a_set_that_holds_is_left_alone():
    found = verdict()
    claim(found, {"outcome": "holds", "claimed": ["magnet_temperature", "iron_loss"]})
    assert found.verdict["verdict"] == "explained" and found.verdict["which"][0]["probability"] == 0.9


def test_held_out_share():
    assert share_left(1.0, 1.0, 800) is None
    helped = share_left(5.0, 1.1, 800)
    assert helped is not None and helped < MOST
    idle = share_left(5.0, 4.9, 800)
    assert idle is not None and idle > MOST
    made_worse = share_left(1.0, 3.0, 800)
    assert made_worse is not None and made_worse > 1.0
