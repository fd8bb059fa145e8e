"""Recordings read from files, by name."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, shown
from ..io.bench import bench_name
from ..io.recording import Recording, read_recording, recordings_in
from ..paths import EXAMPLE
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Recordings(Mapping[str, Recording]):
    """Recordings by name, of one actuator where they are to be diagnosed together."""

    def __init__(self, name: str, recordings: Mapping[str, Recording]) -> None:
        self.name = name
        self._recordings = dict(recordings)

    def __getitem__(self, name: str) -> Recording:
        return self._recordings[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._recordings)

    def __len__(self) -> int:
        return len(self._recordings)

    def table(self) -> Table:
        """A row a recording: duration and interval (s), ambient temperature (degC), health, command, largest values."""
        columns = ["recording", "duration (s)", "interval (s)", "ambient (degC)", "health", "command",
                   "largest speed (rad/s)", "largest current (A)"]  # fmt: skip
        rows = [
            [
                name, r.interval * len(r.time), r.interval, r.ambient_temperature, r.health,
                r.attributes.get("command", "unknown"), float(np.max(np.abs(r.rotor_speed))),
                float(np.max(np.abs(r.phase_current))),
            ]
            for name, r in self.items()
        ]  # fmt: skip
        return Table(columns, rows)

    def plot(self, *names: str) -> "Figure":
        """Voltages, currents, speed and position over time of the recordings named, of the first unless any is.

        Raises
        ------
        InputError : a name that there is not
        """
        from ..reporting.recordings import draw_recordings
        from .pictures import alone

        for name in names:
            if name not in self:
                raise InputError(f"{self.name}: got '{shown(name)}', accepted are {', '.join(self)}")
        return alone(draw_recordings({name: self[name] for name in names or list(self)[:1]}))

    def __repr__(self) -> str:
        return f"{len(self)} recordings of {self.name}\n{self.table()}"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()


def read(*paths: str | Path) -> Recordings:
    """Read recordings of the netCDF format; ``emafault import`` makes such of other files.

    Parameters
    ----------
    paths : files, or folders that stand for their ``*.nc`` files in order of name

    Raises
    ------
    InputError : naming the file, the variable and the rule broken
    """
    if not paths:
        raise InputError("read: got no path, accepted are files and folders of recordings")
    files = recordings_in(list(paths))
    names = [file.name for file in files]
    together = len(set(names)) == len(names)
    return Recordings(bench_name(paths[0]), {f.name if together else str(f): read_recording(f) for f in files})


def example() -> Recordings:
    """The bench in the box: four recordings of a simulated unit that cogs and has what no catalogue lists."""
    return Recordings("example", read(EXAMPLE))


def recordings_of(source: "str | Path | Recording | Mapping[str, Recording] | Sequence[Recording]") -> Recordings:
    """Recordings of whatever a function of this package is given.

    Raises
    ------
    InputError : something else, or a path that cannot be read
    """
    if isinstance(source, Recordings):
        return source
    if isinstance(source, str | Path):
        return read(source)
    if isinstance(source, Recording):
        return Recordings(Path(source.name).stem or "recording", {source.name or "recording": source})
    named: dict[str, Recording] = dict(source) if isinstance(source, Mapping) else {}
    if isinstance(source, list | tuple):
        named = {getattr(r, "name", "") or f"recording {n}": r for n, r in enumerate(source, start=1)}
    if named and all(isinstance(recording, Recording) for recording in named.values()):
        return Recordings("recordings", named)
    raise InputError(f"recordings: got {shown(repr(source))}, accepted are a path, a recording or several by name")
