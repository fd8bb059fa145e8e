"""Handing over the fix: the verdict's effects and the unit's own values as an experiment that the workflow runs."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import one_line
from ..plain import escaped
from ..reporting.written import FROM_DIAGNOSIS


def experiment_text(verdict: Mapping[str, Any], effects: Mapping[str, Mapping[str, float]], name: str) -> str:
    """A Hydra experiment in YAML.

    Parameters
    ----------
    effects : effect -> parameter -> value, as fitted; the unit's tolerances are values of the calibration effects
    name : of the experiment and its folder of results
    """
    from omegaconf import OmegaConf

    rounded = {e: {p: float(f"{v:.8g}") for p, v in values.items()} for e, values in effects.items()}
    named = sorted({e for e in verdict["which"][0]["effects"] if e != "unknown"})
    what = f"{_in_words(named)} and its unit's tolerances" if named else "its unit's tolerances alone"
    bench = one_line(verdict["bench"])  # a name's line break would end the comment, its ${} be looked up
    body = OmegaConf.to_yaml(
        OmegaConf.create(
            {
                "name": name,
                "question": escaped(f"How well is the actuator of bench {bench} identified with {what} simulated?"),
                "effects": rounded,
            }
        )
    )
    head = (
        f"{FROM_DIAGNOSIS}{bench}: verdict {verdict['verdict']}, digest {verdict['digest']}\n"
        "defaults:\n"
        "  - override /reconstruction: [weighted, weighted_floating]\n"
        "  - override /search: none\n"
        "  - override /load: none\n"
        "  - override /magnet: constant\n"
    )
    return head + body


def _in_words(effects: Sequence[str]) -> str:
    """Effects in words: ``friction asymmetry and load constant``."""
    names = [e.replace("_", " ") for e in effects]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
