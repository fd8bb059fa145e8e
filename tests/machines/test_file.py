"""A machine given as a file, from the command line and from Python."""

import json
import shutil
from pathlib import Path

import pytest

import emafault
from emafault.cli import main

from . import line

MINE = Path(__file__).with_name("line.py")


@pytest.fixture
def table(tmp_path):
    return line.write(tmp_path / "bench.csv", line.recorded() | {"v": _dropped()})


def _dropped():
    return line.recorded()["v"] + 0.8


def run(table: Path, twin: str, *more: str) -> int:
    return main(["diagnose", str(table), "--twin", twin, "--out", str(table.parent / "out"), "--no-tracking", *more])


def test_a_machine_given_as_a_file_is_diagnosed(table, tmp_path, capsys):
    mine = shutil.copy(MINE, tmp_path / "mine.py")
    assert run(table, str(mine)) == 0
    verdict = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert verdict["schema"] == "2.0" and verdict["which"][0]["effects"] == ["constant_drop"]
    assert "Constant drop" in capsys.readouterr().out
    assert (tmp_path / "out" / "report.html").read_text().count("<img") >= 1


def test_python_gives_what_the_command_writes(table, tmp_path, capsys):
    found = emafault.diagnose(table, twin=MINE)
    assert run(table, str(MINE)) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("\n".join(found.sentences)) and list(found) == ["bench"]
    assert found.write(tmp_path / "again").name == "report.html"
    for name in ("diagnosis.json", "report.html"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "out" / name).read_bytes()
    one = found["bench"]
    assert found.verdict == one.verdict == json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert one.kind == "explained" and one.effects == ("constant_drop",) and str(one).endswith(one.sentences[-1])
    (drop,) = one.parameters()
    assert drop["parameter"] == "V_drop" and drop["low"] < 0.8 < drop["high"] and drop["unit"] == "V"
    assert sum(row["probability"] for row in one.probabilities()) == pytest.approx(1.0, abs=1e-4)
    assert {row["parameter"] for row in one.base()} == {"k", "R"} and one.notes == ["a line"]
    assert one.gap()[0]["closed"] == found.table()[0]["closed"] > 0.9 and one.residuals()[0]["equation"] == "electrical"
    assert len(one.next_recordings()) == len(one.verdict["next_experiment"])
    assert one.plot_gap().axes and "data:image/png" in found._repr_html_() and "Constant drop" in found._repr_html_()


def test_python_gives_every_case_of_a_folder(table, tmp_path, capsys):
    (tmp_path / "two").mkdir()
    for name in ("dropping", "plain"):
        line.write(tmp_path / "two" / f"{name}.csv", line.recorded() | ({} if name == "plain" else {"v": _dropped()}))
    found = emafault.diagnose(tmp_path / "two", twin=str(MINE))
    rows = [tuple(row.values())[:3] for row in found.table()]
    assert rows == [("dropping", "explained", ["constant_drop"]), ("plain", "no_gap", [])]
    assert run(tmp_path / "two", str(MINE)) == 0
    assert capsys.readouterr().out.startswith("\n".join(found.sentences))
    assert found.verdict == json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    found.write(tmp_path / "again")
    written = {p.relative_to(tmp_path / "again") for p in (tmp_path / "again").rglob("*.*")}
    assert written == {p.relative_to(tmp_path / "out") for p in (tmp_path / "out").rglob("*.*")}
    with pytest.raises(emafault.InputError, match="is not of a diagnosis of this bench"):
        emafault.diagnose(table, twin=MINE).write(tmp_path / "again")


@pytest.mark.parametrize(
    ("name", "twin", "exclude"),
    [
        ("bench.csv", "toaster", []),
        ("bench.csv", "absent.py", []),
        ("absent.csv", str(MINE), []),
        ("bench.csv", str(MINE), ["cogging"]),
        ("bench.csv", "friction_axis", []),
    ],
)
def test_python_refuses_what_the_command_refuses_in_the_same_line(table, capsys, name, twin, exclude):
    path = table.with_name(name)
    with pytest.raises(emafault.InputError) as refusal:
        emafault.diagnose(path, twin=twin, exclude=exclude)
    assert run(path, twin, *(["--exclude", *exclude] if exclude else [])) == 2
    assert capsys.readouterr().err == f"emafault diagnose: {refusal.value}\n"


def test_an_effect_can_be_excluded(table, tmp_path, capsys):
    mine = shutil.copy(MINE, tmp_path / "mine.py")
    assert run(table, str(mine), "--exclude", "cogging") == 2
    assert "accepted are constant_drop" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def read(path): pass\n", "has no function 'build'"),
        ("import nothing_of_that_name\n", "ModuleNotFoundError"),
        ("def read(path:\n", "SyntaxError"),
        ("def read(path): return {'a': {}}\ndef build(case, arrays): return 3\n", "build gives a int"),
        ("def read(path): return 1 / 0\ndef build(case, arrays): return 3\n", "ZeroDivisionError"),
    ],
)
def test_a_file_that_states_no_machine_gives_one_line(table, tmp_path, capsys, text, said):
    (tmp_path / "mine.py").write_text(text)
    assert run(table, str(tmp_path / "mine.py")) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error and "mine" in error and said in error


def test_a_name_that_is_none_says_what_is_accepted(table, capsys):
    assert run(table, "toaster") == 2
    error = capsys.readouterr().err
    assert "toaster" in error and "friction_axis" in error and "Python file" in error
    assert run(table, "absent.py") == 2
    assert "absent.py: no such file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("stated", "instead", "said"),
    [
        ('Effect("self_heating"', 'Effect("self_cooling"', "effect 'self_cooling' has no parameter"),
        ('"electrical"', '"voltage"', "equation 'voltage', accepted are electrical"),
        ('"current", i, i, v', '"load", i, i, v', "lie along 'load', accepted are rotor_angle"),
        ("i, i, v, variance", "i, i, v, 0.0 * variance", "a variance is not positive"),
        ("i, i, v, variance", "i, i, v + np.nan, variance", "not a finite number"),
        ('"V_drop", "V", 0.5', '"k", "V", 0.5', "parameter 'k' is stated twice"),
    ],
)
def test_a_statement_that_does_not_fit_together_is_said(table, tmp_path, capsys, stated, instead, said):
    assert stated in MINE.read_text()
    (tmp_path / "mine.py").write_text(MINE.read_text().replace(stated, instead))
    assert run(table, str(tmp_path / "mine.py")) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error and "mine" in error and said in error


def test_the_example_of_the_page_on_machines_works(table, tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "machines.md").read_text()
    lines = text[text.index("    from emafault.machines.files import") :].splitlines()
    end = next(k for k, x in enumerate(lines) if x and not x.startswith("    "))
    (tmp_path / "mine.py").write_text("\n".join(x[4:] for x in lines[:end]))
    assert run(table, str(tmp_path / "mine.py")) == 0
    verdict = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert verdict["which"][0]["effects"] == ["constant_drop"]
