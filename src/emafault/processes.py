"""Processes: which one is at work on something, whether it still is, and children that end with their parent."""

import ctypes
import hashlib
import os
import signal
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_DIGITS = 9  # of the number of a process, at most


def this_process() -> list:
    """Host, number and start of this process, which tell it from every other, a later one of the same number too."""
    return [socket.gethostname(), os.getpid(), started(os.getpid())]


def started(pid: int) -> str | None:
    """When a process of this host started, ``alive`` where the system does not show it; None if it is gone."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    except ProcessLookupError:
        return None
    except FileNotFoundError:
        return None if Path("/proc/self/stat").exists() else "alive"
    except OSError:
        return "alive"


def still_there(process: Sequence) -> bool | None:
    """Whether what ``this_process`` gave is still running; None of another host, where that cannot be asked."""
    host, pid, start = process
    return started(pid) == start if host == socket.gethostname() else None


def mark() -> str:
    """What ``this_process`` gives as a part of a file's name, with a digest in the place of the host's name."""
    _, pid, start = this_process()
    return f"{pid}-{start}-{_host_digest()}"


def marked_still_there(given: str) -> bool | None:
    """Whether the process whose ``mark`` is given is still running; None of another host, or where it is no mark."""
    pid, _, rest = given.partition("-")
    start, _, host = rest.partition("-")
    known = pid.isascii() and pid.isdigit() and len(pid) <= _DIGITS and host == _host_digest()
    return started(int(pid)) == start if known else None


def _host_digest() -> str:
    return hashlib.sha256(os.fsencode(socket.gethostname())).hexdigest()[:8]


def end_with(parent: int) -> None:
    """Let the kernel kill this process when ``parent``, which forked it, ends, however that ends; Linux only."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before that was asked for
            os._exit(1)
