"""The linear model of a bench, truths drawn from its prior, and the data that follow from them."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis.evidence import Normal, Reduced
from ..diagnosis.fit import CARRYING, Bench
from ..diagnosis.model import LISTED, WORDS, Unit
from ..diagnosis.set_prior import ONE_MORE_FORM, OTHER_FORM_PRIOR, REMAINDER_PRIOR, SIZE_PRIOR
from ..diagnosis.sets import OTHER_FORM, Candidate
from ..equations.machine import ReferenceActuator
from ..equations.signals import Signals, estimated_noise
from ..io.bench import read_bench
from ..withheld.benches import write_bench
from ..withheld.cases import draw_case

SIZE = 0.3  # prior standard deviations, of which an own form's columns are first made
INFORMED = 0.7  # posterior over prior standard deviation, below which data tell of a nuisance


@dataclass
class LinearBench:
    """A bench's linear model at the nominal point.

    ``normal`` has the matrix H (column, column), ``root`` its square root L, L L' = H; ``mean`` and ``sd`` (nuisance,)
    are the nuisances' prior, ``fixed`` (column,) where each column is off; ``tolerance`` is the nuisance's column of a
    column that is beyond a tolerance.
    """

    normal: Normal
    root: np.ndarray
    nuisances: list[str]
    mean: np.ndarray
    sd: np.ndarray
    fixed: np.ndarray
    reduced: Reduced
    units: list[Unit]
    candidates: dict[tuple[str, int], Candidate]
    tolerance: dict[int, int]
    carrying: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.n = np.array([self.normal.index[x] for x in self.nuisances])
        self.rest = np.setdiff1d(np.arange(len(self.normal.names)), self.n)
        A = self.normal.H[np.ix_(self.n, self.n)] * np.outer(self.sd, self.sd) + np.eye(len(self.n))
        self.factor = cho_factor(A, lower=True)
        shrunk = np.sqrt(np.diag(cho_solve(self.factor, np.eye(len(A)))))
        self.informed = np.flatnonzero(shrunk < INFORMED)
        unit = [self.rest[c.index] for m, c in self.candidates.items() if not m[0].startswith("remainder:")]
        widths = [c.sd for m, c in self.candidates.items() if not m[0].startswith("remainder:")]
        columns, first = np.unique(np.concatenate(unit), return_index=True)
        #: columns that a distance is taken over, and the unit of each
        self.over = np.concatenate([self.n[self.informed], columns])
        self.scale = np.concatenate([(shrunk * self.sd)[self.informed], np.concatenate(widths)[first]])


@dataclass
class Drawn:
    """A draw from the prior: members with widths, deviations (column,) from the point."""

    members: dict[tuple[str, int], float]
    deviations: np.ndarray

    @property
    def units(self) -> set[str]:
        """What is on."""
        return {u for u, _ in self.members}


def linear_bench(
    seed: int, recordings: int, actuator: ActuatorParameters, noise: SensorNoise, own_forms: bool = False
) -> LinearBench:
    """The linear model of the first recordings of an effect-free blind case.

    ``own_forms``: some of the effects with one parameter, drawn by the seed, may take another form than the library's.
    """
    case = draw_case("T0", seed)
    case = replace(case, recordings=case.recordings[:recordings])
    with tempfile.TemporaryDirectory() as scratch:
        write_bench(case, Path(scratch) / "bench", actuator, noise)
        read = read_bench(Path(scratch) / "bench", actuator).recordings
    own = estimated_noise(list(read.values()), noise)
    machine = ReferenceActuator(actuator, {n: Signals.of(n, r, actuator, own) for n, r in read.items()})
    bench = Bench(machine, list(read))
    carrying: tuple[str, ...] = ()
    if own_forms:
        single = [u for u in bench.units if u.kind == "structural" and len(u.variants) == 1 == len(u.parameters)]
        picked = np.random.default_rng(seed).permutation(len(single))[:CARRYING]
        bench.sizes = {
            single[k].id: {p.name: SIZE * bench.prior(p.name)[1] for p in single[k].parameters} for k in picked
        }
        carrying = tuple(bench.sizes)
    bench.linearise(renew=True)
    # the columns as they are, noise in the regressors and all: the check is of the linear model alone
    normal = bench.normal(bench.linearise(corrected=False))
    power = np.diag(normal.H)
    scale = np.sqrt(np.where(power > 0.0, power, 1.0))
    values, vectors = np.linalg.eigh(normal.H / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    normal = Normal(normal.names, root @ root.T, np.zeros(len(power)), 0.0)
    reduced = bench.reduce(normal)
    units, candidates = bench.candidates(reduced)
    prior = np.array([bench.prior(n) for n in normal.names])
    n = np.array([normal.index[x] for x in bench.nuisances])
    tolerance = {
        normal.index[name]: normal.index[p.alias]
        for name, p in bench.parameters.items()
        if p.alias is not None and name in normal.index and p.alias in normal.index
    }
    return LinearBench(
        normal, root, bench.nuisances, prior[n, 0], prior[n, 1], prior[:, 2], reduced, units, candidates, tolerance,
        carrying,
    )  # fmt: skip


def draw_truth(bench: LinearBench, rng: np.random.Generator, width: float = 1.0) -> Drawn:
    """Draw from the prior of the model; ``width`` multiplies every prior's standard deviation."""
    kinds = {u.id: u.kind for u in bench.units}
    listed = [u for u, k in kinds.items() if k in LISTED]
    chosen = [
        *rng.choice(listed, rng.choice(len(SIZE_PRIOR), p=SIZE_PRIOR), replace=False),
        *_drawn_forms([u for u in bench.units if u.kind == "form" and not u.of_controller], rng),
        *(u.id for u in bench.units if u.of_controller and rng.random() < REMAINDER_PRIOR),
        *(u for u, k in kinds.items() if k == "remainder" and rng.random() < REMAINDER_PRIOR),
    ]
    d = bench.fixed.copy()
    d[bench.n] = bench.mean + width * bench.sd * rng.standard_normal(len(bench.n))
    members: dict[tuple[str, int], float] = {}
    for unit in map(str, chosen):
        variants = [v for u, v in bench.candidates if u == unit and v < OTHER_FORM]
        m = unit, int(rng.choice(variants))
        others = [v for u, v in bench.candidates if u == unit and v >= OTHER_FORM and v % OTHER_FORM == m[1]]
        other = bool(others) and rng.random() < OTHER_FORM_PRIOR
        m = (unit, int(rng.choice(others))) if other else m
        c = bench.candidates[m]
        members[m] = float(rng.choice(c.widths))
        k = bench.rest[c.index]
        held = np.array([bench.tolerance[q] for q in k.tolist() if c.hole.size and q in bench.tolerance], int)
        position = np.searchsorted(bench.n, held, sorter=np.argsort(bench.n))
        position = np.argsort(bench.n)[position] if len(held) else position
        while True:
            d[k] = c.mean + width * members[m] * c.sd * rng.standard_normal(len(k))
            if len(held):
                d[held] = bench.mean[position] + width * bench.sd[position] * rng.standard_normal(len(held))
            if allowed(bench, c, d[None])[0]:
                break
        if other:  # in proportion to the effect, as a fit has it
            share = (d[k] - bench.fixed[k]) / (SIZE * c.sd)
            d[bench.rest[c.extra]] = share * c.extra_sd * rng.standard_normal(len(c.extra))
    return Drawn(members, d)


