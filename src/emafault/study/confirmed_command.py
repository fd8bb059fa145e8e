"""The commands that a search found, simulated anew to confirm their bound, beside the paper's command; their page."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.sensors import SensorNoise, measure
from ..dataset import BLOCK
from ..identification.intervals import coverage
from ..identification.posterior import posterior
from ..plain import read_json
from ..progress import progress
from ..reconstruction import Features, reconstruct
from ..reconstruction.features import join_features
from ..reporting import commands as figures_of
from ..reporting.page import Page
from .networks import write_json
from .optimal_command import LIMITS, MAE, Design, Judge, Judged, best, by_group, design_of, paper_design

HALF_WIDTH = 1.6449  # standard deviations, of 90 % intervals
SEED = 50  # added to the seed of the experiment's fresh runs, which are others
ROLES = {"paper": "the paper's command", "free": "best without a load", "loaded": "best with a load"}
UNITS = {"speed": "rad/s", "travel": "rad", "supply": "of the bus voltage", "heating": "K"}


def confirm_commands(spec: Mapping[str, Any], found: Sequence[str], output: str | Path) -> None:
    """Simulate fresh runs under the paper's command and the best of each length, and identify their faults.

    A design that breaks a limit in any fresh run is passed over for the next best.

    Parameters
    ----------
    spec : the sub-tree ``config.design_spec``
    found : what ``search_command`` wrote, a file a length
    output : JSON file: a list with ``role``, ``design``, ``bound`` and ``demand`` of the fresh runs, the limits that it
        ``breaches``, and where it breaches none their ``errors`` (mean absolute) and ``coverage``

    Raises
    ------
    InputError : a file that cannot be read, or no design that keeps the limits
    """
    judge, entries = Judge(spec, spec["design"]["fresh"], SEED), []
    for path in progress(found, "confirm", len(found)):
        trials = read_json(path, "length", "free", "loaded")
        entries.append({"role": "paper", **fresh_errors(judge, paper_design(spec, trials["length"]))})
        entries += [{"role": role, **_first_that_holds(judge, trials[role])} for role in ("free", "loaded")]
    write_json(output, entries)


def _first_that_holds(judge: Judge, trials: list[dict[str, Any]]) -> dict[str, Any]:
    """``fresh_errors`` of the best design that keeps the limits in all fresh runs."""
    left = trials
    while True:
        entry = fresh_errors(judge, best(left))
        if not entry["breaches"]:
            return entry
        left = left[1:]


def fresh_errors(judge: Judge, design: Design) -> dict[str, Any]:
    """Bound, demand and, where no limit is broken, errors of the closed form of nine features on the judge's runs."""
    parts: list[Features] = []
    least, demands, kept = [], [], judge.settings["limits"]
    for start in range(0, len(judge.records), BLOCK):
        rows = slice(start, start + BLOCK)
        clean = judge.simulate(design, rows)
        demands.append(judge.asked(clean, rows))
        least.append(judge.least(clean, rows))
        noisy = measure(clean, judge.records[rows], SensorNoise(**judge.sensors), judge.seed, start)
        parts.append(reconstruct("nine", noisy, judge.interval, judge.actuator, {"heating": True}))
    judged = Judged(
        by_group(MAE * np.concatenate(least)), {name: max(asked[name] for asked in demands) for name in LIMITS}
    )
    entry = {"design": vars(design), **vars(judged), "breaches": judged.breaches(kept)}
    return entry if entry["breaches"] else entry | _errors(join_features(parts), judge)


def _errors(features: Features, judge: Judge) -> dict[str, Any]:
    """Mean absolute errors and coverage of the closed form."""
    told = np.flatnonzero(features.identified)
    own, noise = features.nine[told], features.inputs_covariance[told]
    whole = noise + judge.known.covariance() * own[:, :, None] * own[:, None, :]
    found, truth = posterior(own, whole, judge.actuator, judge.alpha_m, judge.known), judge.faults[told]
    half = HALF_WIDTH * np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    return {
        "runs": len(told),
        "errors": by_group(np.abs(found.faults - truth)),
        "coverage": coverage(found.faults - half, found.faults + half, truth)["mean"],
    }


def draw_commands(
    spec: Mapping[str, Any], found: Sequence[str], confirmed: str, output: str | Path, figures: str | Path
) -> None:
    """Write the page of the search: bound over length, errors of fresh runs, the best of each kind, its signals.

    Raises
    ------
    InputError : a file that cannot be read or written
    """
    entries, settings = read_json(confirmed), spec["design"]
    page = Page("optimal_command", figures)
    page.paragraph("Which command, length and load identify best within limits, by nine features?", "lead")
    page.paragraph(_said(entries))
    page.heading("Bound and errors by length of recording")
    page.figure("lengths", figures_of.lengths(entries, ROLES), _CAPTION, _lengths_in_words(entries))
    header = ["length (s)", "", "design", "N", "over bound", "ξ", "over bound", "ΔT (K)", "over bound", "coverage"]
    page.table(header, [_row(entry) for entry in entries])
    text = (
        "Closed form of nine features, with the rate at which the winding warms an unknown, on "
        f"{settings['fresh']} fresh runs each: mean absolute errors, over the bound of these recordings, and coverage "
        "of 90 % intervals. What breaks a limit is not identified."
    )
    page.paragraph(text, "small")
    page.heading("What is asked of the actuator")
    header = ["length (s)", "", *(f"{name} ({UNITS[name]})" for name in LIMITS)]
    rows = [["", "limit", *(f"{settings['limits'][name]:g}" for name in LIMITS)]]
    for entry in entries:
        asked = [f"{entry['demand'][name]:.3g}" for name in LIMITS]
        rows.append([f"{entry['design']['length']:g}", ROLES[entry["role"]], *asked])
    page.table(header, rows, strong=[0])
    text = (
        "Largest over the fresh runs: the motor's speed; the output's travel; mean voltage between two phases over "
        "2 ms; heating of the winding by its losses, which the recordings have, "
        f"with a heat capacity of {settings['limits']['heat_capacity']:g} J/K."
    )
    page.paragraph(text, "small")
    _by_kind(page, found)
    judge = Judge(spec)
    length = spec["dataset"]["recording"]["duration"]
    drawn = [e for e in entries if e["design"]["length"] == length] or entries[-3:]
    signals = {ROLES[e["role"]]: judge.simulate(design_of(e["design"])) for e in drawn}
    page.heading("Signals")
    text = "Position, speed and current of phase a under these commands, of the first fault vector, without noise."
    page.figure("signals", figures_of.signals(signals, judge.interval), text, _signals_in_words(signals))
    page.write(output)


