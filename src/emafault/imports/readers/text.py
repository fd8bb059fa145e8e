"""CSV and TSV, from loggers and oscilloscopes: separator, decimal comma, preamble and units are found."""

import gzip
import re
from pathlib import Path

from ...errors import InputError
from .frame import from_frame, name_and_unit

LOOKED_AT = 200  # lines in which the numbers must have begun
SEPARATORS = (";", "\t", ",", None)  # None: spaces; a semicolon or tab first, for a comma may be decimal
_NUMBER = {
    ".": re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?$|^[-+]?(nan|inf)$|^$", re.IGNORECASE),
    ",": re.compile(r"^[-+]?(\d+,?\d*|,\d+)([eEdD][-+]?\d+)?$|^[-+]?(nan|inf)$|^$", re.IGNORECASE),
}
_STAMP = re.compile(r"^\d{4}-\d\d-\d\d[T ]\d\d:\d\d")


def read(path: Path):
    """Channels of a text file.

    Raises
    ------
    InputError : no table of numbers in the first lines
    """
    import pandas as pd

    encoding = _encoding(path)
    with _opened(path)(path, "rt", encoding=encoding) as file:
        lines = [line.rstrip("\r\n") for _, line in zip(range(LOOKED_AT), file, strict=False)]
    separator, decimal, first = _layout(path, lines)
    cells = [_split(line, separator) for line in lines[:first]]
    # an oscilloscope's header may have columns that its rows leave empty
    width = max(len(row) for row in [_split(lines[first], separator), *[row for row in cells if any(row)][-2:]])
    frame = pd.read_csv(
        path, sep=separator or r"\s+", decimal=decimal, skiprows=first, header=None, encoding=encoding,
        names=range(width), index_col=False, skipinitialspace=True, low_memory=False,
        compression="gzip" if _opened(path) is gzip.open else None,
    )  # fmt: skip
    titles, units = _header(cells, width)
    if "Increment" in titles:  # an oscilloscope that counts samples and gives their step once
        step = float(cells[-1][titles.index("Increment")])
        frame[0], titles[0], units[0] = frame[0] * step, "time", "s"
    names = [f"{title} [{unit}]" if unit else title for title, unit in zip(titles, units)]
    if len(set(names)) < len(names):
        raise InputError(f"{path}: two columns are named '{next(n for n in names if names.count(n) > 1)}'; rename one")
    frame.columns = names
    return from_frame(frame.dropna(axis=1, how="all"))


def _opened(path: Path):
    return gzip.open if path.suffix.lower() == ".gz" else open


def _encoding(path: Path) -> str:
    with _opened(path)(path, "rb") as file:
        content = file.read()
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    try:
        content.decode("utf-8-sig")
        return "utf-8-sig"
    except UnicodeDecodeError:
        return "latin-1"


def _split(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in (line.rstrip(",; \t") if separator else line).split(separator)]


def _layout(path: Path, lines: list[str]) -> tuple[str | None, str, int]:
    """Separator, decimal sign and first line of the numbers: the widest table that reaches the last line looked at."""
    best: tuple[int, int, str | None, str] | None = None
    for separator in SEPARATORS:
        for decimal in (".", ",") if separator != "," else (".",):
            rows = [_split(line, separator) for line in lines if line.strip()]
            width = len(rows[-1]) if rows else 0
            first = len(lines)
            while first and (
                not lines[first - 1].strip() or _numbers(_split(lines[first - 1], separator), width, decimal)
            ):
                first -= 1
            while first < len(lines) and not lines[first].strip():
                first += 1
            if first < len(lines) and width and (best is None or width > best[0]):
                best = width, first, separator, decimal
    if best is None:
        raise InputError(f"{path}: no table of numbers in the first {LOOKED_AT} lines; save it with one header line")
    return best[2], best[3], best[1]


def _numbers(cells: list[str], width: int, decimal: str) -> bool:
    stamped = _STAMP.match(cells[0]) is not None
    return len(cells) == width and any(cells) and all(_NUMBER[decimal].match(c) for c in cells[stamped:])


def _header(cells: list[list[str]], width: int) -> tuple[list[str], list[str]]:
    """Names and units from the lines above the numbers: the last line of their width, or two, of names and units."""
    above = [row for row in cells if any(row)][-2:]
    fitting = [row + [""] * (width - len(row)) for row in above if len(row) <= width and len(row) > width // 2]
    if not fitting:
        return [f"column {k + 1}" for k in range(width)], [""] * width
    if len(fitting) == 2 and _are_units(fitting[1], width):
        return [name_and_unit(t)[0] for t in fitting[0]], [_bare(u) for u in fitting[1]]
    pairs = [name_and_unit(text or f"column {k + 1}") for k, text in enumerate(fitting[-1])]
    return [p[0] for p in pairs], [p[1] for p in pairs]


def _bare(text: str) -> str:
    text = text.strip("()[] ")
    return "" if text.lower() in ("sequence", "-") or _NUMBER["."].match(text) else text


def _are_units(row: list[str], width: int) -> bool:
    """Whether a line under the names holds units: bracketed, or all of them known."""
    from ...units import is_unit

    said = [cell for cell in row if cell]
    return bool(said) and all(cell[0] in "([" or not _bare(cell) or is_unit(_bare(cell)) for cell in said)
