"""Every experiment composes; what does not fit is refused in one line naming key, value and what is accepted."""

import shutil

import pytest
from omegaconf import OmegaConf

from emafault import config, provenance
from emafault.config import composition, draws, separate
from emafault.errors import InputError
from emafault.paths import CONF


@pytest.mark.parametrize("experiment", config.experiments())
def test_every_experiment_composes(experiment):
    plan = config.plan(experiment)
    assert plan.name == experiment and plan.question
    assert plan.is_study == (len(plan.cases) > 1)
    for case in plan.cases:
        for part in case.parts:
            assert plan.dataset(case.datasets[part], part) == config.dataset_spec(case.config, part)


@pytest.mark.parametrize("group", config.GROUPS)
def test_every_option_of_a_group_composes(group, tmp_path):
    command = tmp_path / "command.csv"
    command.write_text("0 0\n1 0.1\n")
    for path in (CONF / group).glob("*.yaml"):
        extra = [f"command.path={command}"] if path.stem == "file" else []
        chosen = f"{group}=[{path.stem}]" if group == "reconstruction" else f"{group}={path.stem}"
        extra += ["search=none"] if group == "reconstruction" else []
        assert config.compose("paper", [chosen, *extra])


@pytest.mark.parametrize(
    ("overrides", "says"),
    [
        ("faults.dT.hig=90", ("faults.dT.hig", "high", "low")),
        ("faults.dT.high=warm", ("faults.dT.high", "'warm'", "from -200 to 500 (K)")),
        ("faults.dT.low=100", ("faults.dT.high", "70.0", "faults.dT.low = 100")),
        ("command=fast", ("command", "'fast'", "parabolic", "sine")),
        ("command=sine command.frequency=-1", ("command.frequency", "-1", "above 0")),
        ("command=file command.path=nowhere.csv", ("command.path", "nowhere.csv", "existing file")),
        ("reconstruction.weighted.discard=0.9", ("reconstruction.weighted.discard", "0.9", "0.15 s less")),
        ("sampling.runs=1.5", ("sampling.runs", "1.5", "integer")),
        ("sampling.runs=true", ("sampling.runs", "True", "integer")),
        ("actuator.inertia=-1", ("actuator.inertia", "-1", "above 0")),
        ("effects.stribek.a=0.1", ("effects.stribek", "did you mean stribeck")),
        ("effects.stribeck.b=0.1", ("effects.stribeck.b", "a, w_s")),
        ("+new.key=1", ("new", "actuator", "training")),
        ("name=../elsewhere", ("name", "'../elsewhere'", "letters")),
        ("recording.duration=1.00005", ("recording.duration", "1.00005", "whole number")),
        ("faults.dT.high=choice(1,2)", ("faults.dT.high", "sweep", "one value")),
        ("experiment=smoke", ("experiment", "chosen by itself")),
        ("search.space.network.width.low=0", ("search.space.network.width", "0", "from 1 to 256")),
        ("+search.space.network.depth=[1]", ("search.space.network.depth", "activation, coordinates, layers, width")),
        ("unit.spread_of=[stribeck]", ("unit.spread_of", "stribeck", "unit_calibration")),
        ("reconstruction.paper.threshold=-1", ("reconstruction.paper.threshold", "-1", "from 0")),
        ("'", ("overrides", "quotation")),
        ("unlisted=3", ("unlisted", "3", "a list of entries")),
        ("'unlisted=[{place: rotor, form: order}]'", ("unlisted[0].place", "'rotor'", "torque, emf_a")),
        ("'unlisted=[{place: drag, form: lag}]'", ("unlisted[0].form", "'lag'", "order", "in drag")),
        ("'unlisted=[{place: torque, form: bump, depth: 1, centre: 0}]'", ("unlisted[0].width", "missing", "depth")),
        (
            "'unlisted=[{place: torque, form: step_change, jump: a, time: 0}]'",
            ("unlisted[0].jump", "'a'", "a number", "(N m)"),
        ),
        (
            "'unlisted=[{place: emf_a, form: step_change, jump: -1.5, time: 0}]'",
            ("unlisted[0].jump", "-1.5", "from -0.9 to 0.9"),
        ),
        (
            "'unlisted=[{place: drag, form: power, at_100_rad_s: 0.1, exponent: 2, order: 1}]'",
            ("unlisted[0].order", "exponent"),
        ),
        (
            "'unlisted=[{place: drag, form: function, along: angle, from: 0, to: 1, values: [1,2,3,4,5,6]}]'",
            ("unlisted[0].along", "'angle'", "rotor_speed"),
        ),
        (
            "'unlisted=[{place: drag, form: function, along: time, from: 0, to: 1, values: [1, 2]}]'",
            ("unlisted[0].values", "[1, 2]", "a list of 6 numbers"),
        ),
        (
            "'unlisted=[{place: drag, form: function, along: time, from: 2, to: 1, values: [1,2,3,4,5,6]}]'",
            ("unlisted[0].to", "above unlisted[0].from = 2"),
        ),
        (
            "'unlisted=[{place: current_a, form: crosstalk, source: d, gain: 0.1}]'",
            ("unlisted[0].source", "'d'", "a, b, c"),
        ),
        (
            "'unlisted=[{place: current_a, form: drift, at_end: 1, recordings: {one: {end: 1}}}]'",
            ("unlisted[0].recordings.one.end", "at_end"),
        ),
    ],
)
def test_refusals_name_key_value_and_what_is_accepted(overrides, says):
    with pytest.raises(InputError) as refused:
        config.plan("paper", overrides)
    message = str(refused.value)
    assert "\n" not in message
    for word in says:
        assert word in message


