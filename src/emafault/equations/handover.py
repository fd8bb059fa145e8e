"""Handing over the fix: effects, what was described and the unit's own values as an experiment that can be run."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import one_line
from ..plain import escaped
from ..reporting.written import FROM_DIAGNOSIS
from .carried import entries, left_out
from .telling import differing_settings


def experiment_text(
    verdict: Mapping[str, Any],
    effects: Mapping[str, Mapping[str, float]],
    name: str,
    actuator: Mapping[str, float] | None = None,
) -> str:
    """A Hydra experiment in YAML.

    Parameters
    ----------
    effects : effect -> parameter -> value, as fitted; the unit's tolerances are values of the calibration effects
    name : of the experiment and its folder of results
    actuator : parameters that are not those of the reference actuator
    """
    from omegaconf import OmegaConf

    rounded = {e: {p: float(f"{v:.8g}") for p, v in values.items()} for e, values in effects.items()}
    named = sorted({e for e in verdict["which"][0]["effects"] if e != "unknown"})
    unlisted, settings = entries(verdict), differing_settings(verdict)
    words = [*named, *(["what no catalogue lists"] if unlisted else []), "its unit's tolerances"]
    what = _in_words(words) if len(words) > 1 else f"{words[0]} alone"
    bench = one_line(verdict["bench"])  # a name's line break would end the comment, its ${} be looked up
    content: dict[str, Any] = {
        "name": name,
        "question": escaped(f"How well is the actuator of bench {bench} identified with {what} simulated?"),
        "effects": rounded,
    }
    own = dict(actuator or {}) | {name: float(f"{g['value']:.8g}") for name, g in settings.items()}
    if own:
        content["actuator"] = own
    if unlisted:
        content["unlisted"] = unlisted
    body = OmegaConf.to_yaml(OmegaConf.create(content))
    missing = "".join(f"# not simulated: {sentence}\n" for sentence in left_out(verdict))
    head = (
        f"{FROM_DIAGNOSIS}{bench}: verdict {verdict['verdict']}, digest {verdict['digest']}\n"
        "defaults:\n"
        "  - override /reconstruction: [weighted, weighted_floating]\n"
        "  - override /search: none\n"
        "  - override /load: none\n"
        "  - override /magnet: constant\n"
    )
    return head + missing + body


def _in_words(effects: Sequence[str]) -> str:
    """Effects in words: ``friction asymmetry and load constant``."""
    names = [e.replace("_", " ") for e in effects]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
