"""Handing over the fix: the verdict's effects and the unit's own values as an experiment that the workflow runs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..recording import replace_atomically
from .words import effect_words


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
    what = f"{effect_words(named)} and its unit's tolerances" if named else "its unit's tolerances alone"
    body = OmegaConf.to_yaml(
        OmegaConf.create(
            {
                "name": name,
                "question": f"How well is the actuator of bench {verdict['bench']} identified with {what} simulated?",
                "effects": rounded,
            }
        )
    )
    head = (
        "# @package _global_\n"
        f"# from the diagnosis of {verdict['bench']}: verdict {verdict['verdict']}, digest {verdict['digest']}\n"
        "defaults:\n"
        "  - override /reconstruction: [weighted, weighted_floating]\n"
        "  - override /search: none\n"
        "  - override /load: none\n"
        "  - override /magnet: constant\n"
    )
    return head + body


def write_experiment(path: Path, text: str) -> None:
    """Write an experiment, whole or not at all.

    Raises
    ------
    InputError : the file cannot be written
    """
    replace_atomically(path, lambda temporary: temporary.write_text(text))
