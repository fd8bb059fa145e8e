"""The metrics of the withheld check: which cases each is taken over, how, and what a good result and the aim are."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata

from .verdicts import IN_GROUP

BINS = 10
Rows = Sequence[dict]


@dataclass(frozen=True)
class Metric:
    """One line of the table: which cases it is taken over, how, and what a good result and the aim are.

    ``sense`` is +1 where more is better, -1 where less is, 0 where good and aim are (low, high) ranges.
    """

    id: str
    title: str
    select: Callable[[dict], bool]
    statistic: Callable[[Rows], float | None]
    good: float | tuple[float, float] | None = None
    aim: float | tuple[float, float] | None = None
    sense: int = 1


def share(field: str) -> Callable[[Rows], float | None]:
    """Share of rows in which a field is true; what is compared with a plain twin, only those with one have."""

    def of(rows: Rows) -> float | None:
        values = [bool(r[field]) for r in rows if field in r]
        return float(np.mean(values)) if values else None

    return of


def calibration_error(rows: Rows) -> float | None:
    """Expected calibration error of the first hypothesis' probability, ten equal bins."""
    table = reliability(rows)
    total = sum(b["count"] for b in table)
    return sum(b["count"] * abs(b["confidence"] - b["accuracy"]) for b in table) / total if total else None


def reliability(rows: Rows) -> list[dict]:
    """Mean confidence and share right of each bin of confidence that holds a case."""
    if not rows:
        return []
    confidence = np.array([r["confidence"] for r in rows])
    right = np.array([float(r["confident_right"]) for r in rows])
    cell = np.minimum((confidence * BINS).astype(int), BINS - 1)
    return [
        {"confidence": float(confidence[cell == b].mean()), "accuracy": float(right[cell == b].mean()), "count": int(n)}
        for b in range(BINS)
        if (n := np.sum(cell == b))
    ]


def area_under_curve(rows: Rows) -> float | None:
    """Probability that a left-out effect is given more ``unknown`` than a known one."""
    out = np.array([bool(r["left_out"]) for r in rows])
    if not rows or out.all() or not out.any():
        return None
    rank = rankdata([r["unknown"] for r in rows])
    positives = int(out.sum())
    return float((rank[out].sum() - positives * (positives + 1) / 2.0) / (positives * (len(rows) - positives)))


def coverage(rows: Rows) -> float | None:
    """Share of parameters whose interval holds the truth."""
    every = [hit for r in rows for hit in r["covered"]]
    return float(np.mean(every)) if every else None


def closure(kind: str, stage: str = "after") -> Callable[[Rows], float | None]:
    """Share of the closable gap that a stage of the ladder closes, ratio of sums over cases."""

    def of(rows: Rows) -> float | None:
        ladders = [r[kind] for r in rows if r[kind] and None not in r[kind].values()]
        below = sum(x["recalibrated"] - x["floor"] for x in ladders)
        return sum(x["recalibrated"] - x[stage] for x in ladders) / below if below > 0.0 else None

    return of


def _errors(rows: Rows, against: str) -> list[dict]:
    """Fault-vector errors of the cases that have an oracle's, or a bound's, to be held against."""
    return [r["fault_vector"] for r in rows if r["fault_vector"] and r["fault_vector"][against] is not None]


def fault_closure(against: str = "oracle") -> Callable[[Rows], float | None]:
    """Share of the closable fault-vector error that the diagnosis closes, ratio of sums."""

    def of(rows: Rows) -> float | None:
        errors = _errors(rows, against)
        below = sum(e["before"] - e[against] for e in errors)
        return sum(e["before"] - e["after"] for e in errors) / below if below > 0.0 else None

    return of


def fault_ratio(against: str = "oracle") -> Callable[[Rows], float | None]:
    """Root mean square fault-vector error once diagnosed, over the oracle's or the bound."""

    def of(rows: Rows) -> float | None:
        errors = _errors(rows, against)
        below = sum(e[against] for e in errors)
        return float(np.sqrt(sum(e["after"] for e in errors) / below)) if below > 0.0 else None

    return of


def loss(rows: Rows) -> float | None:
    """Share named on the same benches without what is unlisted, less the share named with it."""
    pairs = [r for r in rows if "named_without" in r]
    return float(np.mean([float(r["named_without"]) - float(r["all_named"]) for r in pairs])) if pairs else None


def inclusion_change(quantile: float | None = None) -> Callable[[Rows], float | None]:
    """Largest change of a plant effect's inclusion against the nominal controller: mean or quantile over cases."""

    def of(rows: Rows) -> float | None:
        moved = [r["inclusion_change"] for r in rows if r.get("inclusion_change") is not None]
        if not moved:
            return None
        return float(np.mean(moved) if quantile is None else np.quantile(moved, quantile))

    return of


def _of_unlisted(field: str) -> Callable[[Rows], float | None]:
    """Share of the things unlisted of which a field is true; those of which it is None are left out."""

    def of(rows: Rows) -> float | None:
        values = [u[field] for r in rows for u in r["unlisted"] if u[field] is not None]
        return float(np.mean(values)) if values else None

    return of