def test_unknown_experiment_lists_those_there_are():
    with pytest.raises(InputError, match=r"got 'nothing'.*paper.*smoke"):
        config.plan("nothing")


def _specs(overrides):
    composed = config.compose("paper", overrides)
    return {
        "dataset": config.dataset_spec(composed, "training"),
        "fresh": config.dataset_spec(composed, "fresh"),
        "features": config.reconstruction_spec(composed, "weighted"),
        "network": config.network_spec(composed, "network"),
        "closed_form": config.network_spec(composed, "closed_form"),
        "search": config.search_spec(composed),
        "evaluation": config.evaluation_spec(composed),
    }


@pytest.mark.parametrize(
    ("overrides", "changed"),
    [
        (["network.width=8"], {"network", "search"}),
        (["training.epochs=10"], {"network", "search"}),
        (["evaluation.level=0.8"], {"evaluation"}),
        (["reconstruction.weighted.margin=4"], {"features"}),
        (["command=sine"], {"dataset", "fresh"}),
        (["sampling.fresh=500"], {"fresh"}),
        (["search.workers=4"], set()),
        (["tracking.experiment=other"], set()),
    ],
)
def test_an_override_reaches_only_the_stages_that_read_it(overrides, changed):
    before, after = _specs([]), _specs(overrides)
    assert {stage for stage in before if before[stage] != after[stage]} == changed


def test_specs_are_plain_and_sorted():
    def check(value):
        assert type(value) in (dict, list, str, int, float, bool, type(None))
        if isinstance(value, dict):
            assert list(value) == sorted(value)
        for item in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
            check(item)

    for spec in _specs([]).values():
        check(spec)


def test_magnet_and_load_become_effects_that_an_explicit_effect_overrules():
    composed = config.compose("magnet_smco", ["load=spring", "effects.magnet_temperature.alpha_m=-1e-3"])
    assert config.all_effects(composed) == {"magnet_temperature": {"alpha_m": -1e-3}, "load_spring": {"c": 100.0}}
    assert config.magnet_coefficient(composed) == -1e-3


def test_equal_datasets_are_shared_and_others_are_not():
    (tolerance,) = config.plan("unit_tolerance").cases
    (nine,) = config.plan("nine_tolerance").cases
    assert nine.datasets == {"training": "nine_tolerance", "fresh": "unit_tolerance", "reference": "unit_tolerance"}
    assert tolerance.datasets == {"training": "paper", "fresh": "unit_tolerance", "reference": "unit_tolerance"}
    (own,) = config.plan("paper", "name=mine training.epochs=10").cases
    assert own.path == "mine" and set(own.datasets.values()) == {"paper"}
    (other,) = config.plan("paper", "name=mine command=sine").cases
    assert set(other.datasets.values()) == {"mine"}


def test_an_experiment_can_be_a_file_of_ones_own(tmp_path):
    path = tmp_path / "diagnosed.yaml"
    path.write_text("# @package _global_\neffects:\n  stribeck: {a: 0.01, w_s: 4.0}\n")
    plan = config.plan(str(path), "sampling.runs=100")
    assert plan.name == "diagnosed"
    assert config.all_effects(plan.cases[0].config) == {"stribeck": {"a": 0.01, "w_s": 4.0}}
    path.write_text("# @package _global_\neffects:\n  stribeck: {c: 0.01}\n")
    composition._compose.cache_clear()
    with pytest.raises(InputError, match=r"effects\.stribeck\.c"):
        config.plan(str(path), "sampling.runs=100")


