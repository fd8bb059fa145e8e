"""Bags of ROS 1 and ROS 2, MCAP among them."""

from pathlib import Path

import numpy as np

from . import dataset


def read(path: Path):
    """Numeric fields of all messages, named topic/field; times are those of the header, else of the recording."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    rows: dict[str, list] = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        for connection, stamp, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            header = getattr(message, "header", None)
            given = header.stamp.sec * 10**9 + header.stamp.nanosec if header is not None else 0
            nanoseconds = given or stamp
            rows.setdefault(connection.topic, []).append((nanoseconds, dict(_fields(message))))
    start = min((topic[0][0] for topic in rows.values()), default=0)
    groups = {}
    for topic, entries in rows.items():
        names = [n for n in entries[0][1] if all(n in e for _, e in entries)]
        time = np.array([t - start for t, _ in entries]) * 1e-9
        groups[topic] = time, {f"{topic}/{n}": (np.array([e[n] for _, e in entries], float), "") for n in names}
    return dataset(groups)


def _fields(message, above: str = ""):
    """Yield (name, number) of a message's fields, those of its parts and the entries of its arrays."""
    for name in message.__dataclass_fields__:
        value = getattr(message, name)
        if name in ("header", "__msgtype__"):
            continue
        if hasattr(value, "__dataclass_fields__"):
            yield from _fields(value, f"{above}{name}.")
        elif isinstance(value, bool | int | float | np.number):
            yield f"{above}{name}", value
        elif isinstance(value, np.ndarray | list) and all(isinstance(v, int | float | np.number) for v in value):
            yield from ((f"{above}{name}[{k}]", v) for k, v in enumerate(value))
