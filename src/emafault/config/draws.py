"""Draws of blind cases: what each of their jobs reads."""

from collections.abc import Iterable, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

from ..effects import EFFECTS
from ..errors import InputError
from ..paths import CONF
from ..places import file_at, file_name
from ..plain import read_yaml
from .composition import compose, recursively_sorted, split_overrides
from .stages import pick


def withheld_draws() -> list[str]:
    """Names of the draws of blind cases in conf/withheld."""
    return sorted(path.stem for path in (CONF / "withheld").glob("*.yaml"))


def _withheld_draw(draw: str) -> dict[str, Any]:
    """A draw of conf/withheld."""
    return read_yaml(CONF / "withheld" / f"{draw}.yaml")


def check_draws() -> None:
    """Refuse draws of blind cases that share a case.

    Raises
    ------
    InputError : naming two draws, the rung and the seeds that they share
    """
    draws = {draw: _withheld_draw(draw) for draw in withheld_draws()}
    for (one, first), (other, second) in combinations(draws.items(), 2):
        for rung in first["cases"].keys() & second["cases"].keys() - {"T3"}:
            low = max(_of_rung(read["first_seed"], rung) for read in (first, second))
            high = min(_of_rung(read["first_seed"], rung) + read["cases"][rung] for read in (first, second))
            if low < high:
                raise InputError(f"withheld: the draws {one} and {other} share seeds {low} to {high - 1} of {rung}")


def _of_rung(value: Any, rung: str) -> int:
    """A number of a draw that is one for all its rungs or one for each."""
    return value[rung] if isinstance(value, dict) else value


def withheld_shows_measured(draw: str) -> bool:
    """Whether a draw's scoreboard shows the measured recordings too."""
    return bool(_withheld_draw(draw).get("measured", True))


def withheld_jobs(draw: str) -> list[tuple[str, int]]:
    """(rung, batch) of every job of a draw; T3 is made by the jobs of T1, whose benches it diagnoses."""
    read = _withheld_draw(draw)
    cases = {rung: count for rung, count in read["cases"].items() if rung != "T3"}
    return [(rung, n) for rung, count in cases.items() for n in range(-(-count // _of_rung(read["batch"], rung)))]


def withheld_spec(draw: str, rung: str, batch: int, config: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What one job of blind cases reads: its seeds, the actuator with its tolerances and the sensors.

    ``again`` are those of T1 that T3 diagnoses too: whole rounds of the effects, spread over the draw. ``told`` are
    diagnosed a second time by a library of the truth alone, ``rivals`` have the distance to the nearest one computed.
    ``config`` composed is that of the actuator; None takes the reference actuator.
    """
    read = _withheld_draw(draw)
    origin, size = _of_rung(read["first_seed"], rung), _of_rung(read["batch"], rung)
    first = origin + batch * size
    last = min(first + size, origin + read["cases"][rung])
    config = config or compose()
    seeds: dict[str, Any] = {"rung": rung, "first": first, "last": last, "again": []}
    if rung == "T1":
        effects, left_out = len(EFFECTS), read["cases"].get("T3", 0)
        apart = max(1, read["cases"]["T1"] // max(left_out, 1))  # rounds from one that T3 takes to the next
        taken = [origin + effects * apart * (n // effects) + n % effects for n in range(left_out)]
        seeds["again"] = [seed for seed in taken if first <= seed < last]
    for name in ("told", "rivals"):
        every = read.get(name, {}).get(rung, 0)
        seeds[name] = [seed for seed in range(first, last) if every and (seed - origin) % every == 0]
    return recursively_sorted(pick(config, "actuator", "sensors", "tolerances") | {"seeds": seeds})


def calibration_spec(config: Mapping[str, Any], overrides: str | Iterable[str] | None = None) -> dict[str, Any]:
    """What the check of the probabilities on an actuator reads: the actuator, its name and the cases of the draw."""
    read = _withheld_draw("own")
    spec = pick(config, "actuator", "sensors", "tolerances") | pick(read, "cases", "first_seed")
    return recursively_sorted(spec | {"name": actuator_name(overrides)[1]})


def actuator_name(overrides: str | Iterable[str] | None = None) -> tuple[str, str]:
    """Name of a folder and in words of the actuator of a configuration: those of its file, or the reference actuator's.

    Raises
    ------
    InputError : a file of an actuator that cannot be used
    """
    from ..datasheet.compose import of_file

    for text in split_overrides(overrides):
        key, _, value = text.partition("=")
        if key == "actuator" and value.endswith((".yaml", ".yml")):
            return file_name(Path(value).stem), of_file(file_at(value, "actuator")).name
    return "reference", "reference actuator, 48 V"
