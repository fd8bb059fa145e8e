"""A self-contained page: headings, paragraphs, tables and figures in one HTML file that needs nothing else."""

import base64
import html
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..io.atomic import replace_atomically, whole_folder, write_text
from . import panels as charts

STYLE = Path(__file__).with_name("page.css")
LONG = 60  # letters of a cell, from which its column is kept wide where the page is narrow
CONTENTS = 3  # headings from which on a page has a bar of contents


class Page:
    """Parts in the order in which they are added; figures are kept as PNG in a folder of their own too, if asked."""

    def __init__(self, title: str, figures: str | Path | None = None) -> None:
        self.title = title
        self.folder = Path(figures) if figures else None
        self.parts: list[str] = [f"<h1>{html.escape(title)}</h1>"]
        self.headings: dict[str, str] = {}  # by id
        self.charts = False
        self.images: dict[str, bytes] = {}  # PNG by file name

    def heading(self, text: str, level: int = 2) -> None:
        """A section's heading; the bar of contents leads to those of level 2."""
        if level != 2:
            self.parts.append(f"<h{level}>{html.escape(text)}</h{level}>")
            return
        name = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
        while name in self.headings:
            name += "-"
        self.headings[name] = text
        self.parts.append(f'<h2 id="{name}">{html.escape(text)}</h2>')

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
        long = [max((len(row[n]) for row in rows if n < len(row)), default=0) > LONG for n in range(len(header))]
        kind = [
            (' class="words long"' if far else " class=words") if words else ""
            for words, far in zip(lettered, long, strict=True)
        ]
        head = "".join(f"<th scope=col{k}>{html.escape(cell)}</th>" for k, cell in zip(kind, header, strict=True))
        lines = []
        for n, row in enumerate(rows):
            cells = "".join(f"<td{k}>{html.escape(cell)}</td>" for k, cell in zip(kind, row, strict=False))
            lines.append(f"<tr{' class=strong' if n in strong else ''}>{cells}</tr>")
        label = html.escape(", ".join(header[:3]))
        body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody>"
        self.parts.append(
            f'<div class="scroll" role="region" aria-label="table: {label}" tabindex="0"><table>{body}</table></div>'
        )

    @contextmanager
    def folded(self, title: str) -> Iterator[None]:
        """What is added within is shown when the reader opens it."""
        self.parts.append(f"<details><summary>{html.escape(title)}</summary>")
        yield
        self.parts.append("</details>")

    def panels(self, panels: Sequence[charts.Panel], key: str = "") -> None:
        """Interactive charts, one an equation, what changes most first, and a table that says the same.

        ``key`` begins their names.
        """
        if not panels:
            return
        panels = sorted(panels, key=charts.change, reverse=True)
        self.table(["equation", "rows", "residual over the noise (rms), before", "after"], charts.table(panels))
        self.parts += [charts.markup(panel, name) for name, panel in charts.numbered(panels, key)]
        self.charts = True

    def figure(self, name: str, drawing, caption: str, result: str) -> None:
        """A matplotlib figure, which is closed afterwards; ``result`` says to who cannot see it what it shows.

        Where the page is narrow it keeps a size at which its text can be read, and scrolls.
        """
        import matplotlib.pyplot as plt

        buffer = io.BytesIO()
        drawing.savefig(buffer, format="png", dpi=130)
        plt.close(drawing)
        data = buffer.getvalue()
        self.images[f"{name}.png"] = data
        image = base64.b64encode(data).decode()
        width = int.from_bytes(data[16:20], "big")  # px, of the PNG's header
        picture = f'<img alt="{html.escape(result)}" style="--width: {width}px" src="data:image/png;base64,{image}">'
        scroll = f'<div class="scroll" role="region" aria-label="figure: {html.escape(name)}" tabindex="0">'
        self.parts.append(
            f'<figure id="{name}">{scroll}{picture}</div><figcaption>{html.escape(caption)}</figcaption></figure>'
        )

    def write(self, path: str | Path) -> None:
        """Write the folder of figures and the page, each whole or not at all.

        Raises
        ------
        InputError : one of them cannot be written
        """
        if self.folder:
            with whole_folder(self.folder) as folder:
                for name, data in self.images.items():
                    replace_atomically(folder / name, lambda path, data=data: path.write_bytes(data))
        style = STYLE.read_text() + (charts.styles() if self.charts else "")
        view = '<meta name="viewport" content="width=device-width, initial-scale=1">'
        head = f'<meta charset="utf-8">{view}<title>{html.escape(self.title)}</title><style>{style}</style>'
        body = (
            f'{self._contents()}<main id="main">{"".join(self.parts)}</main>{charts.scripts() if self.charts else ""}'
        )
        write_text(path, f'<!doctype html><html lang="en"><head>{head}</head><body>{body}</body></html>\n')

    def _contents(self) -> str:
        if len(self.headings) < CONTENTS:
            return ""
        links = "".join(f'<li><a href="#{name}">{html.escape(text)}</a></li>' for name, text in self.headings.items())
        return f'<a class="skip" href="#main">Skip to the content</a><nav aria-label="Contents"><ol>{links}</ol></nav>'