def test_a_digest_follows_the_sources_that_are_run_and_not_their_comments(tmp_path, monkeypatch):
    package = tmp_path / "emafault"
    (package / "part").mkdir(parents=True)
    for name, text in {
        "__init__.py": "",
        "used.py": '"""Docs."""\nfrom .part import inner\n',
        "unused.py": "x = 1\n",
        "part/__init__.py": "",
        "part/inner.py": "y = 1\n",
    }.items():
        (package / name).write_text(text)
    script = tmp_path / "script.py"
    script.write_text("def run():\n    from emafault import used\n")
    monkeypatch.setattr(provenance, "PACKAGE", package)

    def digest():
        provenance.source_digest.cache_clear()
        provenance._read_source.cache_clear()
        return provenance.source_digest(script)

    first = digest()
    (package / "unused.py").write_text("x = 2\n")
    (package / "used.py").write_text('"""Other docs."""\n# a comment\nfrom .part import inner\n')
    assert digest() == first
    for folder in ("a", "z"):  # of scripts, which another working folder has elsewhere
        (tmp_path / folder).mkdir()
        moved = shutil.copy(script, tmp_path / folder / script.name)
        assert provenance.source_digest(moved) == first
    (package / "part" / "inner.py").write_text("y = 2\n")
    assert digest() != first


def test_only_the_papers_recipe_drops_the_start_and_the_bound_drops_what_no_method_uses():
    paper = config.compose("paper", ["reconstruction.weighted.discard=0.1"])
    kept = {name: entry["discard"] for name, entry in paper["reconstruction"].items()}
    assert kept == {"paper": 0.05, "weighted": 0.1, "weighted_floating": 0.0}
    assert config.bound_spec(paper)["discard"] == 0.0


def test_draws_of_blind_cases_share_none(monkeypatch):
    config.check_draws()
    read = draws._withheld_draw
    overlapping = {"brief": {"cases": {"T1": 5}, "first_seed": 30010}}
    monkeypatch.setattr(draws, "_withheld_draw", lambda draw: read(draw) | overlapping.get(draw, {}))
    with pytest.raises(InputError, match="brief and standard share seeds 30010 to 30014 of T1"):
        config.plan()


def test_every_so_many_cases_of_a_draw_are_told():
    told = {rung: config.withheld_spec("standard", rung, 0)["seeds"]["told"] for rung in ("T1", "T7")}
    assert len(told["T7"]) == 0 and len(told["T1"]) == 5


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"draws": 1}, r"evidence.draws: got 1, accepted is an integer from 2"),
        ({"samples": 100}, r"evidence.samples: got 100, accepted is one less than a multiple of 20"),
        ({"benches": [-1]}, r"evidence.benches\[0\]: got -1"),
        ({"benches": []}, r"evidence.benches: got \[\]"),
        ({"sed": 1}, r"evidence.sed.*did you mean seed"),
    ],
)
def test_settings_of_the_check_of_the_evidence_are_checked(wrong, says, tmp_path, monkeypatch):
    read = OmegaConf.load(CONF / "evidence.yaml")
    OmegaConf.save(OmegaConf.merge(read, wrong), tmp_path / "evidence.yaml")
    spec = config.evidence_spec()
    assert spec["evidence"]["draws"] == 500 and set(spec) == {"actuator", "evidence", "sensors"}
    monkeypatch.setattr(separate, "CONF", tmp_path)
    with pytest.raises(InputError, match=says):
        separate.evidence()


def test_a_shifted_variant_is_evaluated_with_the_estimators_of_another():
    plan = config.plan("shift_study")
    base, *shifted = plan.cases
    assert base.learnt == base.path and plan.learnt_from == "as_learnt"
    assert {case.learnt for case in shifted} == {base.path}
    assert "training" in base.parts and not any("training" in case.parts for case in shifted)


@pytest.mark.parametrize("wanted", ["nothing", "friction_doubled"])
def test_estimators_are_those_of_a_variant_that_learns_itself(tmp_path, wanted):
    path = tmp_path / "mine.yaml"
    path.write_text(f"# @package _global_\nvariants:\n  own: []\n  friction_doubled: [learnt_from={wanted}]\n")
    with pytest.raises(InputError, match=f"learnt_from: '{wanted}' is no variant that learns itself, accepted are own"):
        config.plan(str(path))
