"""Search over network size and training with Optuna: two objectives, several workers on one storage, resumable.

Given the seed, one worker from an empty storage proposes the same trials each time, killed and resumed or not; with
several workers what a sampler has seen depends on which trial ended first, so that repetition is best effort. A trial's
own result does not: it depends on its settings and the seed alone.
"""

import contextlib
import hashlib
import json
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..databases import SQLITE, locked, with_driver, without_password
from ..errors import InputError
from ..processes import still_there, this_process
from .rows import Table, at_most, in_blocks
from .settings import NetworkSettings, TrainingSettings
from .training import train

#: how often the owner of a trial shows that it is alive, and after how long without that a worker of another host
#: counts the trial as abandoned (s, by the clock of who waits); on the owner's host its process is asked for
HEARTBEAT, ABANDONED_AFTER = 10.0, 60.0
_LOCKED_FOR = 60.0  # s that SQLite waits for another process
_JOURNAL_HEAD = b'{"op_code":'
SAMPLERS = ("tpe", "nsga2")
#: proposals of settings already tried that are refused in a row before one is taken, as it must be in a small space
_REPEATS = 20


@dataclass(frozen=True)
class SearchSettings:
    """What is searched and how.

    ``space`` maps ``network.<key>`` or ``training.<key>`` (the keys of :mod:`.settings`) to a list of values, or to
    a range {low, high} with an optional ``log`` or ``step``; what is not named keeps ``network`` and ``training``.
    """

    space: Mapping[str, Any]
    trials: int = 40
    sampler: str = "tpe"
    repeats: int = 2  # splits and starts averaged in one trial
    seed: int = 0
    network: Mapping[str, Any] = field(default_factory=dict)
    training: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.sampler not in SAMPLERS:
            raise InputError(f"search.sampler: got '{self.sampler}', accepted are {', '.join(SAMPLERS)}")
        if self.trials < 1 or self.repeats < 1:
            raise InputError(f"search: got trials {self.trials} and repeats {self.repeats}, accepted is 1 or more")
        if not self.space:
            raise InputError("search.space: is empty, accepted are keys of network. and training.")
        for corner in ("low", "high"):  # refuse an impossible space before anything runs
            self.settings({key: _corner(key, spec, corner) for key, spec in self.space.items()})

    def settings(self, values: Mapping[str, Any]) -> tuple[NetworkSettings, TrainingSettings]:
        """Network and training settings of one point of the space.

        Raises
        ------
        InputError : a key that is neither of the network nor of the training
        """
        parts: dict[str, dict[str, Any]] = {"network": dict(self.network), "training": dict(self.training)}
        for key, value in values.items():
            section, _, name = key.partition(".")
            if section not in parts or not name:
                raise InputError(f"search.space.{key}: not known, accepted are network.<key> and training.<key>")
            parts[section][name] = value
        return NetworkSettings.of(parts["network"]), TrainingSettings.of(parts["training"])


@dataclass(frozen=True)
class Trial:
    """One finished trial: its settings, the held-out error over range and the number of weights."""

    number: int
    error: float
    parameters: int
    network: dict[str, Any]
    training: dict[str, Any]
    seconds: float
    pareto: bool = False


def _corner(key: str, spec: Any, corner: str) -> Any:
    if isinstance(spec, Mapping):
        if not {"low", "high"} <= spec.keys() <= {"low", "high", "log", "step"}:
            raise InputError(f"search.space.{key}: got {dict(spec)}, accepted are low, high, log and step")
        if not spec["low"] <= spec["high"]:
            raise InputError(f"search.space.{key}: low {spec['low']} is above high {spec['high']}")
        return spec[corner]
    if isinstance(spec, str) or not isinstance(spec, Sequence) or not spec:
        raise InputError(f"search.space.{key}: got {spec!r}, accepted are a list of values or {{low, high}}")
    return spec[0 if corner == "low" else -1]


def _suggest(trial, key: str, spec: Any) -> Any:
    if not isinstance(spec, Mapping):
        return trial.suggest_categorical(key, list(spec))
    low, high, log, step = spec["low"], spec["high"], bool(spec.get("log")), spec.get("step")
    if isinstance(low, int) and isinstance(high, int):
        return trial.suggest_int(key, low, high, step=step or 1, log=log)
    return trial.suggest_float(key, low, high, step=step, log=log)


def study_name(settings: SearchSettings, features: Table, faults: Table, width: np.ndarray) -> str:
    """Name of the study: a digest of everything that a trial's result depends on, so not of the number of trials."""
    plain = {key: value for key, value in asdict(settings).items() if key not in ("trials", "sampler")}
    digest = hashlib.sha256(json.dumps(plain, sort_keys=True, default=str).encode())
    for table in (features, faults, width):
        for block in in_blocks(len(table)):
            digest.update(np.ascontiguousarray(table[block], float).tobytes())
    return f"network-{digest.hexdigest()[:16]}"


