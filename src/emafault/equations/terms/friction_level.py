"""T_c of this unit."""

SENTENCE = "the dry friction lies outside its tolerance"


def friction(p, rec):
    """Factor of T_c."""
    return p("scale")