def _drawn_forms(forms: Sequence[Unit], rng: np.random.Generator) -> tuple[str, ...]:
    """Ids of forms drawn from those of the prior's sets that are among these."""
    share = np.array([1.0 / (len(WORDS) * u.among) for u in forms])
    while True:
        count = rng.geometric(1.0 - ONE_MORE_FORM * share.sum()) - 1
        drawn = set(rng.choice(len(forms), count, p=share / share.sum()).tolist())
        if len(drawn) == count:  # sets hold a form once
            return tuple(forms[k].id for k in sorted(drawn))


def allowed(bench: LinearBench, c: Candidate, d: np.ndarray) -> np.ndarray:
    """Whether deviations (sample, column) are on a candidate's side of off and outside its hole."""
    k = bench.rest[c.index]
    apart = d[:, k] - bench.fixed[k]
    good = np.all((c.signs == 0) | (apart * c.signs >= 0.0), axis=1)
    if c.hole.size:
        low, high = c.hole * c.sd
        off = apart + np.column_stack([d[:, bench.tolerance[q]] if q in bench.tolerance else 0.0 * d[:, q] for q in k])
        good &= np.any((off <= low) | (off >= high), axis=1)
    return good


def data_of(bench: LinearBench, truth: Drawn, rng: np.random.Generator, noise: float = 1.0) -> Normal:
    """What the rows y = e - J d, d the truth's deviations, leave: g = J'y = -H d + L z, z white times ``noise``."""
    z = noise * rng.standard_normal(len(bench.root))
    return replace(bench.normal, g=bench.root @ z - bench.normal.H @ truth.deviations)
