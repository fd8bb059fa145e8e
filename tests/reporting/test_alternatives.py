"""What pictures say to who cannot see them: the result, with its numbers."""

import re

import numpy as np
import pytest

from emafault.reporting import diagnosis, errors, evidence, paper, search, style
from emafault.reporting.page import Page


def test_an_alternative_text_is_no_caption_and_a_picture_scrolls_where_the_page_is_narrow():
    page = Page("x")
    with pytest.raises(TypeError):
        page.figure("a", style.plt.figure(), "The caption")
    page.figure("a", style.plt.figure(figsize=(2.0, 1.0)), "The caption", 'rises from 1 to "2"')
    assert 'alt="rises from 1 to &quot;2&quot;" style="--width: 260px"' in page.parts[-1]
    assert 'class="scroll"' in page.parts[-1] and 'tabindex="0"' in page.parts[-1]
    style.plt.close("all")


def test_a_described_form_is_told_by_its_size_before_and_after():
    curve = {"title": "torque: order", "x_label": "angle (rad)", "y_label": "torque (N m)",
             "before": [3.0, -3.0], "after": [0.1, 0.1], "error": [0.2, 0.2]}  # fmt: skip
    assert diagnosis.described_in_words([curve]) == (
        "torque: order: along angle (rad), torque (N m) is 3 without it and 0.1 with it, root mean square; its "
        "standard error is 0.2."
    )


def test_the_quality_is_told_by_what_stands_out():
    cells = [
        [{"text": "2 % clipped", "relative": 1.0, "fault": True}, {"text": "1 V", "relative": 3.0, "fault": False}]
    ]
    said = diagnosis.quality_in_words(["a.nc"], ["current", "voltage"], cells)
    assert "No measurement: a.nc, current: 2 % clipped." in said and "a.nc, voltage: 1 V, 3 times the median" in said
    calm = [[{"text": "1 V", "relative": 1.1, "fault": False}]]
    assert diagnosis.quality_in_words(["a.nc"], ["voltage"], calm).count("none") == 2


def test_the_fault_vector_is_told_with_what_holds_the_truth():
    number = {"value": 0.1, "low": 0.05, "high": 0.15}
    group = {"label": "a.nc\nand 1 more", "before": {"Na": number}, "after": {"Na": number | {"low": 0.09}},
             "truth": {"Na": 0.06, "Nb": 0.0}}  # fmt: skip
    assert diagnosis.faults_in_words([group]) == (
        "a.nc and 1 more, after: Na 0.1 (0.09 to 0.15); intervals that hold the truth: 1 of 1 before, 0 of 1 after."
    )
    assert "truth" not in diagnosis.faults_in_words([group | {"truth": {}}])


def test_errors_and_intervals_are_told():
    error = np.outer([1.0, -1.0, np.nan], np.arange(1.0, 7.0))
    said = errors.errors_in_words(
        {("nine", "network"): error}, {c: 0.5 for c in ("Na", "Nb", "Nc", "xi_x", "xi_y", "dT")}
    )
    assert "nine, network Na 1, Nb 2" in said and "bound Na 0.5" in said
    truth = np.zeros((200, 6))
    low = np.where(np.arange(200)[:, None] % 4 == 0, 0.1, -0.1) + truth
    said = errors.residuals_in_words(truth + 0.2, low, truth + 1.0, truth)
    assert said.startswith("Intervals hold the truth of Na in 75 of 100, mean error 0.2;")


def test_training_and_search_are_told():
    curve = {"train": [1.0, 0.1], "validation": [2.0, 0.25, 0.3], "best_epoch": 1}
    assert search.learning_in_words({"nine, network": [[curve]]}) == (
        "nine, network: validation error from 2 to 0.25 at epoch 1."
    )
    trials = [
        {"number": n, "error": e, "parameters": 10 * n, "pareto": n < 3} for n, e in ((1, 0.2), (2, 0.1), (3, 0.4))
    ]
    said = search.search_in_words(trials, 1)
    assert "of 3 trials is 0.1 with 20 parameters; the chosen one has 0.2 with 10. 2 trials" in said


def test_the_paper_s_figures_are_told():
    said = paper.coefficient_in_words(np.array([0.1, -0.1]), (0.1, 0.02), np.array([True, False]), 0.11)
    assert "median size of 0.1 V s/rad, nominal 0.11; 50% of the samples" in said and "0.02 ohm" in said
    signal = np.zeros((1, 4, 3))
    signal[0, 2] = -5.0, 4.0, 3.0
    assert paper.signal_in_words(signal, ["healthy"], "A") == "Largest of phases a, b, c in A: healthy 5, 4, 3."
    width = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 40.0])
    assert paper.few_rows_in_words(np.full((2, 6), 0.01), width).endswith("Na 0.100, dT 0.000.")


def test_the_check_of_the_evidence_is_told():
    ranks = {"counts": [1, 9, 5], "low": 2, "high": 8, "p": 0.3, "count": 15}
    coverage = {"credibility": [0.5, 0.9], "coverage": [0.6, 0.9], "low": [0.4, 0.8], "high": [0.55, 1.0], "p": 0.2}
    bins = [{"mean": 0.1, "share": 0.12, "band": 0.05}]
    arm = {"nuisance": ranks, "effect": ranks, "coverage": coverage, "inclusion": {"bins": bins}}
    found = dict.fromkeys(evidence.ARMS, arm)
    told = [
        evidence._in_words(found, of)
        for of in (evidence._ranks_in_words, evidence._coverage_in_words, evidence._reliability_in_words)
    ]
    assert "2 of 3 bins of the nuisance's ranks outside the band" in told[0]
    assert re.search(r"at most 0\.1 from the credibility, in the band at 50% of", told[1])
    assert "0.12 on of those at 0.1" in told[2]
