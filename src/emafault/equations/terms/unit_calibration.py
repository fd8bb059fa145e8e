"""R0 and k0 of this unit."""

SENTENCE = "the unit's resistance or back-EMF coefficient lies outside its tolerance"


def coefficient(p, rec, j):
    """Factor of k_j."""
    return p("k_scale")


def winding(p, rec, j):
    """Factor of R_j."""
    return p("R_scale")
