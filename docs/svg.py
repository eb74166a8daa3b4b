"""Small charts and box drawings as SVG, on a light card so that they are legible on light and dark pages."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

INK, MUTED, GRID = "#1f2933", "#5f6b7a", "#e3e7ec"
BLUE, ORANGE, GREEN, GREY = "#0b6fb3", "#c8641b", "#2d7d46", "#9aa4b1"


def document(width: float, height: float, label: str, parts: Sequence[str]) -> str:
    """The whole file; ``label`` is what a screen reader says."""
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
            f'height="{height:g}" role="img" aria-label="{escape(label)}" font-family="sans-serif" font-size="13">',
            f'<rect width="{width:g}" height="{height:g}" rx="8" fill="#fff"/>',
            *parts,
            "</svg>\n",
        ]
    )


def text(
    x: float, y: float, words: str, size: float = 13, colour: str = INK, anchor: str = "start", **more: str
) -> str:
    """Words at a place; ``more`` are further attributes."""
    attributes = "".join(f' {key.replace("_", "-")}="{value}"' for key, value in more.items())
    place = f'x="{x:.1f}" y="{y:.1f}" font-size="{size:g}"'
    return f'<text {place} fill="{colour}" text-anchor="{anchor}"{attributes}>{escape(words)}</text>'


def box(
    x: float, y: float, width: float, height: float, title: str, lines: Sequence[str] = (), fill: str = "#eaf2f9"
) -> str:
    """A box with a title and smaller lines beneath it."""
    parts = [
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="6" fill="{fill}" stroke="{GREY}"/>',
        text(x + 10, y + 20, title, 13, INK, font_weight="bold"),
    ]
    parts += [text(x + 10, y + 38 + 16 * i, line, 12, MUTED) for i, line in enumerate(lines)]
    return "\n".join(parts)


def arrow(x1: float, y1: float, x2: float, y2: float, label: str = "") -> str:
    """A line from one place to another with a head at its end, and words beside its middle."""
    length = max(((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5, 1e-9)
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    head = [(x2, y2), (x2 - 9 * ux - 4 * uy, y2 - 9 * uy + 4 * ux), (x2 - 9 * ux + 4 * uy, y2 - 9 * uy - 4 * ux)]
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in head)
    parts = [
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2 - 6 * ux:.1f}" y2="{y2 - 6 * uy:.1f}" stroke="{MUTED}" '
        'stroke-width="1.5"/>',
        f'<polygon points="{points}" fill="{MUTED}"/>',
    ]
    if label:
        parts.append(text((x1 + x2) / 2 + 6, (y1 + y2) / 2 + 4, label, 11, MUTED))
    return "\n".join(parts)


class Chart:
    """One panel with linear axes: draw into it, then ask for ``parts``."""

    def __init__(
        self, place: tuple[float, float, float, float], x: tuple[float, float], y: tuple[float, float]
    ) -> None:
        self.left, self.top, self.width, self.height = place
        self.x, self.y = x, y
        self.parts: list[str] = []

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Pixels of a point."""
        return (
            self.left + self.width * (x - self.x[0]) / (self.x[1] - self.x[0]),
            self.top + self.height * (self.y[1] - y) / (self.y[1] - self.y[0]),
        )

    def frame(self, title: str, x_label: str, x_ticks: Sequence[float], y_ticks: Sequence[float]) -> None:
        """Grid, numbers and names of the axes."""
        self.parts.append(text(self.left, self.top - 10, title, 13, INK, font_weight="bold"))
        for tick in y_ticks:
            x, y = self.at(self.x[0], tick)
            self.parts.append(
                f'<line x1="{x:.1f}" x2="{x + self.width:.1f}" y1="{y:.1f}" y2="{y:.1f}" stroke="{GRID}"/>'
            )
            self.parts.append(text(x - 6, y + 4, f"{tick:g}", 11, MUTED, "end"))
        for tick in x_ticks:
            x, y = self.at(tick, self.y[0])
            self.parts.append(text(x, y + 16, f"{tick:g}", 11, MUTED, "middle"))
        self.parts.append(text(self.left + self.width, self.top + self.height + 32, x_label, 11, MUTED, "end"))

    def line(self, xs: Sequence[float], ys: Sequence[float], colour: str, width: float = 1.6, dash: str = "") -> None:
        """A curve."""
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in (self.at(x, y) for x, y in zip(xs, ys, strict=True)))
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(f'<polyline fill="none" stroke="{colour}" stroke-width="{width}"{dashes} points="{points}"/>')

    def dot(self, x: float, y: float, colour: str, radius: float = 3.0) -> None:
        """A point."""
        a, b = self.at(x, y)
        self.parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius:g}" fill="{colour}"/>')

    def bar(self, x: float, width: float, y: float, colour: str) -> None:
        """A bar from zero to ``y``, its middle at ``x``."""
        (a, top), (b, bottom) = self.at(x - width / 2, max(y, 0.0)), self.at(x + width / 2, min(y, 0.0))
        size = f'width="{b - a:.1f}" height="{max(bottom - top, 0.5):.1f}"'
        self.parts.append(f'<rect x="{a:.1f}" y="{top:.1f}" {size} fill="{colour}"/>')


def legend(x: float, y: float, entries: Sequence[tuple[str, str]]) -> str:
    """Coloured marks with words, in a row; an entry is (colour, words)."""
    parts = []
    for colour, words in entries:
        parts.append(f'<rect x="{x:.1f}" y="{y - 8:.1f}" width="16" height="5" fill="{colour}"/>')
        parts.append(text(x + 22, y, words, 12, MUTED))
        x += 40 + 6.6 * len(words)
    return "\n".join(parts)