def open_study(storage: str | Path, name: str, sampler: Any = None):
    """Open or create the study.

    Parameters
    ----------
    storage : a file (the journal, also for several workers) or a database URL such as ``sqlite:///search.db``

    Raises
    ------
    InputError : the storage cannot be opened
    """
    import optuna
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    address = str(storage)
    if "://" in address:
        return _database_study(address, name, sampler)
    path = Path(storage).resolve()  # the lock misbehaves on relative paths
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # an open lock, since the symbolic one judges its age by the journal's; writes take milliseconds
        lock = JournalFileOpenLock(str(path), grace_period=10)
        _mend(path, lock)
        target = JournalStorage(JournalFileBackend(str(path), lock_obj=lock))
        return _study(target, name, sampler)
    except (ValueError, LookupError, TypeError, AssertionError) as error:  # whatever reading other lines leads to
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: {_garbage(path)}; cut it off there, or name another file") from error
    except OSError as error:
        raise InputError(f"{path}: the search cannot be stored ({error.strerror or error})") from error


def _database_study(address: str, name: str, sampler: Any):
    from optuna.storages import RDBStorage

    waits = {"connect_args": {"timeout": _LOCKED_FOR}} if address.startswith(SQLITE) else {"pool_pre_ping": True}
    try:
        with locked(address):  # tables and the study are created by one process at a time
            return _study(RDBStorage(with_driver(address), engine_kwargs=waits), name, sampler)
    except (ValueError, OSError, ImportError) as error:
        raise InputError(f"{without_password(address)}: not a usable search storage ({error})") from error
    except Exception as error:  # what a database driver raises depends on the database
        if type(error).__module__.split(".")[0] not in ("sqlalchemy", "optuna"):
            raise
        reason = str(error).splitlines()[0]
        raise InputError(f"{without_password(address)}: not a usable search storage ({reason})") from error


def _study(storage: Any, name: str, sampler: Any):
    import optuna

    return optuna.create_study(
        storage=storage,
        study_name=name,
        directions=["minimize", "minimize"],
        sampler=sampler,
        load_if_exists=True,
    )


def _garbage(path: Path) -> str:
    """Where a journal stops being one."""
    for number, line in enumerate(path.read_bytes().splitlines(), start=1):
        try:
            json.loads(line)["op_code"]
        except (ValueError, LookupError, TypeError):
            return f"line {number} is of no search journal"
    return "its lines are of no search journal"


def _mend(path: Path, lock) -> None:
    """Cut off a last line that a killed worker left unfinished: the next one appended would be lost with it."""
    if not path.exists() or path.stat().st_size == 0:
        return
    with open(path, "r+b") as file:
        head = file.read(len(_JOURNAL_HEAD))
        if head != _JOURNAL_HEAD[: len(head)]:
            raise InputError(f"{path}: not a search journal; name another file or remove this one")
        file.seek(-1, os.SEEK_END)
        if file.read(1) == b"\n":
            return
        lock.acquire()
        try:
            file.seek(0)
            data = file.read()
            file.truncate(data.rfind(b"\n") + 1)
        finally:
            lock.release()


class _Watch:
    """Which running trials of a study were abandoned by their owners, as this worker sees it."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[Any, float]] = {}  # trial -> last beat and when it was first seen here

    def bury_abandoned(self, study) -> None:
        """Tell trials failed whose owners are gone."""
        from optuna.trial import TrialState

        for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
            if self._abandoned(trial):
                _tell(study, trial.number, state=TrialState.FAIL)

    def _abandoned(self, trial) -> bool:
        owner, beat = trial.user_attrs.get("owner"), trial.user_attrs.get("beat")
        if owner is not None:  # one worker runs its trials one after the other, and asks between two of them
            there = still_there(owner) and owner != this_process()
            if there is not None:
                return not there
        last, since = self._seen.get(trial.number, (None, 0.0))
        if trial.number not in self._seen or last != beat:
            self._seen[trial.number] = beat, time.monotonic()
            return False
        # one without an owner was killed between asking for the trial and signing it
        return time.monotonic() - since > (10.0 if owner is None else ABANDONED_AFTER)


def _tell(study, trial, *values, **more) -> bool:
    """Tell a trial's end; False where another worker was first, by whom it was taken for abandoned."""
    try:
        study.tell(trial, *values, **more)
    except (ValueError, RuntimeError, LookupError) as error:
        from optuna.exceptions import StorageInternalError

        if isinstance(error, StorageInternalError):
            raise
        return False
    return True


@contextlib.contextmanager
def _beating(trial) -> Iterator[None]:
    """Show to workers of other hosts that this trial is being worked on."""
    done = threading.Event()

    def beat() -> None:
        count = 0
        while not done.wait(HEARTBEAT):
            count += 1
            with contextlib.suppress(Exception):  # told abandoned meanwhile, or a storage that is not reached now
                trial.set_user_attr("beat", count)

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def trial_error(
    settings: SearchSettings, values: Mapping[str, Any], features: Table, faults: Table, width: np.ndarray
) -> tuple[float, int]:
    """Held-out error over range, of rows neither trained on nor used for stopping, and the number of weights."""
    network, training = settings.settings(values)
    shares = []
    for repeat in range(settings.repeats):
        model = train(features, faults, network, training, seed=settings.seed + 7919 * repeat)
        rows = at_most(model.test_rows if len(model.test_rows) else model.validation_rows, settings.seed)
        residual = np.abs(model.network.predict(features[rows]) - faults[rows])
        used = width > 0.0
        shares.append(float(np.mean(residual[:, used] / width[used])))
    return float(np.mean(shares)), model.network.parameters


