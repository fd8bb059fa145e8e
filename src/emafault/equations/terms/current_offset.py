"""Offset of a phase's current sensor, seen by the regulator too."""

SENTENCE = "the current sensors have an offset"


def current(p, j, i):
    """True current (A) from the recorded one."""
    return i - p("o_" + "abc"[j])
