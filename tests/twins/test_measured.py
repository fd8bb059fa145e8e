"""Twins of the measured machines on the sets that travel with the project."""

import gzip
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.twins.library import MEASURED, bench, build_twin, distortions, measured_twins, read_cases
from emafault.twins.measured import MeasuredTwin, mean_variance, smooth_covariance
from emafault.twins.slow_rotation import find_pole_pairs_and_slots

from .laplace import Fit, rms

DATA = Path(__file__).parents[2] / "data" / "measured"
FILES = {
    "dq_machine": ("lea_pmsm_temperature/profile24_first60.csv.gz",),
    "six_step_bus": (
        "bldc_sixstep_esc/f40_merged.csv.gz",
        "bldc_sixstep_esc/f40_esc32_log.csv.gz",
        "bldc_sixstep_esc/f60_kotleta_bench_log.csv.gz",
    ),
    "propeller_sweep": ("bldc_thruststand_sweeps/sweeps.csv.gz",),
    "back_emf": ("bldc_backemf_scope/backemf.npz",),
    "slow_rotation": ("odrive_cogging/cogging_maps.npz", "odrive_cogging/slow_moves.npz"),
    "friction_axis": ("emps/emps_estimation.npz",),
    "induction_currents": ("itsc_induction_motor/currents.npz",),
}
ALL = [(name, file) for name, files in FILES.items() for file in files]


@cache
def twins(name: str, file: str) -> dict[str, MeasuredTwin]:
    return measured_twins(name, DATA / file)


def first(name: str) -> MeasuredTwin:
    return next(iter(twins(name, FILES[name][0]).values()))


@pytest.mark.parametrize(("name", "file"), ALL)
def test_every_twin_keeps_the_protocol(name, file):
    for twin in twins(name, file).values():
        names = [p.name for p in twin.parameters]
        assert len(set(names)) == len(names)
        assert twin.explore and twin.confirm and not set(twin.explore) & set(twin.confirm)
        values = np.array([p.off if p.effect else p.mean for p in twin.parameters])
        points = np.stack([values, values])
        for part in (twin.explore, twin.confirm):
            cells, observed = twin.cells(part), twin.observed(part)
            covariance = twin.covariance(values, part)
            assert len(cells) == observed.size == covariance.shape[0] == twin.predict(points, part).shape[1]
            assert np.isfinite(observed).all() and np.isfinite(twin.predict(points, part)).all()
            assert np.linalg.eigvalsh(covariance).min() > 0
            assert {c.recording for c in cells} == set(part)
            equations = {c.equation for c in cells}
        for hypothesis in twin.hypotheses:
            own = [twin.parameters[names.index(n)] for n in hypothesis.parameters]
            assert own and all(p.effect == hypothesis.effect for p in own)
            for start in hypothesis.starts:
                assert all(p.low <= x <= p.high for p, x in zip(own, start, strict=True))
                assert any(x != p.off for p, x in zip(own, start, strict=True))
        assert equations


