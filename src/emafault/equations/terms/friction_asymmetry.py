"""The dry friction differs between the directions: T_c times 1 + a sign(w)."""

SENTENCE = "the dry friction differs between the directions"


def friction(p, rec):
    """Factor of T_c."""
    return 1.0 + p("a") * rec.direction
