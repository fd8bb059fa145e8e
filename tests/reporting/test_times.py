"""The page of where time and memory went."""

from emafault.reporting import times

HEAD = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


def test_jobs_are_summed_by_rule_the_longest_first(tmp_path):
    measured = {
        "paper/train_weighted_network": "12.5\t0:00:12\t250.0\t1\t1\t1\t0.5\t3\t90\t11.0\n",
        "paper/train_paper_network": "7.5\t0:00:07\t300.0\t1\t1\t1\t0.5\t3\t90\t7.0\n",
        "compile_simulation": "3.0\t0:00:03\t-\t-\t-\t-\t-\t-\t0\t0\n",  # too short to be looked at
        "broken": "not\ta\tmeasurement\n",
    }
    for name, line in measured.items():
        path = tmp_path / f"{name}.tsv"
        path.parent.mkdir(exist_ok=True)
        path.write_text(HEAD + line)
    times.write(tmp_path)
    page = (tmp_path / times.PAGE).read_text()
    assert "train (2)</td><td>20.0</td><td>18.0</td><td>300</td><td>1</td><td>6" in page
    assert page.index("train (2)") < page.index("compile (1)") and "broken" not in page


def test_without_measurements_there_is_no_page(tmp_path):
    times.write(tmp_path / "none")
    assert not (tmp_path / "none").exists()