@pytest.mark.parametrize(("name", "file"), ALL)
def test_points_are_predicted_one_by_one_as_together(name, file):
    twin = next(iter(twins(name, file).values()))
    rng = np.random.default_rng(3)
    base = np.array([p.mean for p in twin.parameters])
    sd = np.array([p.sd for p in twin.parameters])
    points = np.clip(
        base + 0.2 * sd * rng.standard_normal((4, base.size)),
        [p.low for p in twin.parameters],
        [p.high for p in twin.parameters],
    )
    together = twin.predict(points, twin.explore)
    for point, row in zip(points, together, strict=True):
        np.testing.assert_allclose(twin.predict(point, twin.explore)[0], row, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", MEASURED)
def test_an_effect_put_into_the_statistics_is_recovered(name):
    """Predicted statistics at a known effect, with noise of the twin's own covariance, give its parameters back."""
    twin = first(name)
    rng = np.random.default_rng(11)
    names = [p.name for p in twin.parameters]
    nominal = Fit(twin).values
    tested = 0
    for hypothesis in twin.hypotheses:
        if len(hypothesis.parameters) > 4:
            continue
        truth = nominal.copy()
        own = [names.index(n) for n in hypothesis.parameters]
        truth[own] = hypothesis.starts[-1]
        blocks = {}
        for recording in twin.explore:
            block = twin.blocks[recording]
            noise = np.linalg.cholesky(block.covariance) @ rng.standard_normal(block.observed.size)
            blocks[recording] = type(block)(
                block.cells, twin.predict(truth, (recording,))[0] + noise, block.covariance, block.inputs
            )
        made = MeasuredTwin(**{**vars(twin), "blocks": {**twin.blocks, **blocks}})
        found = Fit(made, (hypothesis.effect,))
        for m in own:
            assert abs(found.values[m] - truth[m]) < 4.5 * found.error[names[m]], (hypothesis.effect, names[m])
        assert found.misfit < found.size + 6 * np.sqrt(2 * found.size), hypothesis.effect
        tested += 1
    assert tested >= 4


def gains(name: str, case: str, arrays, found: tuple[str, ...]) -> tuple[MeasuredTwin, dict[str, float]]:
    """Log evidence that each effect adds to a set of them."""
    twin = build_twin(name, case, arrays)
    base = Fit(twin, found).evidence
    return twin, {
        h.effect: Fit(twin, (*found, h.effect)).evidence - base for h in twin.hypotheses if h.effect not in found
    }


# what each undistorted set is described with, before a distortion comes on top
FOUND = {
    "dq_machine": ("magnet_temperature", "resistance_temperature"),
    "six_step_bus": ("current_gain_first",),
    "propeller_sweep": (),
    "back_emf": ("channel_gain_c",),
    "slow_rotation": ("stator_asymmetry", "stray_field"),
    "friction_axis": ("viscous_asymmetry",),
    "induction_currents": (),
}


@pytest.mark.parametrize("name", MEASURED)
def test_a_distortion_makes_the_evidence_for_its_effect(name):
    cases = read_cases(name, DATA / FILES[name][0])
    case = "ITSC_HLT" if name == "induction_currents" else next(iter(cases))
    _, before = gains(name, case, cases[case], FOUND[name])
    for distortion in distortions(name):
        twin, after = gains(name, case, distortion.apply(cases[case]), FOUND[name])
        equations = {c.equation for part in (twin.explore, twin.confirm) for c in twin.cells(part)}
        assert {e for h in twin.hypotheses for e in h.equations} | equations >= {distortion.equation}
        if distortion.effects:
            rise = {e: gain - max(0.0, before.get(e, 0.0)) for e, gain in after.items()}
            named = max(rise[e] for e in distortion.effects if e in rise)
            assert named > 8, distortion.name
            assert named > 0.9 * max(rise.values()), distortion.name
        else:
            best = max(after, key=after.get)
            found = Fit(twin, (*FOUND[name], best))
            assert found.misfit > 3.0 * found.size, distortion.name


def test_the_best_fit_of_the_early_machine_is_not_the_best_later():
    """Iron loss fits the explored heat-up better than the copper's temperature and then fails on what comes later."""
    twin = first("dq_machine")
    copper, iron = ("magnet_temperature", "resistance_temperature"), ("magnet_temperature", "iron_loss")
    a, b = Fit(twin, copper), Fit(twin, iron)
    assert b.evidence > a.evidence + 10
    assert rms(twin, b.values, twin.confirm) > 2 * rms(twin, a.values, twin.confirm)
    nominal = Fit(twin).values
    assert rms(twin, a.values, twin.confirm) < 0.2 * rms(twin, nominal, twin.confirm)
    assert -0.0015 < a["alpha_m"] < -0.0007 and 0.003 < a["alpha_R"] < 0.006


def test_the_torque_of_the_dq_set_follows_currents_and_not_the_magnet():
    twin = first("dq_machine")
    effects = ("magnet_temperature", "resistance_temperature", "torque_from_map")
    part = (*twin.explore, *twin.confirm)
    with_map, without = Fit(twin, effects, part), Fit(twin, effects[:2], part)
    assert with_map.evidence > without.evidence + 50
    assert abs(with_map["share_map"] - 1) < 0.15


def test_a_probe_of_one_tenth_is_told_from_a_weak_phase():
    twin = first("back_emf")
    gain = Fit(twin, ("channel_gain_c",))
    assert abs(gain["decades_c"] + 1) < 0.01
    assert gain.evidence > Fit(twin, ("phase_gain",)).evidence + 1000
    # a gain of a few per cent is a gain of the phase as well: nothing at open circuit tells which
    small = Fit(twin, ("channel_gain_c", "channel_offset", "shape_5"))
    both = Fit(twin, ("channel_gain_c", "channel_offset", "shape_5", "phase_gain"))
    assert both.evidence < small.evidence + 3


def test_two_instruments_cannot_be_told_apart():
    twin = first("six_step_bus")
    first_, second = (Fit(twin, (e,)).evidence for e in ("current_gain_first", "current_gain_second"))
    base = Fit(twin, ()).evidence
    assert min(first_, second) > base + 80
    assert abs(first_ - second) < 0.15 * (first_ - base)


def test_a_voltage_gain_of_the_sweeps_leaves_no_trace():
    for twin in twins("propeller_sweep", FILES["propeller_sweep"][0]).values():
        base = Fit(twin, ()).evidence
        assert abs(Fit(twin, ("voltage_gain",)).evidence - base) < 1
        assert Fit(twin, ("constant_drop",)).evidence < base + 0.5


def test_the_friction_is_asymmetric_in_its_slope():
    twin = first("friction_axis")
    base = Fit(twin, ()).evidence
    gain = {
        e: Fit(twin, (e,)).evidence - base for e in ("offset", "coulomb_asymmetry", "viscous_asymmetry", "stribeck")
    }
    assert gain["viscous_asymmetry"] > gain["offset"] + 50
    assert gain["offset"] == pytest.approx(gain["coulomb_asymmetry"], abs=0.1)
    assert gain["stribeck"] < 3


def test_pole_pairs_slots_and_the_turned_zero_are_found():
    twin = first("slow_rotation")
    assert "7 pole pairs, 12 slots" in twin.notes[0]
    assert any("turned by 180" in note for note in twin.notes)


@pytest.mark.parametrize("percent", [20, 30, 40])
@pytest.mark.parametrize("phase", "ABC")
def test_the_shorted_phase_is_named(phase, percent):
    twin = twins("induction_currents", FILES["induction_currents"][0])[f"ITSC_{phase}{percent}"]
    evidence = {c: Fit(twin, (f"shorted_turns_{c}",)).evidence for c in "abc"}
    assert max(evidence, key=evidence.get) == phase.lower()


def test_a_repetition_that_contradicts_the_others_shows_on_the_held_out_part():
    """In two of the conditions the second repetition is as balanced as the healthy machine."""
    cases = twins("induction_currents", FILES["induction_currents"][0])
    for case, worse in (("ITSC_B20", True), ("ITSC_B30", False), ("ITSC_A30", False)):
        twin = cases[case]
        effect = f"shorted_turns_{case[5].lower()}"
        nominal = Fit(twin).values
        values = Fit(twin, (effect,)).values
        assert (rms(twin, values, twin.confirm) > rms(twin, nominal, twin.confirm)) == worse


@pytest.mark.parametrize(("name", "file"), ALL)
def test_every_machine_has_recordings_that_could_be_made_next(name, file):
    for twin in twins(name, file).values():
        laboratory = bench(twin)
        menu = laboratory.menu()
        assert len({e.text for e in menu}) == len(menu) >= 2
        values = np.array([p.off if p.effect else p.mean for p in twin.parameters])
        imagined = laboratory.imagine(twin, values, (), menu)
        predicted = [imagined.predict(values[None], [str(n)])[0] for n in range(len(menu))]
        assert np.isfinite(predicted).all()
        np.testing.assert_array_equal(predicted[0], twin.predict(values[None], twin.explore[:1])[0])


def test_moved_probes_tell_a_channels_gain_from_a_phases_k():
    """At open circuit the two leave the same trace; with the probes moved on by one phase they no longer do."""
    twin = first("back_emf")
    names = [p.name for p in twin.parameters]
    off = np.array([p.off if p.effect else p.mean for p in twin.parameters])
    gain, k = off.copy(), off.copy()
    k[names.index("k_c")] = 0.02
    gain[names.index("decades_c")] = np.log10(1.02)
    laboratory = bench(twin)
    menu = laboratory.menu()
    moved = str([e.text for e in menu].index("the same speed with every probe moved on by one phase"))
    imagined = laboratory.imagine(twin, off, (), menu)
    same, apart = (np.ptp(imagined.predict(np.stack([gain, k]), [n]), axis=0).max() for n in ("0", moved))
    assert same < 1e-3 < 0.019 < apart


def test_an_effect_can_be_taken_out_of_the_library():
    twin = first("friction_axis")
    smaller = twin.without("viscous_asymmetry")
    assert {h.effect for h in twin.hypotheses} - {h.effect for h in smaller.hypotheses} == {"viscous_asymmetry"}
    with pytest.raises(InputError, match="not in the library"):
        twin.without("cogging")


def test_the_sequence_of_the_currents_may_turn_the_other_way():
    cases = read_cases("induction_currents", DATA / FILES["induction_currents"][0])
    swapped = {key: values[..., [0, 2, 1]] for key, values in cases["ITSC_B30"].items()}
    twin = build_twin("induction_currents", "swapped", swapped)
    assert twin.notes[0] == "phase sequence A C B"
    evidence = {c: Fit(twin, (f"shorted_turns_{c}",)).evidence for c in "abc"}
    assert max(evidence, key=evidence.get) == "c"


def test_noise_of_a_mean_counts_autocorrelation():
    rng = np.random.default_rng(5)
    white = rng.standard_normal((4000, 200))
    assert mean_variance(white).mean() == pytest.approx(1 / 4000, rel=0.15)
    slow = np.cumsum(rng.standard_normal((4000, 200)) * np.sqrt(1 - 0.99**2), axis=0) * 0
    state = np.zeros(200)
    for k in range(4000):
        state = 0.9 * state + rng.standard_normal(200)
        slow[k] = state
    assert mean_variance(slow).mean() == pytest.approx(1 / (4000 * 0.1**2), rel=0.25)


def test_smooth_covariance_is_a_covariance():
    c = smooth_covariance(np.linspace(0, 1, 30), np.linspace(1, 2, 30), 0.3)
    assert np.linalg.eigvalsh(c).min() > 0
    np.testing.assert_allclose(np.diag(c), np.linspace(1, 2, 30) ** 2)


def _rewrite(source: Path, target: Path, change) -> Path:
    lines = gzip.decompress(source.read_bytes()).decode("utf-8-sig").splitlines()
    target.write_text("\n".join(change(lines)))
    return target


def test_bad_tables_are_refused_in_one_line(tmp_path):
    source = DATA / FILES["dq_machine"][0]
    renamed = _rewrite(source, tmp_path / "a.csv", lambda x: [x[0].replace("u_q", "uq"), *x[1:]])
    with pytest.raises(InputError, match="'u_q' is missing"):
        read_cases("dq_machine", renamed)
    short = _rewrite(source, tmp_path / "b.csv", lambda x: x[:50])
    with pytest.raises(InputError, match="at least 100"):
        read_cases("dq_machine", short)
    hole = _rewrite(
        source, tmp_path / "c.csv", lambda x: [*x[:200], x[200].replace(x[200].split(",")[1], "x", 1), *x[201:]]
    )
    with pytest.raises(InputError, match="row 200"):
        read_cases("dq_machine", hole)
    ragged = _rewrite(source, tmp_path / "d.csv", lambda x: [*x[:10], "1,2", *x[10:]])
    with pytest.raises(InputError, match="line 11"):
        read_cases("dq_machine", ragged)
    with pytest.raises(InputError, match="no known log"):
        read_cases("six_step_bus", source)
    with pytest.raises(InputError, match="'motor' is missing"):
        read_cases("propeller_sweep", source)
    with pytest.raises(InputError, match="no such file"):
        read_cases("dq_machine", tmp_path / "absent.csv")
    with pytest.raises(InputError, match="known are"):
        read_cases("dc_machine", source)
    for error in ("a", "b", "c", "d"):
        with pytest.raises(InputError) as info:
            read_cases("dq_machine", tmp_path / f"{error}.csv")
        assert "\n" not in str(info.value)


def test_bad_arrays_are_refused(tmp_path):
    target = tmp_path / "x.npz"
    (tmp_path / "text.npz").write_text("no zip")
    for name in ("back_emf", "slow_rotation", "friction_axis", "induction_currents"):
        with pytest.raises(InputError, match=r"cannot be read as an \.npz"):
            read_cases(name, tmp_path / "text.npz")
    np.savez(target, t_a=np.arange(300.0), v_a=np.ones((300, 2)))
    with pytest.raises(InputError, match="shape"):
        read_cases("back_emf", target)
    np.savez(target, t=np.arange(3000.0), qm=np.ones(3000), vir=np.ones(3000))
    with pytest.raises(InputError, match="'gtau' is missing"):
        read_cases("friction_axis", target)
    np.savez(target, m=np.r_[np.ones(3000), np.zeros(5192)])
    with pytest.raises(InputError, match="visits 37% of the turn"):
        read_cases("slow_rotation", target)
    values = np.ones((3, 1000, 3))
    values[1, 5, 2] = np.nan
    np.savez(target, ITSC_X=values)
    with pytest.raises(InputError, match="finite"):
        read_cases("induction_currents", target)
    np.savez(target, a=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="cannot be read"):
        read_cases("induction_currents", target)


def test_a_folder_gives_the_files_that_the_twin_reads(tmp_path):
    cases = read_cases("slow_rotation", DATA / "odrive_cogging")
    assert set(cases) == {"cogging_maps", "slow_moves"}
    with pytest.raises(InputError, match="no file that twin"):
        read_cases("friction_axis", tmp_path)
    with pytest.raises(InputError, match="is missing"):
        read_cases("friction_axis", DATA / "odrive_cogging")


def test_a_dead_channel_is_refused(tmp_path):
    values = np.random.default_rng(0).standard_normal((400, 3)) * [1, 1, 0]
    np.savez(tmp_path / "x.npz", t_a=np.arange(400.0), v_a=values)
    with pytest.raises(InputError, match="constant"):
        read_cases("back_emf", tmp_path / "x.npz")


def test_noise_has_neither_poles_nor_slots():
    rng = np.random.default_rng(8)
    assert all(find_pole_pairs_and_slots(rng.standard_normal(128)) == (7, 12) for _ in range(20))


def test_one_recording_leaves_nothing_to_hold_out():
    cases = read_cases("back_emf", DATA / FILES["back_emf"][0])
    case, arrays = next(iter(cases.items()))
    name = next(key for key in arrays if key.startswith("t_"))[2:]
    with pytest.raises(InputError, match="hold out"):
        build_twin("back_emf", case, {key: v for key, v in arrays.items() if key[2:] == name})
