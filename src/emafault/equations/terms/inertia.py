"""J of this unit."""

SENTENCE = "the inertia lies outside its tolerance"


def inertia(p):
    """Factor of J."""
    return p("scale")
