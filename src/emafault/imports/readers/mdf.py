"""ASAM MDF, versions 3 and 4."""

from pathlib import Path

from . import dataset


def read(path: Path):
    """Channels of an MDF file; each group has its own time base. A name met twice has its group before it."""
    from asammdf import MDF

    groups: dict[str, tuple] = {}
    taken: set[str] = set()
    with MDF(path) as file:
        for number, group in enumerate(file.groups):
            for index, channel in enumerate(group.channels):  # type: ignore[attr-defined]
                if index == file.masters_db.get(number) or channel.channel_type in (2, 3):
                    continue
                signal = file.get(group=number, index=index)
                if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "fiu" or len(signal) < 2:
                    continue
                name = f"{number}/{signal.name}" if signal.name in taken else signal.name
                taken.add(name)
                groups.setdefault(f"group {number}", (signal.timestamps, {}))[1][name] = signal.samples, signal.unit
    return dataset(groups)