def run_worker(
    storage: str | Path,
    settings: SearchSettings,
    features: Table,
    faults: Table,
    width: np.ndarray,
    worker: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Run trials until the study holds the asked number of finished ones, together with any other workers.

    Parameters
    ----------
    storage : see :func:`open_study`
    features, faults : (run, feature), (run, 6) training rows, the same for all workers
    width : (6,) what errors are divided by, see ``evaluation.fault_range``
    worker : number of this worker; part of its sampler's seed
    progress : called with (finished, asked)

    Returns
    -------
    number of trials that this worker ran
    """
    from optuna.trial import TrialState

    study = open_study(storage, study_name(settings, features, faults, width))
    watch, done_here, repeated = _Watch(), 0, 0
    while True:
        watch.bury_abandoned(study)
        trials = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE, TrialState.RUNNING))
        complete = sum(t.state == TrialState.COMPLETE for t in trials)
        if progress:
            progress(complete, settings.trials)
        if complete >= settings.trials:
            return done_here
        if len(trials) >= settings.trials:
            time.sleep(0.2)  # the last ones run elsewhere; should that worker die, they are run here
            continue
        study.sampler = _sampler(settings, worker, complete, repeated)
        trial = study.ask()
        trial.set_user_attr("owner", this_process())
        if _asked_before(study, trial) >= settings.trials:  # workers that counted at once have asked for the last one
            _tell(study, trial, state=TrialState.FAIL)
            continue
        values = {key: _suggest(trial, key, spec) for key, spec in sorted(settings.space.items())}
        twin = next((t for t in trials if t.params == values), None)
        if twin is not None and repeated < _REPEATS:
            _tell(study, trial, state=TrialState.FAIL)  # samplers pass over these, and they do not count
            repeated += 1
            continue
        repeated = 0
        known = twin.values if twin is not None and twin.state == TrialState.COMPLETE else None
        with _beating(trial):
            found = known or trial_error(settings, values, features, faults, width)
        done_here += _tell(study, trial, found)


def _asked_before(study, trial) -> int:
    """How many trials, finished or running, were asked for before this one: the storage numbers them in turn."""
    from optuna.trial import TrialState

    counted = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE, TrialState.RUNNING))
    return sum(other.number < trial.number for other in counted)


def _sampler(settings: SearchSettings, worker: int, complete: int, repeated: int):
    """A sampler seeded by how far the search has come, so that one that was killed goes on as it would have."""
    import optuna

    seed = int(np.random.SeedSequence([settings.seed, worker, complete, repeated]).generate_state(1)[0])
    if settings.sampler == "tpe":
        return optuna.samplers.TPESampler(seed=seed, constant_liar=True, multivariate=True)
    return optuna.samplers.NSGAIISampler(seed=seed, population_size=max(4, min(20, settings.trials // 3)))


def finished(
    storage: str | Path, settings: SearchSettings, features: Table, faults: Table, width: np.ndarray
) -> list[Trial]:
    """Finished trials in the order of their numbers, none of them marked.

    Raises
    ------
    InputError : an unusable storage
    """
    from optuna.trial import TrialState

    study = open_study(storage, study_name(settings, features, faults, width))
    out = []
    for trial in study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
        network, training = settings.settings(trial.params)
        seconds = trial.duration.total_seconds() if trial.duration else float("nan")
        error, parameters = trial.values[0], int(trial.values[1])
        out.append(Trial(trial.number, error, parameters, network.as_dict(), training.as_dict(), seconds))
    return out


def ranked(trials: Iterable[Trial], asked: int) -> list[Trial]:
    """The asked number of trials at most, the first by number, those on the Pareto front marked."""
    first = sorted(trials, key=lambda trial: trial.number)[:asked]
    points = [(trial.error, trial.parameters) for trial in first]
    out: list[Trial] = []
    for trial, (error, parameters) in zip(first, points):
        beaten = any(e <= error and p <= parameters and (e, p) != (error, parameters) for e, p in points)
        beaten = beaten or (error, parameters) in points[: len(out)]  # of equals the first
        out.append(replace(trial, pareto=not beaten))
    return out


def choose(trials: Sequence[Trial], tolerance: float = 0.05) -> Trial:
    """The smallest network whose error is within ``tolerance`` (a fraction) of the best; of equals the more accurate.

    Raises
    ------
    InputError : no finished trial
    """
    if not trials:
        raise InputError("search: no trial has finished, nothing can be chosen")
    best = min(trial.error for trial in trials)
    good = [trial for trial in trials if trial.error <= best * (1.0 + tolerance)]
    return min(good, key=lambda trial: (trial.parameters, trial.error, trial.number))
