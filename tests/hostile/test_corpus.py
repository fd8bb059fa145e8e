"""Every entry of the corpus: refused in one line that names what is wrong, with nothing changed, or accepted."""

import pytest

from emafault import config
from emafault.config import composition
from emafault.errors import InputError, one_line

from . import calls, experiments, lines, recordings, saved
from .conftest import say, state
from .entries import Entry

CORPUS: dict[str, Entry] = {
    **recordings.ENTRIES,
    **experiments.ENTRIES,
    **lines.ENTRIES,
    **saved.ENTRIES,
}


def test_the_corpus_is_large_enough():
    assert len(CORPUS) + len(calls.CALLS) >= 300


@pytest.mark.parametrize("name", CORPUS)
def test_entry(workshop, name):
    entry = CORPUS[name]
    if entry.prepare:
        entry.prepare(workshop)
    before = state(workshop), state(composition.CONF)
    said = say(list(entry.line))
    if not entry.says:
        assert said.code == 0, said.lines
        return
    assert said.code == 2 and len(said.lines) == 1, said
    assert said.lines[0].startswith(f"emafault {entry.line[0]}: ") and len(said.lines[0]) < 2000
    for word in entry.says:
        assert word in said.lines[0]
    assert (state(workshop), state(composition.CONF)) == before


@pytest.mark.parametrize("name", calls.CALLS)
def test_call_of_the_workflow(workshop, name):
    call, says = calls.CALLS[name]
    with pytest.raises(InputError) as refused:
        config.check_call(call)
        config.plan(call.get("experiment", "paper"), call.get("overrides", ""))
    for word in says:
        assert word in one_line(refused.value)
