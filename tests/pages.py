"""Pages of the documentation as sessions: their blocks run, and what they show compared with what is printed."""

import contextlib
import io
import re
import runpy
import shlex
from dataclasses import dataclass

import pytest

from emafault.cli import main

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]*\w)")


@dataclass
class Block:
    """A fenced block of a page: its language, its text and, of commands, what they printed and the last exit code."""

    language: str
    text: str
    printed: str = ""
    code: int = 0


def blocks(page: str) -> list[Block]:
    """Fenced blocks of a page in order."""
    return [Block(*found) for found in re.findall(r"^```(\w+)\n(.*?)^```$", page, re.M | re.S)]


def run(line: str) -> tuple[int, str]:
    """Exit code of a command, ``emafault ...`` or ``python FILE``, and what it printed."""
    printed = io.StringIO()
    program, *words = shlex.split(line)
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        if program == "python":
            runpy.run_path(words[0], run_name="__main__")
            return 0, printed.getvalue()
        assert program == "emafault", line
        return main(words), printed.getvalue()


def shown(text: str, printed: str) -> str:
    """The first line of ``text`` that is not among the printed ones, in this order; empty where all are.

    Numbers may differ by rounding; ``...`` stands for anything, on a line of its own for lines.
    """
    rest = iter(printed.splitlines())
    for line in text.splitlines():
        if line != "..." and not any(_alike(line, other) for other in rest):
            return line
    return ""


def _alike(shown: str, printed: str) -> bool:
    line = " ".join(shown.split())
    pattern = re.escape(NUMBER.sub("\0", line)).replace(re.escape("..."), ".*")
    found = re.fullmatch(pattern.replace(re.escape("\0"), f"({NUMBER.pattern})"), " ".join(printed.split()))
    numbers = [float(x) for x in NUMBER.findall(line)]
    return found is not None and [float(x) for x in found.groups()] == pytest.approx(numbers, rel=0.05, abs=2e-4)
