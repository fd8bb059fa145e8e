"""A self-contained page: headings, paragraphs, tables and figures in one HTML file that needs nothing else."""

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path

from ..io.atomic import replace_atomically, write_text

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1d1f21; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { font-size: 1.25rem; margin-top: 2.2rem; }
p.lead { font-size: 1.08rem; } p.small, figcaption { color: #555; font-size: .9rem; }
figure { margin: 1.2rem 0; } figure img { max-width: 100%; height: auto; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: .92rem; margin: .8rem 0; }
th, td { padding: .28rem .5rem; text-align: right; border-bottom: 1px solid #e3e3e3; white-space: nowrap; }
th { border-bottom: 2px solid #888; white-space: normal; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; white-space: normal; min-width: 9rem; }
td.words, th.words { text-align: left; } td.words { white-space: normal; max-width: 22rem; }
tr.strong td { font-weight: 600; } pre { background: #f6f6f4; padding: .8rem; overflow-x: auto; font-size: .82rem; }
"""


class Page:
    """Parts in the order in which they are added; figures are kept as PNG beside the page as well, if asked."""

    def __init__(self, title: str, figures: str | Path | None = None) -> None:
        self.title = title
        self.folder = Path(figures) if figures else None
        self.parts: list[str] = [f"<h1>{html.escape(title)}</h1>"]

    def heading(self, text: str) -> None:
        """A section's heading."""
        self.parts.append(f"<h2>{html.escape(text)}</h2>")

    def paragraph(self, text: str, kind: str = "") -> None:
        """Plain text; ``kind`` is ``lead`` or ``small``."""
        self.parts.append(f'<p class="{kind}">{html.escape(text)}</p>')

    def preformatted(self, text: str) -> None:
        """Text as it is, in lines."""
        self.parts.append(f"<pre>{html.escape(text)}</pre>")

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]], strong: Sequence[int] = ()) -> None:
        """A table of texts; rows numbered in ``strong`` are set off, columns of words are set left and wrap."""
        lettered = [
            sum(any(c.isalpha() for c in row[n]) for row in rows if n < len(row)) > 0.5 * len(rows)
            for n in range(len(header))
        ]
        kind = [" class=words" if words else "" for words in lettered]
        head = "".join(f"<th{k}>{html.escape(cell)}</th>" for k, cell in zip(kind, header, strict=True))
        lines = []
        for n, row in enumerate(rows):
            cells = "".join(f"<td{k}>{html.escape(cell)}</td>" for k, cell in zip(kind, row, strict=False))
            lines.append(f"<tr{' class=strong' if n in strong else ''}>{cells}</tr>")
        self.parts.append(f'<div class="scroll"><table><tr>{head}</tr>{"".join(lines)}</table></div>')

    def figure(self, name: str, drawing, caption: str) -> None:
        """A matplotlib figure, which is closed afterwards."""
        import matplotlib.pyplot as plt

        buffer = io.BytesIO()
        drawing.savefig(buffer, format="png", dpi=130)
        plt.close(drawing)
        data = buffer.getvalue()
        if self.folder:
            replace_atomically(self.folder / f"{name}.png", lambda temporary: temporary.write_bytes(data))
        image = base64.b64encode(data).decode()
        text = html.escape(caption)
        picture = f'<img alt="{text}" src="data:image/png;base64,{image}">'
        self.parts.append(f'<figure id="{name}">{picture}<figcaption>{text}</figcaption></figure>')

    def write(self, path: str | Path) -> None:
        """Write the page, whole or not at all.

        Raises
        ------
        InputError : the file cannot be written
        """
        head = f'<meta charset="utf-8"><title>{html.escape(self.title)}</title><style>{_STYLE}</style>'
        text = f'<!doctype html><html lang="en"><head>{head}</head><body>{"".join(self.parts)}</body></html>\n'
        write_text(path, text)
