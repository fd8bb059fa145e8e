"""Supply voltage of this bench."""

SENTENCE = "the supply voltage lies outside its tolerance"


def supply(p):
    """Voltage of the unloaded supply (V)."""
    return p("Vdc")
