"""Cases that are made again: other noise, other recordings, the same unit."""

from emafault.study.stability import replicated
from emafault.withheld.cases import draw_case, in_other_noise, in_other_recordings


def test_a_bench_in_other_noise_is_the_same_bench():
    case = draw_case("T7", 31)
    again = in_other_noise(case, 3)
    assert again.recordings == case.recordings and again.unit() == case.unit() and again.unlisted == case.unlisted
    assert len({in_other_noise(case, n).noise_seed for n in range(20)} | {draw_case("T7", 32).noise_seed}) == 21
    assert in_other_noise(case, 0) == case


def test_a_unit_in_other_recordings_is_the_same_unit():
    case = draw_case("T1", 31)
    other = in_other_recordings(case, 1)
    assert other.unit() == case.unit() and other.recordings != case.recordings
    assert other == in_other_recordings(case, 1) and other.noise_seed != case.noise_seed


def test_what_is_sure_in_one_part_and_not_in_the_other():
    one = {"stribeck": 0.95, "cogging": 0.99, "inertia": 0.5}
    other = {"stribeck": 0.02, "cogging": 0.4, "inertia": 0.97}
    assert replicated(one, other) == (("cogging", "inertia", "stribeck"), ("stribeck",))
