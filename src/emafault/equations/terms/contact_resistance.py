"""A resistance in series with a phase, which does not heat."""

SENTENCE = "a resistance lies in series with a phase"


def resistance(p, rec, j):
    """Added to R_j (ohm)."""
    return p("R_x_" + "abc"[j])
