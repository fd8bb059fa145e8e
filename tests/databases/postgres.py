"""A PostgreSQL server of Debian's package, started for a test on a free port of this machine and gone with it."""

import contextlib
import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path


def programs() -> Path | None:
    """Folder of ``initdb`` and ``postgres``, the newest there is; None where PostgreSQL is not installed."""
    installed = sorted(Path("/usr/lib/postgresql").glob("*/bin/postgres"), key=lambda p: int(p.parts[-3]))
    found = str(installed[-1]) if installed else shutil.which("postgres")
    return Path(found).parent if found else None


@contextlib.contextmanager
def server() -> Iterator[str]:
    """A fresh server; its address, to which the name of a database is added."""
    folder = programs()
    assert folder is not None, "PostgreSQL is not installed"
    with tempfile.TemporaryDirectory(prefix="pg-") as name, socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
        free.close()
        user = {"user": _unprivileged()} if os.geteuid() == 0 else {}  # PostgreSQL refuses to run as root
        if user:
            os.chown(name, pwd.getpwnam(user["user"]).pw_uid, -1)
        data = f"{name}/data"
        quiet = {"check": True, "stdout": subprocess.DEVNULL, "cwd": name, **user}
        subprocess.run([folder / "initdb", "-D", data, "-U", "postgres", "-A", "trust", "--no-sync"], **quiet)
        options = f"-p {port} -k {name} -c listen_addresses=127.0.0.1 -c fsync=off"
        control = [folder / "pg_ctl", "-D", data, "-w", "-l", f"{name}/log"]
        subprocess.run([*control, "-o", options, "start"], **quiet)
        try:
            yield f"postgresql://postgres@127.0.0.1:{port}"
        finally:
            subprocess.run([*control, "-m", "immediate", "stop"], **quiet)


def _unprivileged() -> str:
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "postgres" if "postgres" in names else "nobody"
