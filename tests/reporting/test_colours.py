"""Colours can be told apart whatever the eye, and text stands out of what it stands on."""

import re
from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text

from emafault.reporting import diagnosis, style
from emafault.reporting.page import STYLE

from .colours import SEEN, apart, contrast

TEXT, LINE = 4.5, 3.0  # least contrasts by WCAG 2.2, 1.4.3 and 1.4.11
LINES = 25.0  # of CIELAB between thin lines that a legend names: an eighth of what lies between blue and yellow


@pytest.mark.parametrize("eye", SEEN)
@pytest.mark.parametrize("colours", [style.PHASE_COLOURS, (style.BEFORE, style.AFTER, style.INK)])
def test_lines_are_told_apart(colours, eye):
    assert all(apart(a, b, eye) > LINES for a, b in combinations(colours, 2))
    assert all(contrast(c, "#fff") > LINE for c in colours)


@pytest.mark.parametrize("eye", SEEN)
def test_reconstructions_differ_to_every_eye(eye):
    assert all(apart(a, b, eye) > 15.0 for a, b in combinations([*style.COLOURS.values(), style.colour("x")], 2))


def test_red_and_green_were_not_told_apart():
    assert apart("#d1495b", "#3d9970", "deuteranopia") < LINES and contrast("#22262b", "#8465a6") < TEXT


def test_figures_have_the_colours_of_the_page():
    sheet = STYLE.read_text()
    light = dict(re.findall(r"--(before|after|ink): (#\w+);", sheet.split("@media")[0]))
    assert light == {"before": style.BEFORE, "after": style.AFTER, "ink": style.INK}


@pytest.mark.parametrize("relative", [0.01, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 4.0, 50.0])
@pytest.mark.parametrize("fault", [True, False])
def test_the_noise_is_legible_on_its_colour(relative, fault):
    cells = [[{"text": "0.1 V", "relative": relative, "fault": fault}]]
    fig = diagnosis.draw_quality(["a.nc"], ["voltage"], cells)
    (image,) = fig.axes[0].images
    (text,) = (t for t in fig.axes[0].texts if isinstance(t, Text))
    assert contrast(text.get_color(), np.asarray(image.get_array())[0, 0]) >= TEXT
    style.plt.close(fig)
