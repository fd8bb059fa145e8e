"""Generated input: whatever it is, it is taken, or refused in one line, with nothing else written or lost."""

import json
import string
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("hypothesis", reason="in the dev extra")
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from emafault import checks, config
from emafault.actuator.commands import read_command
from emafault.errors import InputError, one_line
from emafault.identification.identifier import Identifier
from emafault.io.bench import check_bench
from emafault.io.recording import read_recording, write_recording
from emafault.plain import escaped, read_yaml
from emafault.reconstruction import reconstruct

from .conftest import say, state
from .recordings import SIGNALS
from .saved import IDENTIFIER

ACTUATOR = config.reference_actuator()
KEYS = ("faults.dT.high", "command", "effects.stribeck.a", "recording.duration", "actuator.gear_ratio", "name", "unit")


def examples(number: int):
    """So many examples, the same in every run."""
    quiet = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large]
    return settings(max_examples=number, deadline=None, derandomize=True, database=None, suppress_health_check=quiet)


def taken(function, *arguments) -> bool:
    """Whether input is taken; it may be refused in one line only."""
    try:
        function(*arguments)
    except InputError as error:
        text = str(error)
        assert text and len(one_line(text)) < 3000
        return False
    return True


sizes = st.one_of(st.floats(-1e3, 1e3), st.floats(width=64), st.sampled_from([0.0, -0.0, 1e300, -1e300, 1e-300]))
numbers = st.one_of(sizes, st.integers(), st.booleans())
scalars = st.one_of(numbers, st.none(), st.text(max_size=20))
plain = st.recursive(
    scalars,
    lambda below: st.lists(below, max_size=4) | st.dictionaries(st.text(max_size=8), below, max_size=4),
    max_leaves=8,
)
words = st.text(string.ascii_letters + string.digits + "=.,:/+~@$ {}[]()'\"\\-_*?!#%&\n\t\0ü", max_size=30)


@examples(120)
@given(data=st.data())
def test_readers_take_a_damaged_recording_or_refuse_it(workshop, data):
    whole = (workshop / "good.nc").read_bytes()
    at, length = data.draw(st.integers(0, len(whole))), data.draw(st.integers(0, 4000))
    filling = data.draw(st.binary(max_size=300))
    (workshop / "bad.nc").write_bytes(whole[:at] + filling + whole[at + length :])
    taken(read_recording, workshop / "bad.nc")


@examples(60)
@given(
    name=st.sampled_from(("time", *SIGNALS)),
    factor=sizes,
    offset=sizes,
    samples=st.integers(0, 1500),
    row=st.integers(0, 1499),
    value=sizes,
)
def test_what_a_reader_takes_can_be_worked_with(workshop, name, factor, offset, samples, row, value):
    from dataclasses import replace

    good = read_recording(workshop / "good.nc")
    with np.errstate(all="ignore"):
        values = getattr(good, name) * factor + offset
    values[row] = value
    cut = {n: getattr(good, n)[:samples] for n in ("time", *SIGNALS)} | {name: values[:samples]}
    write_recording(workshop / "bad.nc", replace(good, **cut))

    def work() -> None:
        recording = read_recording(workshop / "bad.nc")
        check_bench("bad", {"bad.nc": recording}, ACTUATOR)
        signals = {n: getattr(recording, n)[None] for n in SIGNALS}
        found = reconstruct("weighted", signals, recording.interval, ACTUATOR, {"discard": 0.0})
        assert found.six.shape == (1, 6)

    taken(work)


@examples(150)
@given(content=st.binary(max_size=60) | words.map(str.encode))
def test_a_motion_of_any_bytes_is_taken_or_refused(workshop, content):
    path = workshop / "m.csv"
    path.write_bytes(content)
    if taken(read_command, path, 0.3, 1e-4):
        assert np.all(np.isfinite(read_command(path, 0.3, 1e-4)))


