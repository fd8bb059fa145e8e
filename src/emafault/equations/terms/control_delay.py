"""The current reference takes effect later."""

SENTENCE = "the current reference takes effect late, or through a filter"


def delay(p):
    """Delay (s)."""
    return p("delay")
