"""How the page says what remains."""

from emafault.equations.page import _left

NOISE = " more than noise, not described further."


def test_what_is_said_of_several_phases_is_said_once():
    said = _left([f"The electrical {j} equation leaves{NOISE}" for j in "abc"] + [f"The torque equation leaves{NOISE}"])
    assert said == [
        f"The electrical equations of phases a, b and c leave{NOISE}",
        f"The torque equation leaves{NOISE}",
    ]


def test_phases_that_differ_keep_their_own_sentences():
    other = " more than noise. In each recording by itself it looks as if the motor cogs, by another amount each time."
    said = _left([f"The electrical a equation leaves{NOISE}", f"The electrical b equation leaves{other}"])
    assert said == [
        f"The electrical equation of phase a leaves{NOISE}",
        f"The electrical equation of phase b leaves{other}",
    ]
