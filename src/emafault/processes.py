"""Processes: which one is at work on something, whether it still is, and children that end with their parent."""

import ctypes
import os
import signal
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def this_process() -> list:
    """Host, number and start of this process, which tell it from every other, a later one of the same number too."""
    return [socket.gethostname(), os.getpid(), started(os.getpid())]


def started(pid: int) -> str | None:
    """When a process of this host started, ``alive`` where the system does not show it; None if it is gone."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    except (ProcessLookupError, FileNotFoundError):
        return None if Path("/proc/self/stat").exists() else "alive"
    except OSError:
        return "alive"


def still_there(process: Sequence) -> bool | None:
    """Whether what ``this_process`` gave is still running; None of another host, where that cannot be asked."""
    host, pid, start = process
    return started(pid) == start if host == socket.gethostname() else None


def end_with(parent: int) -> None:
    """Let the kernel kill this process when ``parent``, which forked it, ends, however that ends; Linux only."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before that was asked for
            os._exit(1)
