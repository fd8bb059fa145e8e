"""Every number that a page shows has words and a unit."""

from emafault.diagnosis.forms import FORMS
from emafault.effects import EFFECTS
from emafault.equations import words
from emafault.equations.parameters import internal

from .conftest import ACTUATOR, machine_of, recorded


def test_every_parameter_of_the_model_has_words_and_a_unit():
    recordings = {f"{h}.nc": recorded(health=h, seed=k) for k, h in enumerate(("healthy", "seeded", "unknown"))}
    parameters = machine_of(recordings).parameters
    assert len(parameters) > 100
    for name, p in parameters.items():
        if p.secant is None:
            said = words.of_number(name.removesuffix("+"))
            short = name.partition("@")[0].rpartition(".")[2]
            assert said.partition(", ")[0] != short and not said.endswith(f": {short}"), name
            assert "_" not in said.replace("_a", "") and "~" not in said, said
            assert p.units, name
    said = [words.of_number(n) for n, p in parameters.items() if p.secant is None and not n.endswith("+")]
    assert len(set(said)) == len(said)


def test_every_parameter_of_the_catalogue_has_words():
    for effect in EFFECTS.values():
        for short in {*effect.parameters, *(n.removeprefix("log_") for n in internal(effect, ACTUATOR))}:
            assert words.effect_number(effect.id, short) != f"{effect.id.replace('_', ' ')}: {short}"


def test_every_form_has_words():
    assert words.FORMS.keys() == FORMS.keys()


def test_what_stands_on_the_page():
    assert words.of_number("emf.h3") == "harmonic of the back-EMF of order 3"
    assert words.of_number("seeded.Na") == "shorted turns of phase a, share of all, in all seeded recordings"
    assert words.of_number("controller.passing_b_back_in@x.nc") == (
        "commutation time, deviation of phase b: backward, flowing into it, x"
    )
