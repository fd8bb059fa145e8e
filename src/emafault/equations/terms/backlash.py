"""Play of this unit."""

SENTENCE = "the play lies outside its tolerance"


def play(p):
    """Total play (rad at the output)."""
    return p("blk")
