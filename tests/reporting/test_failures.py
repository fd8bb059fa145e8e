"""The line of a job that Slurm ended at its last attempt."""

from types import SimpleNamespace

import pytest

from emafault.errors import InputError
from emafault.reporting import failures

STATUS = "    message: SLURM-job '6' failed, SLURM status is: '{}'. Detailed failure reason unavailable\n"


def _job(rule="simulate_shard", jobid="0", **more):
    made = SimpleNamespace(rule=SimpleNamespace(name=rule), output=[f"{rule}.nc"])
    resources = {"mem_mb": 120, "runtime": 40}
    own = {"jobid": jobid, "attempt": 2, "resources": resources, "is_group": lambda: False, **vars(made)}
    return SimpleNamespace(**{**own, **more})


def _said(log, jobid="0", numbers=("5", "6")):
    return "".join(f"Job {jobid} has been submitted with SLURM jobid {n} (log: {log}).\n" for n in numbers)


@pytest.mark.parametrize(
    ("log", "state", "reason"),
    [
        ("slurmstepd: error: StepId=6.batch exceeded memory limit (2 > 1), being killed", "FAILED", "memory at 120 MB"),
        ("slurmstepd: error: Detected 1 oom_kill event in StepId=6.0.", "OUT_OF_MEMORY", "memory at 120 MB"),
        ("*** JOB 6 ON n1 CANCELLED AT 2026-11-26T10:31:39 DUE TO TIME LIMIT ***", "TIMEOUT", "time limit at 40 min"),
        (None, "TIMEOUT", "time limit at 40 min"),
        (None, "NODE_FAIL", "node failure"),
        ("*** JOB 6 ON n1 CANCELLED AT 2026-11-26T10:31:39 ***", "CANCELLED", "cancelled"),
        (
            "*** JOB 6 ON n1 CANCELLED AT 2026-11-26T10:31:39 DUE TO JOB REQUEUE ***",
            "FAILED",
            "failed as Slurm's job 6",
        ),
        ("emafault: a.nc: cannot be written (No space left)", "FAILED", "a.nc: cannot be written (No space left)"),
        ("Segmentation fault", "FAILED", "failed as Slurm's job 6"),
    ],
)
def test_rule_and_reason_are_named(tmp_path, log, state, reason):
    file = tmp_path / "6.log"
    if log:
        file.write_text(log + "\n")
    [line] = failures.lines([_job()], _said(file) + STATUS.format(state))
    assert line.startswith("emafault: simulate_shard: ") and f"{reason}, after 2 attempts" in line
    assert "simulate_shard.nc" in line and "\n" not in line


def test_a_refusal_is_told_as_sbatch_told_it(tmp_path):
    refused = (
        "Error in rule simulate_shard:\n"
        "    message: SLURM sbatch failed. The error message was 'sbatch: error: Memory specification can not be "
        "satisfied\nsbatch: error: Batch job submission failed: Requested node configuration is not available'.\n"
        "    sbatch call:\n        sbatch --parsable\n"
    )
    [line] = failures.lines([_job()], _said(tmp_path / "5.log", numbers=("5",)) + refused)
    assert "refused by Slurm (Memory specification can not be satisfied Batch job submission failed" in line


def test_a_group_names_its_rules(tmp_path):
    members = [_job("simulate_shard"), _job("reconstruct_features"), _job("simulate_shard")]
    group = SimpleNamespace(jobid="a-b", attempt=2, resources={"runtime": 80}, is_group=lambda: True, jobs=members)
    (tmp_path / "6.log").write_text("DUE TO TIME LIMIT")
    [line] = failures.lines([group], _said(tmp_path / "6.log", "a-b"))
    assert line.startswith("emafault: reconstruct_features, simulate_shard: time limit at 80 min, after 2 attempts")


def test_a_group_that_is_refused_is_not_told_as_it_ended_before(tmp_path):
    group = SimpleNamespace(jobid="a-b", attempt=2, resources={}, is_group=lambda: True, jobs=[_job()])
    (tmp_path / "5.log").write_text("Exceeded job memory limit")
    [line] = failures.lines([group], _said(tmp_path / "5.log", "a-b", numbers=("5",)))
    assert line.startswith("emafault: simulate_shard: refused by Slurm, after 2 attempts")


def test_jobs_that_ran_here_have_said_it_themselves(tmp_path):
    assert failures.lines([_job()], failures.logged([str(tmp_path / "none")])) == []


def test_a_job_is_begun_again_so_often_and_no_more():
    failures.refuse_restart({})
    failures.refuse_restart({"SLURM_RESTART_COUNT": str(failures.RESTARTS)})
    with pytest.raises(InputError, match="begun again by Slurm 4 times"):
        failures.refuse_restart({"SLURM_RESTART_COUNT": str(failures.RESTARTS + 1)})
