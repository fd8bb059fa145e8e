"""Comparing reports: the page names the variant that identifies best."""

import html
import json
import re

import pytest

from emafault.study.report import compare_variants


def _metrics(path, closed_form, network, bound, of="floating"):
    outputs = ("N", "xi", "dT")
    results = [
        {
            "method": "weighted", "estimator": estimator, "bound": of, "unidentified": 3,
            "all": {f"errors.{o}.mae": {"mean": error} for o in outputs}
            | {f"errors.{o}.ratio": {"mean": error / bound} for o in outputs} | {"coverage.mean": {"mean": 0.87}},
        }
        for estimator, error in (("closed_form", closed_form), ("network", network))
    ]  # fmt: skip
    bounds = {"floating": dict.fromkeys(outputs, 2.0 * bound)} | {of: dict.fromkeys(outputs, bound)}
    path.write_text(json.dumps({"results": results, "level": 0.9, "bound": bounds}))
    return str(path)


@pytest.mark.parametrize(
    ("bounds", "says"),
    [
        ((0.3, 0.1, 0.2), "of any estimator. N: sine (0.10000; the bound is lowest for sine, 0.10000)"),
        ((0.1, 0.1, 0.1), "of any network, all being evaluated on the same recordings. N: runs 3 (0.20000; the first "),
    ],
)
def test_the_best_variant_is_named(tmp_path, bounds, says):
    same = len(set(bounds)) == 1
    networks = (0.4, 0.205, 0.2) if same else [1.2 * bound for bound in bounds]
    files = [_metrics(tmp_path / f"{n}.json", b, e, b) for n, (b, e) in enumerate(zip(bounds, networks))]
    names = ["runs_1", "runs_2", "runs_3"] if same else ["ramp", "sine", "chirp"]
    compare_variants("study", "Which?", names, files, tmp_path / "report.html", tmp_path / "figures")
    text = (tmp_path / "report.html").read_text()
    assert says in text
    (said,) = re.findall(r'<img alt="(.*?)"', text)
    assert says in html.unescape(said)
    assert not same or "the first within 5 % of it is runs 2, 0.20500" in text


def test_nine_features_stand_beside_the_bound_of_the_recordings(tmp_path):
    files = [_metrics(tmp_path / f"{n}.json", b, b, b, "recording") for n, b in enumerate((0.3, 0.1))]
    compare_variants("study", "Which?", ["ramp", "sine"], files, tmp_path / "report.html", tmp_path / "figures")
    assert "the bound is lowest for sine, 0.10000" in (tmp_path / "report.html").read_text()


def test_what_a_shift_moves_is_marked(tmp_path):
    files = [_metrics(tmp_path / f"{n}.json", c, 1.1 * b, b) for n, (c, b) in enumerate(((0.1, 0.1), (0.3, 0.2)))]
    names = ["as_learnt", "friction_doubled"]
    compare_variants("study", "Which?", names, files, tmp_path / "report.html", tmp_path / "figures", "as_learnt")
    text = (tmp_path / "report.html").read_text()
    assert text.count("1.50 ▲") == 3 and "1.10 ▲" not in text  # of N, xi and dT: the closed form, not the network
    assert "under friction_doubled (1.5 times)" in text and "0.870 (3)" in text
