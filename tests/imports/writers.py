"""Logs written in the formats that are read, each with its own library."""

import numpy as np
import pandas as pd


def frame(log):
    """Columns with their units in brackets, the time first."""
    columns = {f"{name} [{log.units[name]}]": values for name, values in log.channels.items()}
    return pd.DataFrame({"time [s]": log.time, **columns})


def csv(path, log):
    frame(log).to_csv(path, index=False)


def european_csv(path, log):
    path.write_text("Logger 3\nMessung: \t Prüfstand\n\n", encoding="latin-1")
    frame(log).to_csv(path, index=False, sep=";", decimal=",", mode="a", encoding="latin-1")


def oscilloscope_csv(path, log):
    names = ",".join(["Time", *log.channels])
    units = ",".join(["(ms)", *(f"({log.units[name]})" for name in log.channels)])
    head = f"Model,Scope 4000\nRecord Length,{len(log.time)}\nProbe Attenuation,1\n{names}\n{units}\n\n"
    body = frame(log)
    body["time [s]"] *= 1e3
    path.write_text(head + body.to_csv(index=False, header=False))


def counted_csv(path, log):
    step = log.time[1] - log.time[0]
    names, units = ",".join(log.channels), ",".join(log.units[name] for name in log.channels)
    head = f"X,{names},Start,Increment\nSequence,{units},0.0,{float(step)!r}\n"
    body = frame(log)
    body["time [s]"] = np.arange(1, len(body) + 1)
    path.write_text(head + body.to_csv(index=False, header=False).replace("\n", ",,\n"))


def tsv(path, log):
    frame(log).to_csv(path, index=False, sep="\t")


def parquet(path, log):
    frame(log).to_parquet(path)


def mat(path, log):
    from scipy.io import savemat

    savemat(path, {"log": {"time": log.time, **log.channels}})


def mat_73(path, log):
    """As MATLAB lays it out: a group a structure, row vectors as columns, its name for each class."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("log")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in {"time": log.time, **log.channels}.items():
            group.create_dataset(name, data=values[:, None]).attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + (0x0200).to_bytes(2, "little") + b"IM")


def tdms(path, log):
    from nptdms import ChannelObject, TdmsWriter

    step = log.time[1] - log.time[0]
    timed = {"wf_increment": step, "wf_start_offset": log.time[0], "wf_samples": 1}
    with TdmsWriter(path) as file:
        file.write_segment(
            [ChannelObject("daq", n, v, timed | {"unit_string": log.units[n]}) for n, v in log.channels.items()]
        )


def mf4(path, log):
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(v, log.time, unit=log.units[n], name=n) for n, v in log.channels.items()])
        file.save(path, overwrite=True)


def _in_threes(log):
    """Yield name of a topic, and (sample, 3) values of three channels, the last filled up with the first ones."""
    names = list(log.channels)
    for at in range(0, len(names), 3):
        three = (names[at : at + 3] + names[:2])[:3]
        yield f"/{'_'.join(three)}", np.column_stack([log.channels[name] for name in three])


def bag(path, log):
    """Of ROS 2: stamped points, each of three channels."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    stamped, stamp = kinds["geometry_msgs/msg/PointStamped"], kinds["builtin_interfaces/msg/Time"]
    header, point = kinds["std_msgs/msg/Header"], kinds["geometry_msgs/msg/Point"]
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as file:
        for name, values in _in_threes(log):
            topic = file.add_connection(name, stamped.__msgtype__, typestore=store)
            for t, xyz in zip(np.round(log.time * 1e9).astype(int), values.tolist(), strict=True):
                seconds, nanoseconds = divmod(int(t) + 10**9, 10**9)
                message = stamped(header(stamp(seconds, nanoseconds), ""), point(*xyz))
                file.write(topic, int(t) + 10**9, store.serialize_cdr(message, stamped.__msgtype__))


def bag_1(path, log):
    """Of ROS 1: the same, in one file."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kinds = store.types
    stamped, stamp = kinds["geometry_msgs/msg/PointStamped"], kinds["builtin_interfaces/msg/Time"]
    header, point = kinds["std_msgs/msg/Header"], kinds["geometry_msgs/msg/Point"]
    with Writer(path) as file:
        for name, values in _in_threes(log):
            topic = file.add_connection(name, stamped.__msgtype__, typestore=store)
            for k, (t, xyz) in enumerate(zip(np.round(log.time * 1e9).astype(int), values.tolist(), strict=True)):
                seconds, nanoseconds = divmod(int(t) + 10**9, 10**9)
                message = stamped(header(k, stamp(seconds, nanoseconds), ""), point(*xyz))
                file.write(topic, int(t) + 10**9, store.serialize_ros1(message, stamped.__msgtype__))


def netcdf(path, log):
    import xarray as xr

    variables = {n: ("time", v, {"units": log.units[n]}) for n, v in log.channels.items()}
    xr.Dataset(variables, {"time": ("time", log.time, {"units": "s"})}).to_netcdf(path)


def hdf5(path, log):
    import h5py

    with h5py.File(path, "w") as file:
        group = file.create_group("daq")
        group["time"] = log.time
        for name, values in log.channels.items():
            group[name] = values
            group[name].attrs["units"] = log.units[name]


def npz(path, log):
    np.savez(path, time=log.time, **log.channels)


#: name of a file -> its writer
WRITERS = {
    "plain.csv": csv, "european.csv": european_csv, "oscilloscope.csv": oscilloscope_csv, "counted.csv": counted_csv,
    "log.tsv": tsv, "log.parquet": parquet, "v5.mat": mat, "v73.mat": mat_73, "log.tdms": tdms, "log.mf4": mf4,
    "bag": bag, "one.bag": bag_1, "log.nc": netcdf, "log.h5": hdf5, "packed.csv.gz": csv, "log.npz": npz,
}  # fmt: skip
#: files -> name of a channel in them, where it is not that of the log
NAMED = {
    "v5.mat": "log/{}", "v73.mat": "log/{}", "log.tdms": "daq/{}", "log.h5": "daq/{}",
}  # fmt: skip
WITHOUT_UNITS = ("v5.mat", "v73.mat", "bag", "one.bag", "log.npz")


def channel(file, name, names):
    """Name of a log's channel in a file."""
    if file.endswith("bag"):
        at = names.index(name)
        three = (names[at - at % 3 : at - at % 3 + 3] + names[:2])[:3]
        return f"/{'_'.join(three)}/point.{'xyz'[at % 3]}"
    return NAMED.get(file, "{}").format(name)
