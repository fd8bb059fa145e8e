"""The check of the evidence passes a right model, and fails one with a wrong noise or wrong widths of the priors."""

import numpy as np
import pytest

from emafault import config
from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.diagnosis.evidence import Normal, marginalise
from emafault.diagnosis.model import Unit, Variant
from emafault.diagnosis.sets import REMAINDER_SIZES, WIDTHS, Candidate
from emafault.study.evidence_check import check_draw, check_evidence, run_draws
from emafault.study.evidence_draws import LinearBench, draw_truth, linear_bench
from emafault.study.evidence_posterior import ARMS
from emafault.study.evidence_scores import BINS, coverage, scores, uniform

SAMPLES = 39
SPEC = config.evidence_spec()
ACTUATOR, NOISE = ActuatorParameters(**SPEC["actuator"]), SensorNoise(**SPEC["sensors"])


def small():
    """A linear bench of random columns: four nuisances, three effects, two forms, a remainder of four functions."""
    rng = np.random.default_rng(5)
    units = [Unit(f"effect_{k}", "structural", (), [Variant([])]) for k in range(3)]
    units += [Unit(f"~form_{k}", "form", (), [Variant([])]) for k in range(2)]
    nuisances = [f"n{k}" for k in range(4)]
    names = [*nuisances, *(u.id for u in units), *(f"remainder.torque.0.{k}" for k in range(4))]
    J = rng.standard_normal((60, len(names))) * np.array([2.0] * 4 + [8.0] * 5 + [1.0] * 4)
    normal = Normal(names, J.T @ J, np.zeros(len(names)), 0.0)
    values, vectors = np.linalg.eigh(normal.H)
    mean, sd, fixed = np.zeros(4), np.ones(4), np.zeros(len(names))
    reduced = marginalise(normal, nuisances, mean, sd, fixed)
    candidates = {}
    for k, u in enumerate(units):
        sign = np.array([1 if k % 2 else 0])
        candidates[u.id, 0] = Candidate(np.array([k]), np.zeros(1), np.ones(1), sign, WIDTHS, [u.id])
    units.append(Unit("remainder:torque", "remainder", ("torque",), [Variant([])]))
    left = np.arange(5, 9)
    none = np.zeros(4, int)
    candidates["remainder:torque", 0] = Candidate(left, np.zeros(4), np.ones(4), none, REMAINDER_SIZES, names[-4:])
    root = vectors * np.sqrt(values)
    return LinearBench(normal, root, nuisances, mean, sd, fixed, reduced, units, candidates, {})


@pytest.fixture(scope="module")
def bench():
    return small()


def found(bench, draws=60, **wrong):
    return scores(run_draws([bench], draws, SAMPLES, 3, **wrong), SAMPLES, ARMS)["completed"]


def worst(f):
    return min(f[q]["p"] for q in ("nuisance", "effect", "coverage")), max(abs(z) for z in f["inclusion"]["z"].values())


def test_the_right_model_passes(bench):
    p, z = worst(found(bench))
    assert p > 1e-3 and z < 3.0


def test_a_wrong_noise_fails(bench):
    p, _ = worst(found(bench, 24, noise=2.0))
    assert p < 1e-3


def test_wrong_widths_fail(bench):
    p, _ = worst(found(bench, 60, width=5.0))
    assert p < 1e-3


def test_the_prior_is_that_of_the_search(bench):
    rng = np.random.default_rng(0)
    draws = [draw_truth(bench, rng) for _ in range(2000)]
    listed = np.array([sum(u.startswith("effect") for u in d.units) for d in draws])
    assert np.bincount(listed, minlength=4) / 2000 == pytest.approx([0.40, 0.35, 0.15, 0.10], abs=0.035)
    assert np.mean(["remainder:torque" in d.units for d in draws]) == pytest.approx(0.05, abs=0.02)
    one_sided = np.array([d.deviations[bench.rest[1]] for d in draws if "effect_1" in d.units])
    assert np.all(one_sided > 0.0) and {d.members["effect_1", 0] for d in draws if "effect_1" in d.units} == set(WIDTHS)


def test_statistics_of_what_is_uniform_and_what_is_not():
    rng = np.random.default_rng(1)
    even, narrow = rng.integers(0, 100, 500), rng.integers(30, 70, 500)
    assert uniform(even, 99)["p"] > 0.01 > uniform(narrow, 99)["p"] and len(uniform(even, 99)["counts"]) == BINS
    assert coverage(rng.random(500))["p"] > 0.01 > coverage(rng.random(500) ** 2)["p"]


def test_a_bench_of_the_actuator_gives_the_matrices_that_data_are_drawn_from():
    bench = linear_bench(SPEC["evidence"]["benches"][0], 2, ACTUATOR, NOISE, own_forms=True)
    assert np.allclose(bench.root @ bench.root.T, bench.normal.H) and bench.carrying
    row = check_draw(bench, np.random.default_rng(2), SAMPLES, 1.0, 1.0)
    assert len(row["on"]) == len(row["units"]) and all(0 <= row[a]["nuisance"] <= SAMPLES for a in ARMS)
    calibration = [c for (unit, _), c in bench.candidates.items() if c.hole.size and not unit.startswith("~")]
    assert calibration and all(int(q) in bench.tolerance for c in calibration for q in bench.rest[c.index])


def test_the_page_and_its_scores(tmp_path, monkeypatch):
    monkeypatch.setattr("emafault.study.evidence_check.linear_bench", lambda *_: small())
    spec = SPEC | {"evidence": {"draws": 20, "samples": SAMPLES, "seed": 1, "benches": [1], "recordings": 1}}
    check_evidence(spec, tmp_path / "report.html", tmp_path / "figures", tmp_path / "scores.json")
    text = (tmp_path / "report.html").read_text()
    for name in ("library_ranks", "own_forms_coverage", "library_reliability"):
        assert f'id="{name}"' in text and (tmp_path / "figures" / f"{name}.png").is_file()
    assert '"missed"' in (tmp_path / "scores.json").read_text()
