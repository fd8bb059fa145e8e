"""Figures for a notebook: taken out of pyplot, so that they are shown once, where they are returned."""

import base64
import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def alone(figure: "Figure") -> "Figure":
    """The figure, closed in pyplot, which would show it a second time and keep it."""
    import matplotlib.pyplot as plt

    plt.close(figure)
    return figure


def as_html(figure: "Figure", text: str) -> str:
    """An image that needs no other file; ``text`` is what it says in words."""
    import html

    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{html.escape(text)}" style="max-width:100%" src="data:image/png;base64,{data}">'
