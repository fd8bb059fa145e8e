"""The command, length and load that identify best: optimal design by the bound of the recordings, within limits.

A design is a command with its parameters, a length of recording and a load. It is judged by the Cramer-Rao bound of
the nine features of its own noise-free recordings (Fisher information; Goodwin and Payne, Dynamic System
Identification, 1977, chapter 6), averaged over a few fault vectors: the geometric mean over N, xi and dT of the bound
over that of the paper's command. The losses warm the winding as it is recorded, at a rate that counts as unknown; dT
is that at the start. What would break a limit of speed, travel, supply or heating for any of the fault
vectors is refused by the search, which is Optuna's TPE with constraints.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.commands import command_positions
from ..actuator.parameters import ActuatorParameters, set_effects
from ..actuator.simulate import simulate
from ..closed_form import forward
from ..dataset import sample_runs
from ..errors import InputError
from ..identification.evaluation import GROUPS
from ..identification.posterior import Knowledge
from ..progress import progress
from ..reconstruction.bounds import nine_bound
from .calibrated_bound import least_of
from .networks import write_json

WINDOW = 2e-3  # s, over which what is asked of the supply is averaged
UNDETERMINED = 10.0  # log score of a recording that leaves an unknown undetermined
MAE = np.sqrt(2.0 / np.pi)  # mean absolute error over standard deviation
LIMITS = ("speed", "travel", "supply", "heating")


@dataclass(frozen=True)
class Design:
    """How a recording is made."""

    command: Mapping[str, Any]  # name and settings, as in conf/command
    length: float  # s
    constant: float = 0.0  # N m, load at the output shaft
    spring: float = 0.0  # N m/rad, likewise

    def positions(self, control_period: float) -> np.ndarray:
        """(tick+1,) commanded user-shaft angle (rad)."""
        settings = dict(self.command)
        return command_positions(settings.pop("name"), settings, self.length, control_period)

    def effects(self) -> dict[str, dict[str, float]]:
        """The load as effects of the catalogue."""
        return {"load_constant": {"T": self.constant}, "load_spring": {"c": self.spring}}


@dataclass(frozen=True)
class Judged:
    """What a design is worth and what it asks for; the largest demand over the fault vectors."""

    bound: dict[str, float]  # N (1), xi (1), dT (K): mean absolute error at the bound, NaN where undetermined
    demand: dict[str, float]  # speed (rad/s), travel (rad), supply (of the bus voltage), heating (K)

    def breaches(self, limits: Mapping[str, float]) -> list[str]:
        """Limits that are broken."""
        return [name for name in LIMITS if not self.demand[name] <= limits[name]]

    def score(self, paper: "Judged") -> float:
        """Geometric mean over N, xi and dT of the bound over that of another design."""
        return float(np.exp(np.mean([np.log(self.bound[name] / paper.bound[name]) for name in GROUPS])))


def demand(
    signals: Mapping[str, np.ndarray],
    faults: np.ndarray,
    actuator: ActuatorParameters,
    capacity: float,
    interval: float,
) -> dict[str, np.ndarray]:
    """What recordings ask for, (run,) each: largest speed (rad/s) and travel (rad), of the supply and of the winding.

    Of the supply: the largest mean voltage between two phases over 2 ms, as a share of the bus voltage. Of the winding:
    its heating (K) by its own losses, none being given off, at the resistance that it starts with.

    Parameters
    ----------
    faults : (run, 6)
    capacity : heat capacity of the winding (J/K)
    """
    voltage, width = signals["phase_voltage"], max(round(WINDOW / interval), 1)
    between = np.abs(voltage - np.roll(voltage, 1, axis=2)) / signals["bus_voltage"][..., None]
    total = np.cumsum(np.pad(between, ((0, 0), (1, 0), (0, 0))), axis=1)
    losses = np.sum(forward(faults, actuator)[0][:, None] * signals["phase_current"] ** 2, axis=(1, 2))
    return {
        "speed": np.max(np.abs(signals["rotor_speed"]), axis=1),
        "travel": np.max(np.abs(signals["output_position"]), axis=1),
        "supply": np.max(total[:, width:] - total[:, :-width], axis=(1, 2)) / width,
        "heating": losses * interval / capacity,
    }


class Judge:
    """Judges designs by the same few fault vectors.

    Parameters
    ----------
    spec : the sub-tree ``config.design_spec``
    faults : how many fault vectors there are; None takes those of the search
    seed : added to that of the experiment's fresh runs, which are others
    """

    def __init__(self, spec: Mapping[str, Any], faults: int | None = None, seed: int | None = None) -> None:
        self.settings, part = spec["design"], spec["dataset"]
        more = 10 * self.settings["seed"] if seed is None else seed
        self.seed = part["seed"] + more
        drawn = {"runs": faults or self.settings["faults"], "seed": self.seed, "unit_seed": part["unit_seed"] + more}
        sample = sample_runs({**part, **drawn})
        self.records, self.faults, self.dT_magnet = sample.records(slice(None)), sample.faults, sample.dT_magnet
        self.actuator, self.known = ActuatorParameters(**part["actuator"]), Knowledge(**spec["known"])
        self.sensors, self.interval = part["sensors"], part["recording"]["interval"]
        self.alpha_m = spec["magnet_coefficient"]

    def simulate(self, design: Design, rows: slice = slice(None)) -> dict[str, np.ndarray]:
        """Noise-free signals of the fault vectors under a design, whose losses warm the winding."""
        runs = self.records[rows].copy()
        warming = {"heating_rate": 1.0 / self.settings["limits"]["heat_capacity"]}
        set_effects(runs, {**design.effects(), "self_heating": warming})
        positions = design.positions(self.actuator.control_period)
        return simulate(runs, positions, design.length, self.interval)

    def least(self, clean: Mapping[str, np.ndarray], rows: slice = slice(None)) -> np.ndarray:
        """(run, 6) standard errors at the bound of noise-free recordings, NaN where an unknown is undetermined."""
        nine = nine_bound(clean, self.interval, self.actuator, self.sensors, {"heating": True})
        errors, told = np.full((len(nine), 6), np.nan), np.all(np.isfinite(nine), axis=(1, 2))
        faults, magnets = self.faults[rows][told], self.dT_magnet[rows][told]
        of_run = faults, self.actuator, self.alpha_m, self.known, magnets
        errors[told] = least_of(nine[told], self.known.covariance(), *of_run)
        return errors

    def asked(self, clean: Mapping[str, np.ndarray], rows: slice = slice(None)) -> dict[str, float]:
        """The largest ``demand`` of recordings."""
        capacity = self.settings["limits"]["heat_capacity"]
        each = demand(clean, self.faults[rows], self.actuator, capacity, self.interval)
        return {name: float(np.max(values)) for name, values in each.items()}

    def __call__(self, design: Design) -> Judged:
        """What a design is worth and asks for."""
        clean = self.simulate(design)
        return Judged(by_group(MAE * self.least(clean)), self.asked(clean))


def by_group(errors: np.ndarray) -> dict[str, float]:
    """Means of (run, 6) errors over N, xi and dT."""
    return {name: float(np.mean(errors[:, list(columns)])) for name, columns in GROUPS.items()}


def paper_design(spec: Mapping[str, Any], length: float) -> Design:
    """The experiment's own command, which is the paper's, without a load."""
    return Design({key: value for key, value in spec["dataset"]["command"].items() if key != "digest"}, length)


def search_command(spec: Mapping[str, Any], length: float, output: str | Path) -> None:
    """Search the best design of one length, without a load and with one; write every trial.

    Parameters
    ----------
    spec : the sub-tree ``config.design_spec``
    length : of the recording (s)
    output : JSON file: ``free`` and ``loaded``, each a list of trials (``design``, ``bound``, ``demand``, ``breaches``,
        ``score``) from the best on, those that break a limit behind

    Raises
    ------
    InputError : no design among the trials keeps the limits
    """
    judge = Judge(spec)
    free = search(judge, paper_design(spec, length), spec)
    loaded = search(judge, best(free), spec, load=True)
    best(loaded)
    write_json(output, {"length": length, "free": free, "loaded": loaded})


def search(judge: Judge, first: Design, spec: Mapping[str, Any], load: bool = False) -> list[dict[str, Any]]:
    """Trials of a search, the best first and those that break a limit last; ``first`` is tried first.

    Half of the trials are over all kinds of command, the rest about the best of the two best kinds.
    """
    settings = judge.settings
    scale = judge(paper_design(spec, spec["dataset"]["recording"]["duration"]))
    ends = settings["load"] if load else {}
    narrow = settings["trials"] // 4
    trials = _search(judge, scale, settings["space"], ends, first, settings["trials"] - 2 * narrow)
    for trial in _best_of_kinds(trials)[:2]:
        about = design_of(trial)
        name = about.command["name"]
        space = {name: _about(settings["space"][name], about.command, 0.5)}
        loads = {key: _near(ends[key], getattr(about, key), 0.25) for key in ends}
        trials += _search(judge, scale, space, loads, about, narrow)
    return sorted(trials, key=lambda t: (bool(t["breaches"]), t["score"] if np.isfinite(t["score"]) else np.inf))


def _best_of_kinds(trials: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The best trial of each kind of command that has one within limits, the best first."""
    kinds: dict[str, dict[str, Any]] = {}
    for trial in sorted((t for t in trials if not t["breaches"]), key=lambda t: t["score"]):
        kinds.setdefault(trial["command"]["name"], trial)
    return list(kinds.values())


