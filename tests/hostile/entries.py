"""What an entry of the corpus is, and how its files are prepared."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Prepare = Callable[[Path], object]


@dataclass(frozen=True)
class Entry:
    """A command line in the workshop, and what its one line of refusal must name; none where it is accepted."""

    line: tuple[str, ...]
    says: tuple[str, ...] = ()
    prepare: Prepare | None = None


def entry(line: str, *says: str, prepare: Prepare | None = None) -> Entry:
    """An entry whose words are apart by blanks."""
    return Entry(tuple(line.split()), says, prepare)


def file(name: str, content: str | bytes) -> Prepare:
    """A file in the workshop."""

    def prepare(folder: Path) -> None:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    return prepare


def json_file(name: str, change: Callable[[Any], object]) -> Prepare:
    """A JSON file of the workshop changed in place."""

    def prepare(folder: Path) -> None:
        plain = json.loads((folder / name).read_text())
        change(plain)
        (folder / name).write_text(json.dumps(plain))

    return prepare