def _lengths_in_words(entries: Sequence[Mapping[str, Any]]) -> str:
    """What the picture of errors over lengths shows, for who cannot see it."""
    said = []
    for e in (e for e in entries if not e["breaches"]):
        own = [f"{w} {e['errors'][n]:.2g} (bound {e['bound'][n]:.2g})" for n, w in figures_of.OUTPUTS.items()]
        said.append(f"{ROLES[e['role']]}, {e['design']['length']:g} s: {', '.join(own)}")
    return f"Mean absolute errors. {'; '.join(said) or 'Every command breaks a limit'}."


def _signals_in_words(signals: Mapping[str, Mapping[str, np.ndarray]]) -> str:
    """What the picture of signals shows, for who cannot see it."""
    said = [
        f"{role}: travel {np.ptp(s['output_position'][0]):.2g} rad, speed up to "
        f"{np.abs(s['rotor_speed'][0]).max():.3g} rad/s, current of phase a up to "
        f"{np.abs(s['phase_current'][0, :, 0]).max():.2g} A"
        for role, s in signals.items()
    ]
    return f"{'; '.join(said)}."


_CAPTION = (
    "Mean absolute error at the bound of the recordings over their length, and dots for the errors, on fresh runs; "
    "none where a command breaks a limit."
)


def in_words(design: Mapping[str, Any]) -> str:
    """A design as one line."""
    words = {"acceleration": "rad/s²", "speed": "rad/s", "amplitude": "rad", "time": "s"}
    own = ", ".join(
        f"{key.replace('_', ' ')} {value:.3g} {words.get(key, 'Hz')}"
        for key, value in design["command"].items()
        if key != "name"
    )
    load = f"; {design['constant']:.3g} N m and {design['spring']:.3g} N m/rad" if _is_loaded(design) else ""
    return f"{design['command']['name']} ({own}){load}"


def _is_loaded(design: Mapping[str, Any]) -> bool:
    return bool(design["constant"] or design["spring"])


def _row(entry: Mapping[str, Any]) -> list[str]:
    row = [f"{entry['design']['length']:g}", ROLES[entry["role"]], in_words(entry["design"])]
    if "errors" not in entry:
        return [*row[:-1], f"{row[-1]}; breaks the limit of {', '.join(entry['breaches'])}", *[""] * 7]
    for name, digits in {"N": 5, "xi": 5, "dT": 3}.items():
        error = entry["errors"][name]
        row += [f"{error:.{digits}f}", f"{error / entry['bound'][name]:.2f}"]
    return [*row, f"{entry['coverage']:.3f}"]


def _said(entries: Sequence[Mapping[str, Any]]) -> str:
    """The finding in words: the best of the paper's length."""
    paper = next((e for e in entries if e["role"] == "paper" and "errors" in e), None)
    if paper is None:
        return "The paper's command breaks a limit at every length that was searched."
    length = max(e["design"]["length"] for e in entries if e["role"] == "paper" and "errors" in e)
    paper, free, loaded = (
        next(e for e in entries if e["role"] == role and e["design"]["length"] == length) for role in ROLES
    )
    text = f"At {length:g} s the best command without a load is {in_words(free['design'])}: "
    gain = [paper["errors"][name] / free["errors"][name] for name in ("N", "xi", "dT")]
    text += (
        f"on fresh runs N is {gain[0]:.1f}, ξ {gain[1]:.1f} and ΔT {gain[2]:.1f} times as exact as under the paper's. "
    )
    gain = [free["errors"][name] / loaded["errors"][name] for name in ("N", "xi", "dT")]
    return text + f"A load makes that {gain[0]:.2f}, {gain[1]:.2f} and {gain[2]:.2f} times as exact again."


def _by_kind(page: Page, found: Sequence[str]) -> None:
    page.heading("The best of each kind of command")
    rows = []
    for path in found:
        trials = read_json(path)
        for role in ("free", "loaded"):
            kinds: dict[str, Mapping[str, Any]] = {}
            for trial in trials[role]:
                kinds.setdefault(trial["command"]["name"], trial)
            for trial in kinds.values():
                worth = f"{trial['score']:.3f}" if np.isfinite(trial["score"]) else "–"
                broken = ", ".join(trial["breaches"]) or "–"
                rows.append([f"{trials['length']:g}", ROLES[role], in_words(trial), worth, broken])
    page.table(["length (s)", "", "design", "bound over the paper's", "breaks"], rows)
    text = (
        "Geometric mean over N, ξ and ΔT of the bound, over that of the paper's command of its own length. Where every "
        "trial of a kind breaks a limit, the one that would be best is shown."
    )
    page.paragraph(text, "small")
