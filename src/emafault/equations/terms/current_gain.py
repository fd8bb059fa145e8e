"""Gain of a phase's current sensor, seen by the regulator too."""

SENTENCE = "the current sensors' gains differ"


def current(p, j, i):
    """True current (A) from the recorded one."""
    return i / p("g_" + "abc"[j])
