"""B of this unit."""

SENTENCE = "the viscous friction lies outside its tolerance"


def viscous(p):
    """Factor of B."""
    return p("scale")
