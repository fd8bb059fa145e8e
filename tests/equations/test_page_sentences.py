"""How the page says what remains."""

from emafault.equations.sentences import _remainders, finding

NOISE = " more than noise, not described further."


def left(equation, what):
    """An entry of the verdict for what an equation leaves."""
    return {"equation": equation, "sentence": f"The {equation.replace('_', ' ')} equation leaves{what}"}


def test_what_is_said_of_several_phases_is_said_once():
    said = _remainders([*(left(f"electrical_{j}", NOISE) for j in "abc"), left("torque", NOISE)])
    assert said == [
        f"The electrical equations of phases a, b and c leave{NOISE}",
        f"The torque equation leaves{NOISE}",
    ]


def test_phases_that_differ_keep_their_own_sentences():
    other = " more than noise. In each recording by itself it looks as if the motor cogs, by another amount each time."
    said = _remainders([left("electrical_a", NOISE), left("electrical_b", other)])
    assert said == [
        f"The electrical equation of phase a leaves{NOISE}",
        f"The electrical equation of phase b leaves{other}",
    ]


def test_what_is_unknown_is_placed_and_what_may_be_it_is_said():
    verdict = {
        "verdict": "unknown", "discovered": [], "groups": [], "controller": {}, "shrinks": {"signal": None},
        "which": [
            {"effects": ["unknown"], "equation": "electrical_a", "probability": 0.672},
            {"effects": ["voltage_gain"], "probability": 0.139},
            {"effects": [], "probability": 0.1},
        ],
        "inclusion": {"contact_resistance": 0.08, "voltage_gain": 0.139, "remainder:electrical_a": 0.4},
    }  # fmt: skip
    assert finding(verdict) == [
        "Recordings and model differ in the electrical equation of phase a; no listed effect reaches a probability of "
        "0.9 (voltage gain 0.14, none of them 0.77)."
    ]
    verdict["inclusion"] = {}
    assert finding(verdict)[0].endswith("of 0.9 (none of them 0.77).")
