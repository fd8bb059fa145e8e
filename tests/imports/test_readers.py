"""Every format comes back as it was written: values, times, units."""

import sys

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.imports.listing import listed
from emafault.imports.readers import read_raw

from .measured import log
from .writers import WITHOUT_UNITS, WRITERS, channel, csv


@pytest.fixture(scope="module")
def short(fine):
    return log({name: values[:600] for name, values in fine.items()})


@pytest.mark.parametrize("file", WRITERS)
def test_a_file_is_read_as_it_was_written(file, short, tmp_path):
    WRITERS[file](tmp_path / file, short)
    found = read_raw(tmp_path / file)
    names = list(short.channels)
    for name, values in short.channels.items():
        got = found[channel(file, name, names)]
        assert got.to_numpy() == pytest.approx(values, rel=1e-9, abs=1e-12)
        assert got.attrs["units"] == ("" if file in WITHOUT_UNITS else short.units[name])
        time = found[got.dims[0]].to_numpy()
        assert time - time[0] == pytest.approx(short.time - short.time[0], abs=2e-9)
    if file == "bag":
        WRITERS[file](tmp_path / "other", short)
        (inside,) = (tmp_path / "other").glob("*.mcap")
        assert read_raw(inside).sizes == found.sizes


def test_a_listing_has_units_and_rates(short, tmp_path):
    csv(tmp_path / "a.csv", short)
    rows = {row[0]: row[1:] for row in listed(tmp_path / "a.csv")}
    assert rows["ua"][:3] == ("V", "600", "50000 Hz") and rows["speed"][0] == "rad/s"


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.xlsx", b"", "save the sheet as CSV"),
        ("a.trc", b"", "save the waveform as CSV"),
        ("a.odd", b"", "no reader for '.odd'"),
        ("a.csv", b"no numbers\nat all\n", "no table of numbers"),
        ("a.csv", b"", "no table of numbers"),
        ("a.mat", b"not a file of MATLAB", "cannot be read as .mat"),
        ("a.tdms", b"no", "holds no numeric channel"),
        ("a.mf4", b"no", "cannot be read as .mf4"),
        ("a.parquet", b"no", "cannot be read as .parquet"),
        ("a.mcap", b"no", "cannot be read as .mcap"),
        ("a.h5", b"no", "cannot be read as .h5"),
        ("a.npz", b"no", "cannot be read as .npz"),
        ("a.csv.gz", b"no", "cannot be read as .csv.gz"),
        ("a.mat.gz", b"no", "unpack it"),
    ],
)
def test_what_cannot_be_read_is_refused_with_what_to_do(name, content, says, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=says):
        read_raw(tmp_path / name)


def test_a_missing_library_names_its_extra(short, tmp_path, monkeypatch):
    WRITERS["log.tdms"](tmp_path / "a.tdms", short)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    monkeypatch.delitem(sys.modules, "emafault.imports.readers.tdms", raising=False)
    with pytest.raises(InputError, match=r"needs nptdms, which emafault\[tdms\] installs"):
        read_raw(tmp_path / "a.tdms")


def test_a_decimal_comma_is_not_a_separator(tmp_path):
    (tmp_path / "a.csv").write_text("t;u\n0,0;1,5\n0,1;2,5\n")
    found = read_raw(tmp_path / "a.csv")
    assert np.array_equal(found["u"], [1.5, 2.5]) and np.allclose(found["time"], [0.0, 0.1])


def test_milliseconds_may_stand_behind_a_third_colon(tmp_path):
    (tmp_path / "a.csv").write_text("Timestamp,u\n2019-11-05 17:14:08:947,1\n2019-11-05 17:14:09:002,2\n")
    assert read_raw(tmp_path / "a.csv")["time"].to_numpy() == pytest.approx([0.0, 0.055])
