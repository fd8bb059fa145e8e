"""The current reference takes effect later."""

SENTENCE = "the current reference takes effect late"


def delay(p):
    """Delay (s)."""
    return p("delay")