def _about(space: Mapping[str, Any], settings: Mapping[str, Any], share: float) -> dict[str, dict[str, float]]:
    """Ends of a command's parameters from a share of a value to its inverse."""
    return {
        key: {"low": max(ends["low"], share * settings[key]), "high": min(ends["high"], settings[key] / share)}
        for key, ends in space.items()
    }


def _near(ends: Mapping[str, float], value: float, share: float) -> dict[str, float]:
    """Ends within a share of their range about a value."""
    reach = share * (ends["high"] - ends["low"])
    return {"low": max(ends["low"], value - reach), "high": min(ends["high"], value + reach)}


def _search(
    judge: Judge, scale: Judged, space: Mapping[str, Any], loads: Mapping[str, Any], first: Design, count: int
) -> list[dict[str, Any]]:
    """So many trials within ends; ``first`` is tried first where it lies within them."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    limits = judge.settings["limits"]
    trials: list[dict[str, Any]] = []

    def objective(trial) -> float:
        design = _suggest(trial, space, first.length, loads)
        judged = judge(design)
        score = judged.score(scale)
        known = np.isfinite(score)
        breaches = judged.breaches(limits) + ([] if known else ["undetermined"])
        for limit in LIMITS:
            trial.set_constraint(limit, judged.demand[limit] / limits[limit] - 1.0)
        trial.set_constraint("undetermined", 0.0 if known else 1.0)
        trials.append(vars(design) | {**vars(judged), "breaches": breaches, "score": score})
        return float(np.log(score)) if known else UNDETERMINED

    sampler = optuna.samplers.TPESampler(seed=judge.settings["seed"])
    study = optuna.create_study(sampler=sampler)
    name = first.command["name"]
    if name in space:
        given = {f"{name}.{key}": float(value) for key, value in first.command.items() if key != "name"}
        study.enqueue_trial({"command": name, **given, **{key: getattr(first, key) for key in loads}})
    for _ in progress(range(count), f"search {first.length:g} s", count):
        study.optimize(objective, n_trials=1)
    return trials


def _suggest(trial, space: Mapping[str, Any], length: float, loads: Mapping[str, Any]) -> Design:
    name = trial.suggest_categorical("command", sorted(space))
    own = {key: trial.suggest_float(f"{name}.{key}", e["low"], e["high"], log=True) for key, e in space[name].items()}
    on = {key: trial.suggest_float(key, e["low"], e["high"]) for key, e in loads.items()}
    return Design({"name": name, **own}, length, **on)


def best(trials: list[dict[str, Any]]) -> Design:
    """The best design among trials.

    Raises
    ------
    InputError : none keeps the limits
    """
    if not trials or trials[0]["breaches"]:
        broken = ", ".join(sorted({name for trial in trials for name in trial["breaches"]}))
        raise InputError(
            f"optimal_command.limits: no design that was tried keeps them ({broken or 'all were passed over'}); "
            "accepted are wider limits, smaller ends of the space or more trials"
        )
    return design_of(trials[0])


def design_of(trial: Mapping[str, Any]) -> Design:
    """The design of a trial that was written."""
    return Design(trial["command"], trial["length"], trial["constant"], trial["spring"])
