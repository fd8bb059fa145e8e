"""The page docs/tutorial.md, run as it stands: from the example to a bench whose logger writes CSV files."""

import json
import re
from contextlib import chdir
from pathlib import Path

import pytest
import yaml

import pages

ROOT = Path(__file__).parents[1]
BLANK = "???"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tutorial")


@pytest.fixture(scope="module")
def blocks(folder):
    """The blocks of the page: commands run, with what they printed; files written, those replaced kept as ``.was``."""
    out = pages.blocks((ROOT / "docs" / "tutorial.md").read_text())
    with chdir(folder):
        for block in out:
            if block.language == "sh":
                for line in block.text.splitlines():
                    assert block.code == 0, line
                    block.code, printed = pages.run(line)
                    block.printed += printed
            elif block.language in ("yaml", "python"):
                path = Path(block.text.splitlines()[0].removeprefix("# "))
                if path.exists():
                    path.rename(f"{path}.was")
                path.write_text(block.text)
    return out


def test_commands_do_what_the_page_shows(blocks):
    told = list(zip(blocks, [*blocks[1:], pages.Block("", "")], strict=True))
    assert sum(after.language == "text" for _, after in told) >= 8
    for block, after in told:
        if after.language == "text":
            assert block.language == "sh" and pages.shown(after.text, block.printed) == "", block.printed
        if block.language == "sh":
            refused = after.language == "text" and re.match(r"emafault \w+: ", after.text)
            assert block.code == (2 if refused else 0), block.text


def test_the_file_of_the_actuator_is_the_example_s(folder, blocks):
    example = ROOT / "examples" / "actuators" / "hinge_28v.yaml"
    assert yaml.safe_load((folder / "mine.yaml").read_text()) == yaml.safe_load(example.read_text())


def test_the_map_is_the_guessed_one_filled_in(folder, blocks):
    guessed, filled = (yaml.safe_load((folder / name).read_text()) for name in ("bench.yaml.was", "bench.yaml"))
    assert BLANK in json.dumps(guessed) and BLANK not in json.dumps(filled)
    assert _filled(guessed, filled)


def _filled(guessed, given):
    if isinstance(guessed, dict):
        return guessed.keys() == given.keys() and all(_filled(guessed[k], given[k]) for k in guessed)
    if isinstance(guessed, list):
        return len(guessed) == len(given) and all(map(_filled, guessed, given))
    return guessed in (BLANK, given)


def test_the_verdict_and_the_fault_are_what_was_simulated(folder, blocks):
    verdict = json.loads((folder / "verdict" / "diagnosis.json").read_text())
    first = verdict["which"][0]
    assert verdict["verdict"] == "explained" and first["effects"] == ["cogging"]
    assert first["parameters"]["a"]["value"] == pytest.approx(0.002, rel=0.05)
    for name, wanted in (("ramp_cold.nc", -20.0), ("ramp_warm.nc", 20.0), ("sine.nc", 0.0)):
        after = verdict["fault_vector"][name]["after"]
        assert after["Nb"]["low"] < 0.06 < after["Nb"]["high"] and after["Na"]["low"] < 0.0 < after["Na"]["high"]
        assert after["dT"]["value"] == pytest.approx(wanted, abs=1.0)


def test_files_that_the_page_names_are_there(folder, blocks):
    for name in ("demo/report.html", "demo/experiment.yaml", "bench/import.html", "verdict/report.html"):
        assert (folder / name).stat().st_size > 0, name
    assert (folder / "motions" / "1_chirp.csv").read_text().startswith("time_s,position_rad")


@pytest.mark.parametrize(
    ("text", "printed", "missing"),
    [
        ("a 1.00 b\n...\nend", "x\na   1.02 b\ny\nend", ""),
        ("a 1.00 b", "a 1.2 b", "a 1.00 b"),
        ("a ... of acb (0.5)", "a (margin 3e+4) of acb (0.5)", ""),
        ("one\ntwo", "two\none", "two"),
        ("is phase a", "is phase b", "is phase a"),
    ],
)
def test_what_counts_as_shown(text, printed, missing):
    assert pages.shown(text, printed) == missing