def false_share(rows: Rows) -> float | None:
    """Share of all descriptions that describe nothing that is there."""
    total = sum(r["claims"] for r in rows)
    return sum(r["false_claims"] for r in rows) / total if total else None


def group_size(rows: Rows) -> float | None:
    """Mean number of effects in the groups given."""
    sizes = [len(r["named"]) for r in rows if r["answer"] == "group"]
    return float(np.mean(sizes)) if sizes else None


def _rung(*rungs: str, detectable: bool | None = True, **fields) -> Callable[[dict], bool]:
    def select(row: dict) -> bool:
        if row["rung"] not in rungs or (detectable is not None and row["detectable"] != detectable):
            return False
        return all(row[name] == value for name, value in fields.items())

    return select


def _count(number: int) -> Callable[[dict], bool]:
    return lambda r: r["rung"] == "T2" and r["detectable"] and len(r["truth"]) == number


def _single(rung: str) -> Callable[[dict], bool]:
    return _rung(rung, detectable=None)


def _known(row: dict) -> bool:
    return row["rung"] == "T0" or (row["rung"] in ("T1", "T2") and row["detectable"])


def _unknown_t3(row: dict) -> bool:
    return row["rung"] == "T3" and row["detectable"] and row["answer"] in ("unknown", "described")


def _apart(rows: Rows) -> float | None:
    """Share given a name that lies further from the truth than a group may reach."""
    if not rows:
        return None
    far = [r["wrong_name"] and min(r["rivals"].values(), default=np.inf) > IN_GROUP for r in rows]
    return float(np.mean(far))


def _mix(row: dict, effects: int | None = 1, unlisted: int = 1) -> bool:
    """Whether a row is a detectable one of T7 with so many effects and things unlisted; None: any other mix."""
    if row["rung"] != "T7" or not row["detectable"]:
        return False
    found = len(row["truth"]), len(row["unlisted"])
    return found != (1, 1) if effects is None else found == (effects, unlisted)


def _mix_seen(row: dict) -> bool:
    return _mix(row) and row["unlisted"][0]["detectable"]


def _alone(inside: bool) -> Callable[[dict], bool]:
    """Rows of T8 whose thing unlisted shows, inside the grammar or outside."""
    return lambda r: r["rung"] == "T8" and r["unlisted"][0]["detectable"] and r["unlisted"][0]["inside"] == inside


def _described(row: dict) -> bool:
    return row["rung"] in ("T0", "T1", "T7", "T8")