@examples(150)
@given(content=st.binary(max_size=60) | words.map(str.encode) | plain.map(lambda value: json.dumps(value).encode()))
def test_settings_of_any_bytes_are_a_mapping_or_refused(workshop, content):
    path = workshop / "mine.yaml"
    path.write_bytes(content)
    if taken(read_yaml, path):
        assert all(isinstance(key, str) for key in read_yaml(path))


@examples(20)
@given(key=st.sampled_from(sorted(config.compose())), value=plain)
def test_an_experiment_that_sets_a_key_to_anything_is_taken_or_refused(workshop, key, value):
    path = workshop / "mine.yaml"
    path.write_text("# @package _global_\n" + json.dumps({key: value}), encoding="utf-8")
    taken(config.compose, str(path))


@examples(200)
@given(data=st.data(), value=plain)
def test_a_configuration_changed_anywhere_is_taken_or_refused(data, value):
    changed = json.loads(json.dumps(config.compose()))
    node = changed
    while True:
        key = data.draw(st.sampled_from(sorted(node)))
        if isinstance(node[key], dict) and node[key] and data.draw(st.booleans()):
            node = node[key]
        else:
            break
    node[key] = value
    taken(checks.check_configuration, changed)


@examples(40)
@given(key=st.sampled_from(KEYS) | words, value=words)
def test_an_override_of_any_text_is_taken_or_refused(key, value):
    taken(config.compose, "paper", [f"{key}={value}"])


@examples(150)
@given(data=st.data(), value=scalars | st.lists(numbers, max_size=3))
def test_an_identifier_changed_anywhere_is_taken_or_refused(workshop, data, value):
    plain = json.loads((workshop / IDENTIFIER).read_text())
    node = plain
    while isinstance(node, dict | list) and node:
        keys = sorted(node) if isinstance(node, dict) else range(len(node))
        key = data.draw(st.sampled_from(keys))
        above, node = node, node[key]
    above[key] = value
    (workshop / "identifier.json").write_text(json.dumps(plain))
    features = np.array([[ACTUATOR.resistance] * 3 + [ACTUATOR.back_emf] * 3])
    if taken(Identifier.load, workshop):
        assert np.all(np.isfinite(Identifier.load(workshop).predict(features)))


COMMANDS = ("identify", "diagnose", "plan", "simulate")
OPTIONS = (
    "--json",
    "--out",
    "--experiment",
    "--results",
    "--method",
    "--level",
    "--fault",
    "--seed",
    "--twin",
    "--unit",
)
#: what makes a line end before the work, so that many can be tried
NOWHERE = "nowhere.nc"


@examples(150)
@given(
    command=st.sampled_from(COMMANDS),
    more=st.lists(
        st.sampled_from((*OPTIONS, "good.nc", "bench", "--force", "1", "dT=3", "command=sine")) | words, max_size=5
    ),
)
def test_a_line_of_any_words_ends_with_one_line_and_changes_nothing(workshop, command, more):
    before = state(workshop)
    line = (
        [command, NOWHERE, *more]
        if command != "simulate"
        else [command, "good.nc", *(w for w in more if w != "--force")]
    )
    said = say(line)
    helped = said.code == 0 and "usage" in said.printed
    assert helped or (said.code == 2 and len(said.lines) == 1 and said.lines[0].startswith("emafault ")), (line, said)
    assert state(workshop) == before


@examples(200)
@given(text=st.text(string.ascii_letters + "${}\\: \n.", max_size=12))
def test_escaped_text_stays_as_it_is(text):
    from omegaconf import OmegaConf

    assert OmegaConf.to_container(OmegaConf.create({"a": escaped(text)}), resolve=True) == {"a": text}


def test_a_path_of_any_text_is_a_place_or_refused(workshop):
    from emafault.places import kind, refuse_folder, refuse_output

    @examples(200)
    @given(text=st.text(max_size=300))
    def tried(text: str) -> None:
        taken(kind, text)
        taken(refuse_output, text)
        taken(refuse_folder, text)

    before = state(workshop)
    tried()
    assert state(workshop) == before and Path("good.nc").is_file()
