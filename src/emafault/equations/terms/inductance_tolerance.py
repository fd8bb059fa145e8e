"""L0 of this unit."""

SENTENCE = "the unit's inductance lies outside its tolerance"


def inductance(p, rec, j):
    """Factor of L_j."""
    return p("L_scale")
