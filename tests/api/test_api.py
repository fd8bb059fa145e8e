"""The public names: what they give, the README's lines, and that they cost nothing until they are used."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

import emafault
from emafault.cli import main

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """What the README's lines leave: their names, and the folder that they ran in."""
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    names: dict = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("readme"))
        exec(code, names)
        return names | {"folder": Path.cwd()}


def test_the_lines_of_the_readme_do_a_diagnosis(lines):
    found, folder = lines["found"], lines["folder"]
    assert found.effects == ("cogging",) and "The motor cogs" in str(found)
    assert (folder / lines["page"]).stat().st_size > 50_000 and (folder / "probabilities.png").is_file()
    assert (folder / "diagnosis" / "experiment.yaml").is_file()
    code = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)[0]
    assert len([line for line in code.splitlines() if line]) <= 10


def test_a_diagnosis_has_tables_plots_and_html(lines):
    found = lines["found"]
    parameters = pd.DataFrame(found.parameters()).set_index(["cause", "parameter"])
    low, high = parameters.loc[("cogging", "a"), ["low", "high"]]
    assert low < 0.005 < high
    assert pd.DataFrame(found.probabilities())["probability"].sum() == pytest.approx(1.0, abs=1e-4)
    assert len(found.fault_vector()) == 24 and found.gap()[0]["closed"] > 0.9
    assert found.residuals()[0]["equation"] == "torque"
    assert found.plot_gap().axes and found.plot_fault_vector().axes
    page = found._repr_html_()
    assert "data:image/png;base64," in page and "cogging" in page
    assert found.verdict["bench"] == "example" and found.verdict["next_experiment"]


def test_what_to_record_next_is_a_table_of_motions(lines, tmp_path):
    plan = emafault.plan(lines["found"])
    assert len(plan.table()) == len(plan.motions) > 0 and plan.plot().axes
    again = emafault.plan(lines["folder"] / "diagnosis" / "diagnosis.json")
    assert str(again) == str(plan)
    (first, *_) = plan.write(tmp_path)
    assert first.read_text().startswith("time_s,position_rad\n")


def test_identification_is_the_command_s(lines, tmp_path, capsys):
    bench = lines["bench"]
    found = emafault.identify(bench, results=tmp_path)
    (tmp_path / "one").mkdir()
    name = "shorted_warm.nc"
    (tmp_path / name).write_bytes((ROOT / "examples" / "bench" / name).read_bytes())
    assert main(["identify", str(tmp_path / name), "--results", str(tmp_path)]) == 0
    row = next(line for line in str(found).splitlines() if line.startswith(name)).split(maxsplit=1)[1]
    assert row in capsys.readouterr().out
    calibrated = emafault.identify(bench[name], reference=bench["healthy_warm.nc"], results=tmp_path)
    assert "calibrated on 1 healthy" in str(calibrated) and len(calibrated.table()) == 6
    assert abs(calibrated.estimates[name]["Na"]["value"] - 0.05) < 0.005
    assert "data:image/png" in found._repr_html_() and bench.plot(name).axes


def test_names_are_typed_and_loaded_when_used():
    stub = ast.parse((ROOT / "src" / "emafault" / "__init__.pyi").read_text())
    stated = [alias.asname for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert sorted([*stated, "__version__"]) == sorted(emafault.__all__)
    assert all(getattr(emafault, name) is not None and name in dir(emafault) for name in stated)
    code = "import sys, emafault; assert not {'numpy', 'numba', 'yaml'} & set(sys.modules); emafault.Recording"
    subprocess.run([sys.executable, "-c", code], check=True)
    with pytest.raises(AttributeError, match="emafault"):
        emafault.nothing  # noqa: B018


def test_every_public_name_stands_in_the_documentation():
    text = (ROOT / "docs" / "python.md").read_text()
    for name in emafault.__all__:
        assert f"`{name}" in text or f"emafault.{name}" in text, name
        public = getattr(emafault, name)
        if name in (
            "Diagnosis",
            "Identification",
            "MachineDiagnoses",
            "MachineDiagnosis",
            "Plan",
            "Recordings",
            "Actuator",
        ):
            own = [vars(base) for base in public.__mro__ if base.__module__.startswith("emafault")]
            for method in (m for names in own for m in names if not m.startswith("_")):
                assert f"`{method}" in text, (name, method)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: emafault.read("nowhere"), "nowhere: no such file"),
        (lambda: emafault.read(), "got no path"),
        (lambda: emafault.diagnose(3), "recordings: got 3"),
        (lambda: emafault.diagnose({}), "accepted are a path"),
        (lambda: emafault.diagnose(emafault.example(), exclude=["gremlins"]), "gremlins"),
        (lambda: emafault.diagnose(emafault.example(), twin="dq_machine"), "with a twin is the path"),
        (lambda: emafault.diagnose("a.csv", emafault.Actuator.reference(), twin="dq_machine"), "an actuator or a twin"),
        (lambda: emafault.identify(emafault.example(), level=2.0), "level"),
        (lambda: emafault.Actuator.reference(gear=3), r"actuator\.gear"),
        (lambda: emafault.Actuator.reference(gear_ratio=-3), r"actuator\.gear_ratio"),
        (lambda: emafault.example().plot("other.nc"), "other.nc"),
        (lambda: emafault.plan("nowhere.json"), "nowhere.json"),
    ],
)
def test_bad_input_is_one_line(call, says):
    with pytest.raises(emafault.InputError, match=says) as caught:
        call()
    assert "\n" not in str(caught.value)
