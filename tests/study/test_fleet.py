"""A fleet of three small benches of two units: rows, resumption, history, page."""

from dataclasses import replace

import numpy as np
import pytest

from emafault import config
from emafault.dataset import simulate_recording
from emafault.effects import EFFECTS
from emafault.errors import InputError
from emafault.io.recording import write_recording
from emafault.study import fleet
from emafault.study.fleet_page import write_page
from emafault.study.history import changes, histories, ranked, since

#: the library of this test, so that a diagnosis takes seconds
KEPT = ("cogging", "viscous_friction")
BENCHES = {
    "first": ("unit 1", "2026-03-01", ()),
    "second": ("unit 1", "2026-09-01", ("effects.cogging.a=0.03",)),
    "third": ("unit 2", "2026-09-02", ()),
}


@pytest.fixture(scope="module")
def benches(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fleet")
    for name, (unit, recorded, overrides) in BENCHES.items():
        spec = config.dataset_spec(config.compose(overrides=["recording.duration=0.3", *overrides]), "fresh")
        recording = simulate_recording(spec, np.array([0.02, 0, 0, 0, 0.01, 0.0]))
        attributes = recording.attributes | {"unit": unit, "recorded": recorded}
        write_recording(folder / name / "recording.nc", replace(recording, attributes=attributes))
    (folder / "fourth").mkdir()
    (folder / "fourth" / "broken.nc").write_bytes(b"\x89HDF")
    return folder


@pytest.fixture(scope="module")
def rows(benches, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    spec = config.diagnosis_spec(config.compose())
    others = [effect for effect in EFFECTS if effect not in KEPT]
    (batch,) = config.batches(str(benches))
    fleet.diagnose_batch(batch, spec, out / "rows", out / "batch_0.parquet", others)
    kept = {p: p.stat().st_mtime_ns for p in (out / "rows").iterdir()}
    assert len(kept) == 4
    fleet.diagnose_batch(batch, spec, out / "rows", out / "batch_1.parquet", others)  # nothing is done again
    assert {p: p.stat().st_mtime_ns for p in (out / "rows").iterdir()} == kept
    assert (out / "batch_0.parquet").read_bytes() == (out / "batch_1.parquet").read_bytes()
    fleet.join_batches([out / "batch_0.parquet", out / "batch_1.parquet"], out / "fleet.parquet")
    both = fleet.read_table(out / "fleet.parquet")
    assert both[:4] == both[4:]
    return both[:4]


def test_a_bench_is_a_row_and_a_refused_one_says_why(rows):
    of = {row["bench"]: row for row in rows}
    assert of["second"]["named"] == ["cogging"] and of["second"]["unit"] == "unit 1"
    assert not of["first"]["named"] and of["second"]["gap"] > of["first"]["gap"]
    assert abs(of["third"]["Na"] - 0.02) < 4.0 * of["third"]["Na_sd"]
    assert of["fourth"]["verdict"] == "refused" and "broken.nc" in of["fourth"]["reason"]


def test_benches_of_a_unit_are_a_history(rows):
    units = histories(rows)
    assert [row["bench"] for row in units["unit 1"]] == ["first", "second"] and len(units["unit 2"]) == 1
    told = changes(*units["unit 1"])
    assert (told[0].what, told[0].kind) == ("cogging", "appeared") and told[0].probability > 0.9
    assert since(units["unit 1"], "cogging")["bench"] == "second" and since(units["unit 2"], "cogging") is None
    assert ranked(units) == ["unit 1", "unit 2"]
    grown = units["unit 2"][0] | {"Na": 0.2, "Na_sd": 0.01}
    (change,) = [c for c in changes(units["unit 2"][0], grown) if c.what == "Na"]
    assert change.kind == "rose" and change.probability > 0.999 and "from 0.0" in change.sentence()


def test_the_page_ranks_and_tells(rows, tmp_path):
    write_page(rows, "of <three>", tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "Fleet of &lt;three&gt;" in page and page.index("unit 1") < page.index("unit 2")
    assert "cogging (since 2026-09-01)" in page and "cogging appeared" in page and "broken.nc" in page


def test_a_folder_without_benches_is_refused(tmp_path):
    for folder, words in ((tmp_path, "holds no folder"), (tmp_path / "none", "no such folder"), ("", "none given")):
        with pytest.raises(InputError, match=words):
            config.batches(str(folder))
