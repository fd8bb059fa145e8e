"""Why Slurm ended a job for good, in a line that names its rule."""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import InputError, one_line, shown

#: how often Slurm may begin a job again, which takes no attempt
RESTARTS = 3
#: what Slurm writes into the log of a job that it ends, and what that means
_SAID = {
    r"oom[-_ ]kill|exceeded (job |step )?memory limit|Exceeded job memory": "out of memory",
    r"DUE TO TIME LIMIT": "time limit",
    r"DUE TO NODE FAILURE": "node failure",
    r"DUE TO PREEMPTION": "preempted",
    r"JOB \S+ ON \S+ CANCELLED AT (?!.*DUE TO JOB REQUEUE)": "cancelled",
}
_STATES = {
    "TIMEOUT": "time limit",
    "DEADLINE": "deadline",
    "OUT_OF_MEMORY": "out of memory",
    "NODE_FAIL": "node failure",
    "BOOT_FAIL": "node failure",
    "CANCELLED": "cancelled",
}
#: the resource that a job had too little of, and its unit
_SHORT_OF = {"out of memory": ("mem_mb", "MB"), "time limit": ("runtime", "min")}


def lines(jobs: Iterable[Any], said: str) -> list[str]:
    """A line for each of Snakemake's jobs that failed at its last attempt on Slurm, from what was logged of all.

    Jobs that ran here have said why themselves.
    """
    return [line for job in sorted(jobs, key=lambda job: str(job.jobid)) for line in _line(job, said)]


def refuse_restart(environment: Mapping[str, str]) -> None:
    """Refuse a job that Slurm has begun again too often: what kills it each time, its node or itself, is not told to
    Snakemake, whose next attempt asks for more.

    Raises
    ------
    InputError : saying how often
    """
    restarts = environment.get("SLURM_RESTART_COUNT", "")
    if restarts.isdecimal() and int(restarts) > RESTARTS:
        raise InputError(f"begun again by Slurm {restarts} times")


def logged(files: Iterable[str]) -> str:
    """What Snakemake's log files say."""
    texts = []
    for file in files:
        with suppress(OSError):
            texts.append(Path(file).read_text(errors="replace"))
    return "\n".join(texts)


def _line(job: Any, said: str) -> list[str]:
    submitted = re.findall(rf"^Job {job.jobid} has been submitted with SLURM jobid (\S+) \(log: (.*)\)\.$", said, re.M)
    # what sbatch says of a group Snakemake does not pass on
    refused = len(submitted) < job.attempt and ("SLURM" if job.is_group() else "SLURM sbatch failed") in said
    if not submitted and not refused:
        return []
    number, log = submitted[-1] if submitted else ("", "")
    reason = _refusal(said) if refused else _reason(number, log, said)
    if reason in _SHORT_OF:
        resource, unit = _SHORT_OF[reason]
        reason += f" at {job.resources.get(resource)} {unit}"
    attempts = f"{job.attempt} attempt{'s' if job.attempt > 1 else ''}"
    members = list(job.jobs) if job.is_group() else [job]
    names = ", ".join(sorted({member.rule.name for member in members}))
    made = ", ".join(sorted(str(path) for member in members for path in member.output))
    where = "; ".join([shown(made), *([log] if log else [])])
    return [f"emafault: {names}: {reason}, after {attempts} ({where})"]


def _reason(number: str, log: str, said: str) -> str:
    """Why a job of Slurm ended: its log tells more than its state, which is FAILED where only a step was killed."""
    text = ""
    with suppress(OSError):
        text = Path(log).read_text(errors="replace")
    for pattern, meaning in _SAID.items():
        if re.search(pattern, text):
            return meaning
    state = re.findall(rf"SLURM-job '{re.escape(number)}' failed, SLURM status is: '(\w+)'", said)
    own = re.findall(r"^emafault: (.*)$", text, re.M)
    if state and state[-1] in _STATES:
        return _STATES[state[-1]]
    return shown(own[-1]) if own else f"failed as Slurm's job {number}"


def _refusal(said: str) -> str:
    """What sbatch said of a job that no node can take."""
    told = re.findall(r"The error message was '(.*?)'\.?$", said, re.M | re.S)
    text = re.sub(r"sbatch: error: ", "", told[-1]) if told else ""
    return f"refused by Slurm ({one_line(text)})" if text else "refused by Slurm"
