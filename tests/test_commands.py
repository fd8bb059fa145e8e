"""The commands beside the work: configuration, schemas, completion and the bench in the box."""

import json
import subprocess

import jsonschema
import pytest
import yaml

from emafault import config
from emafault.cli import COMMANDS, main


def test_a_configuration_is_printed_as_it_is_composed(capsys):
    given = ["magnet=smco", "actuator.gear_ratio=400"]
    assert main(["config", *given, "--experiment", "nine_tolerance"]) == 0
    printed = capsys.readouterr().out
    assert yaml.safe_load(printed) == config.compose("nine_tolerance", given)
    marked = [line for line in reversed(printed.splitlines()) if "#" in line]  # of a key twice, the first counts
    sources = {line.split(":")[0].strip(): line.split("#")[1].strip() for line in marked}
    assert sources["gear_ratio"] == "override actuator.gear_ratio=400"
    assert sources["coefficient"] == "conf/magnet/smco.yaml"
    assert sources["coordinates"] == "conf/experiment/nine_tolerance.yaml"
    assert sources["activation"] == "conf/network/paper.yaml"
    assert sources["training_tolerance"] == "conf/experiment/nine_tolerance.yaml"
    assert sources["resistance"] == "conf/actuator/reference.yaml"


def test_a_plain_configuration_is_an_experiment_s(tmp_path, capsys):
    mine = tmp_path / "mine.yaml"
    mine.write_text("# @package _global_\ndefaults:\n  - override /command: sine\nquestion: Mine?\n")
    assert main(["config", "--experiment", str(mine), "--plain"]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == config.compose(str(mine))
    assert main(["config", "--experiment", str(mine)]) == 0
    printed = capsys.readouterr().out
    assert f"# {mine.as_posix()}" in printed and "# conf/command/sine.yaml" in printed


def test_every_schema_is_a_schema(capsys):
    assert main(["schema"]) == 0
    names = capsys.readouterr().out.split()
    assert {"verdict", "map"} <= set(names)
    for name in names:
        assert main(["schema", name]) == 0
        jsonschema.validators.validator_for(schema := json.loads(capsys.readouterr().out)).check_schema(schema)


def test_a_shell_completes_commands_and_options(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "completion"
    script.write_text(capsys.readouterr().out)
    words = {
        "": set(COMMANDS),
        "diagnose --ex": {"--exclude", "--experiment"},
        f"identify {tmp_path}/com": {str(script)},
    }
    for before, offered in words.items():
        *given, last = ["emafault", *before.split(" ")]
        code = (
            f"source {script}; COMP_WORDS=({' '.join([*given, last])}); COMP_CWORD={len(given)}; "
            f'_shtab_emafault emafault "{last}" "{given[-1]}"; echo "${{COMPREPLY[@]}}"'
        )
        done = subprocess.run(["bash", "-c", code], capture_output=True, text=True, check=True)
        assert offered <= set(done.stdout.split()), (before, done.stdout, done.stderr)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["config", "magnet=tin"], "magnet: got 'tin'"),
        (["config", "--experiment", "nothing"], "experiment: got 'nothing'"),
        (["schema", "poem"], "schema: got 'poem', accepted are"),
        (["demo", "--out", "{folder}"], "is not of a diagnosis of this bench"),
    ],
)
def test_bad_input_is_refused_in_one_line(tmp_path, capsys, arguments, says):
    (tmp_path / "diagnosis.json").write_text('{"mine": 1}')
    assert main([word.format(folder=tmp_path) for word in arguments]) == 2
    error = capsys.readouterr().err
    assert says in error and error.count("\n") == 1
    assert (tmp_path / "diagnosis.json").read_text() == '{"mine": 1}'
