"""Addresses of databases, and a lock that holds while one is created: libraries break when several do that at once."""

import contextlib
import fcntl
from collections.abc import Iterator
from pathlib import Path

SQLITE = "sqlite:///"
_POSTGRESQL = "postgresql://"
_KEY = 0x656D61  # of the advisory lock; any number that is always the same


def with_driver(address: str) -> str:
    """The address with the driver that the extra ``postgres`` installs, where it names none."""
    return address.replace(_POSTGRESQL, "postgresql+psycopg://", 1) if address.startswith(_POSTGRESQL) else address


def without_password(address: str) -> str:
    """The address as messages may show it."""
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        return make_url(address).render_as_string(hide_password=True)
    except (ArgumentError, ValueError):
        return address


@contextlib.contextmanager
def locked(address: str) -> Iterator[None]:
    """Keep other processes from creating or migrating the same database: SQLite by a lock file beside it, PostgreSQL by
    an advisory lock. A killed process leaves no lock behind. Of other databases nothing is locked.

    Raises
    ------
    OSError, sqlalchemy.exc.SQLAlchemyError, ImportError : the database cannot be reached
    """
    if address.startswith(SQLITE):
        path = Path(address.removeprefix(SQLITE))
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path.with_name(f".{path.name}.lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield
    elif address.startswith("postgresql"):
        import sqlalchemy

        engine = sqlalchemy.create_engine(with_driver(address), poolclass=sqlalchemy.NullPool)
        with engine.connect() as connection:
            connection.execute(sqlalchemy.text(f"select pg_advisory_lock({_KEY})"))
            yield
    else:
        yield
