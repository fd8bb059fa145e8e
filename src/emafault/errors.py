"""The one exception that a user's input may raise; the command line turns it into a line and exit code 2."""

LONGEST = 120  # characters of a path or value that a message shows


class InputError(ValueError):
    """Input that cannot be used: the message is one line naming the file, key or value and what is accepted."""


def one_line(text: object) -> str:
    """Text on one line: blanks for what breaks lines, escapes for what a terminal would not print."""
    line = " ".join(str(text).split())
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in line)


def shown(value: object, longest: int = LONGEST) -> str:
    """A path or value as messages show it: on one line, and not at any length."""
    line = one_line(value)
    return line if len(line) <= longest else f"{line[: longest // 2]}...{line[-longest // 4 :]}"
