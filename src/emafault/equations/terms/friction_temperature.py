"""The dry friction falls with temperature."""

SENTENCE = "the dry friction depends on temperature"


def friction(p, rec):
    """Factor of T_c."""
    return 1.0 + p("beta") * rec.dT
