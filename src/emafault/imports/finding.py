"""What is found from the data: what it is taken for, the next best reading, and by how much that one is worse."""

from dataclasses import dataclass

from ..errors import InputError

LEAST_MARGIN = 3.0  # times the misfit; a smaller one is refused


@dataclass(frozen=True)
class Finding:
    """One decision. ``margin``: misfit (mean square) of the ``other`` reading over that of the one ``taken``;
    ``changed``: signals were changed by it.
    """

    what: str
    taken: str
    margin: float
    other: str
    changed: bool = False

    def text(self) -> str:
        """In one line."""
        return f"{self.what}: {self.taken} (margin {self.margin:.3g} over {self.other})"


def decided(finding: Finding, remedy: str) -> Finding:
    """The finding, if its margin is large enough.

    Raises
    ------
    InputError : naming both readings and what to do
    """
    if not finding.margin >= LEAST_MARGIN:
        raise InputError(
            f"{finding.what}: {finding.taken} fits only {finding.margin:.2g} times better than {finding.other}, "
            f"{LEAST_MARGIN:g} times are needed; {remedy}"
        )
    return finding
