"""TDMS files of LabVIEW."""

from pathlib import Path

from . import dataset
from .frame import is_time


def read(path: Path):
    """Channels of a TDMS file, named group/channel; times are those of the waveform or of a channel named so."""
    from nptdms import TdmsFile

    groups: dict[str, tuple] = {}
    for group in TdmsFile.read(path).groups():
        numeric = [c for c in group.channels() if len(c) and c.dtype.kind in "fiu"]
        stamps = next((c[:] for c in numeric if is_time(c.name)), None)
        for channel in numeric:
            if is_time(channel.name):
                continue
            waveform = "wf_increment" in channel.properties
            time = channel.time_track() if waveform else stamps
            key = f"{group.name}:{len(channel)}:{channel.properties.get('wf_increment', '')}"
            unit = str(channel.properties.get("unit_string", channel.properties.get("NI_UnitDescription", "")))
            groups.setdefault(key, (time, {}))[1][f"{group.name}/{channel.name}"] = channel[:], unit
    return dataset(groups)
