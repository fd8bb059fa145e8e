"""A second logger with a clock of its own."""

import numpy as np
import pytest

from .checks import bring, off
from .measured import INTERVAL, log, map_of, rested

REST = 0.06  # s, before the motion


@pytest.mark.parametrize(
    ("second", "skew", "drift"),
    [(("angle", "speed", "out", "cmd"), 0.0371, 3e-4), (("ia", "ib", "ic"), -0.0122, 0.0)],
)
def test_a_second_clock_is_found(second, skew, drift, fine, truth, tmp_path):
    step = 0.1 * INTERVAL
    s = rested(fine, REST)
    one, two = log(s), log(s)
    one.channels = {n: v[max(0, -round(skew / step)) :] for n, v in one.channels.items() if n not in second}
    two.channels = {n: v[max(0, round(skew / step)) :] for n, v in two.channels.items() if n in second}
    # each counts from when it was started, one in seconds that are too short
    one.time = step * np.arange(1, len(next(iter(one.channels.values()))) + 1)
    two.time = step * np.arange(1, len(next(iter(two.channels.values()))) + 1) / (1.0 + drift) + 1e5
    begin = REST - max(0.0, -skew)
    given = map_of(loggers={"daq": {"samples": "means"}, "pod": {"samples": "means", "clock": "found"}})
    given["recordings"][0] = {
        "name": "one", "health": "unknown", "ambient": 24.0, "files": {"daq": "one.parquet", "pod": "two.parquet"},
        "segment": [begin, begin + 0.49],
    }  # fmt: skip
    for spec in given["signals"].values():
        if set(spec.get("channels", [spec.get("channel")])) <= set(second):
            spec["logger"] = "pod"
    result = bring(tmp_path, given, one=one, two=two)
    (finding,) = (f for f in result.findings if "clock of pod" in f.what)
    found = float(finding.taken.split()[0]), float(finding.taken.split()[-3])
    assert found[0] == pytest.approx(1e3 * skew, abs=0.1) and found[1] == pytest.approx(1e6 * drift, abs=100.0)
    # shared out anew over the intervals of the other clock, but right to a part of a sample
    assert off(result.recordings["one.nc"], truth, current=0.1, command=1e-5) == []


def test_a_shaft_s_clock_is_found_but_for_the_play(fine, tmp_path):
    step = 0.1 * INTERVAL
    one, two = log(rested(fine, REST)), log(rested(fine, REST))
    two.channels = {name: values[1000:] for name, values in two.channels.items() if name in ("out", "cmd")}
    two.time = step * np.arange(1, len(two.channels["out"]) + 1) + 7.0
    given = map_of(loggers={"daq": {"samples": "means"}, "pod": {"clock": "found"}})
    given["recordings"][0] |= {"files": {"daq": "one.parquet", "pod": "two.parquet"}, "segment": [REST, REST + 0.49]}
    for name in ("output_position", "commanded_position"):
        given["signals"][name]["logger"] = "pod"
    result = bring(tmp_path, given, one=one, two=two)
    (finding,) = (f for f in result.findings if "clock of pod" in f.what)
    late = abs(float(finding.taken.split()[0]) - 20.0)
    (told,) = (text for text in result.lost["one"] if "is found to" in text)
    assert 1e3 * late < float(told.split("found to ")[1].split()[0]) < 500.0
