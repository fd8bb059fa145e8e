"""Magnets lose flux with temperature."""

SENTENCE = "the magnets' flux falls with temperature"


def coefficient(p, rec, j):
    """Factor of k_j."""
    return 1.0 + p("alpha_m") * rec.dT