_right, _wrong = share("right"), share("wrong_name")
_both = _rung("T1", "T2")
_weak = _rung("T0", detectable=None, strong_faults=False)
_strong = _rung("T0", detectable=None, strong_faults=True)
METRICS = (
    Metric("right_t1", "right effect or group first, T1", _rung("T1"), _right, 0.95, 0.99),
    Metric("right_t4", "right effect or group first, T4", _rung("T4"), _right, 0.80, 0.95),
    Metric(
        "group_t2",
        "two effects named, or in a group that no data tell apart, T2",
        _count(2),
        share("in_group"),
        0.92,
        0.97,
    ),
    Metric("pairs_t2", "two effects named exactly, T2", _count(2), _right, 0.85, 0.93),
    Metric("named_t7", "listed effect named beside something unlisted, T7", _mix, share("all_named"), 0.90, 0.97),
    Metric("beside_t7", "another listed name beside it, T7", _mix, share("another"), 0.03, 0.01, -1),
    Metric("loss_t7", "loss against the same bench without it, T7", _mix, loss, 0.05, 0.02, -1),
    Metric(
        "several_t7",
        "two unlisted or two effects: all listed named, T7",
        lambda r: _mix(r, None),
        share("all_named"),
        0.80,
        0.92,
    ),
    Metric(
        "inclusion_t9",
        "largest change of a plant effect's inclusion, T9",
        _single("T9"),
        inclusion_change(),
        0.05,
        0.02,
        -1,
    ),
    Metric("same_t9", "verdict unchanged, T9", _single("T9"), share("same"), 0.97, 0.99),
    Metric(
        "form_t8",
        "inside the grammar: form, equation, coordinate, T8",
        _alone(True),
        _of_unlisted("form_right"),
        0.90,
        0.97,
    ),
    Metric(
        "parameters_t8",
        "inside: its parameters within 10 %, T8",
        _alone(True),
        _of_unlisted("parameters_right"),
        0.85,
        0.95,
    ),
    Metric(
        "equation_t8",
        "outside the grammar: equation right, T8",
        _alone(False),
        _of_unlisted("equation_right"),
        0.85,
        0.95,
    ),
    Metric("wrong_t8", "outside: a listed name given, T8", _alone(False), share("another"), 0.03, 0.01, -1),
    Metric("closed_t8_inside", "gap closed, signal, inside, T8", _alone(True), closure("signal"), 0.85, 0.97),
    Metric("closed_t8_outside", "gap closed, signal, outside, T8", _alone(False), closure("signal"), 0.50, 0.75),
    Metric(
        "claimed",
        "any form or equation claimed, T0 and T1",
        _rung("T0", "T1", detectable=None),
        share("claimed"),
        0.03,
        0.01,
        -1,
    ),
    Metric("false_share", "false share of what is described", _described, false_share, 0.05, 0.02, -1),
    Metric("wrong_t0", "a wrong name on effect-free data, T0", _single("T0"), _wrong, 0.05, 0.01, -1),
    Metric("no_gap_t0", "no_gap returned, T0", _single("T0"), _right, 0.90, 0.97),
    Metric("wrong_t3", "left-out effect given a wrong name, T3", _rung("T3"), _wrong, 0.08, 0.02, -1),
    Metric(
        "auroc_t3", "unknown against known, area under the ROC curve", _rung("T1", "T3"), area_under_curve, 0.93, 0.98
    ),
    Metric("equation_t3", "unknown placed in the right equation", _unknown_t3, share("equation_right"), 0.85, 0.97),
    Metric("ece", "expected calibration error, every case", lambda row: True, calibration_error, 0.03, 0.015, -1),
    Metric("coverage", "coverage of 90 % intervals, T1", _rung("T1"), coverage, (0.86, 0.94), (0.88, 0.92), 0),
    Metric("closed_signal", "gap closed, signal", _both, closure("signal"), 0.95, 0.99),
    Metric("closed_features", "gap closed, features", _both, closure("features"), 0.95, 0.99),
    Metric("closed_faults", "gap closed, fault vector", _both, fault_closure(), 0.90, 0.97),
    Metric("placebo", "the placebo's share of the signal's gap", _both, closure("signal", "placebo"), 0.25, 0.10, -1),
    Metric("fault_ratio", "fault-vector error once diagnosed, over the oracle's", _both, fault_ratio(), 1.3, 1.05, -1),
    # beside the table
    Metric("right_t1_all", "right first, T1, every amplitude", _single("T1"), _right),
    Metric("right_t4_all", "right first, T4, every amplitude", _single("T4"), _right),
    Metric("wrong_t1", "a wrong name, T1", _rung("T1"), _wrong, sense=-1),
    Metric("wrong_t1_all", "a wrong name, T1, every amplitude", _single("T1"), _wrong, sense=-1),
    Metric("wrong_t4_all", "a wrong name, T4, every amplitude", _single("T4"), _wrong, sense=-1),
    Metric("wrong_t0_weak", "a wrong name, T0 without strong faults", _weak, _wrong, sense=-1),
    Metric("wrong_t0_strong", "a wrong name, T0 with strong faults", _strong, _wrong, sense=-1),
    Metric("triples_t2", "three effects named exactly, T2", _count(3), _right),
    Metric("faults_t2", "one effect beside strong faults, T2", _count(1), _right),
    Metric("t2_all", "sets named exactly, T2, every amplitude", _single("T2"), _right),
    Metric("named_t7_seen", "listed effect named, T7, the thing unlisted shows", _mix_seen, share("all_named")),
    Metric(
        "beside_t7_seen", "another listed name, T7, the thing unlisted shows", _mix_seen, share("another"), sense=-1
    ),
    Metric("without_t7", "listed effect named without what is unlisted, T7", _mix, share("named_without")),
    Metric("another_without_t7", "another name without it, T7", _mix, share("another_without"), sense=-1),
    Metric("structural_t7", "another structural name beside, T7", _mix, share("another_structural"), sense=-1),
    Metric(
        "beside_all_t7", "another listed name, T7, every mix and amplitude", _single("T7"), share("another"), sense=-1
    ),
    Metric("inclusion_t9_95", "the same change, 95 % quantile, T9", _single("T9"), inclusion_change(0.95), sense=-1),
    Metric("wrong_t9", "a wrong name, T9", _single("T9"), share("another"), sense=-1),
    Metric("wrong_t8_inside", "inside the grammar: a listed name given, T8", _alone(True), share("another"), sense=-1),
    Metric("unknown_t3", "unknown or described returned, T3", _rung("T3"), _right),
    Metric("apart_t3", "a wrong name that the data tell apart, T3", _rung("T3"), _apart, sense=-1),
    Metric("wrong_t3_all", "a wrong name, T3, every amplitude", _single("T3"), _wrong, sense=-1),
    Metric("ece_known", "expected calibration error, T0, T1, T2", _known, calibration_error, sense=-1),
    Metric("closed_faults_bound", "gap closed, fault vector, against the bound", _both, fault_closure("bound")),
    Metric("fault_bound", "fault-vector error over the best possible", _both, fault_ratio("bound"), sense=-1),
    Metric("failed", "a diagnosis that ends in an error", lambda row: True, share("failed"), sense=-1),
    Metric("closed_signal_t4", "gap closed, signal, T4", _rung("T4"), closure("signal")),
    Metric("group_size", "mean size of a group, T1", _single("T1"), group_size, sense=-1),
)
