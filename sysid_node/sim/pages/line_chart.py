"""Small line charts as SVG text: a signal without and with an effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_WIDTH, _HEIGHT, _GAP = 360.0, 150.0, 30.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 8.0, 22.0, 22.0

#: Colours that differ in lightness too: grey without the effect, blue with it.
_BEFORE, _AFTER = "#9a9a9a", "#1f5fa8"


@dataclass(frozen=True)
class LineChart:
    """One chart: a title with the unit, time (N,) s, the two curves (N,)."""

    title: str
    time: Array
    before: Array
    after: Array


def draw(panels: list[LineChart], label: str) -> str:
    """SVG of the panels side by side; ``label`` is for screen readers."""
    width = len(panels) * _WIDTH + (len(panels) - 1) * _GAP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {_HEIGHT:g}" width="{width:g}" '
        f'height="{_HEIGHT:g}" role="img" aria-label="{label}" font-family="sans-serif" font-size="11" fill="#333">',
        f'<rect width="{width:g}" height="{_HEIGHT:g}" fill="#fff"/>',
    ]
    for i, panel in enumerate(panels):
        parts.append(f'<g transform="translate({i * (_WIDTH + _GAP):g},0)">')
        parts += _panel(panel)
        parts.append("</g>")
    return "\n".join([*parts, "</svg>"]) + "\n"


def _panel(panel: LineChart) -> list[str]:
    low = float(min(panel.before.min(), panel.after.min()))
    high = float(max(panel.before.max(), panel.after.max()))
    if high - low < 1e-9:
        low, high = low - 1.0, high + 1.0
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM
    parts = [f'<text x="{_LEFT:g}" y="14">{panel.title}</text>']
    for value in (low, high):
        y = _level(value, low, high)
        parts.append(f'<line x1="{_LEFT:g}" x2="{right:g}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>')
        parts.append(f'<text x="{_LEFT - 4:g}" y="{y + 4:.1f}" text-anchor="end">{value:.3g}</text>')
    for second in range(0, int(panel.time[-1]) + 1, 2):
        x = _LEFT + (right - _LEFT) * second / panel.time[-1]
        parts.append(f'<text x="{x:.1f}" y="{bottom + 15:g}" text-anchor="middle">{second} s</text>')
    for values, colour, stroke in ((panel.before, _BEFORE, 2.5), (panel.after, _AFTER, 1.3)):
        points = _points(panel.time, values, low, high)
        parts.append(f'<polyline fill="none" stroke="{colour}" stroke-width="{stroke}" points="{points}"/>')
    return parts


def _level(value: float | Array, low: float, high: float) -> float | Array:
    return _HEIGHT - _BOTTOM - (value - low) / (high - low) * (_HEIGHT - _BOTTOM - _TOP)


def _points(time: Array, values: Array, low: float, high: float) -> str:
    """The points of a curve, of every third sample, which is finer than the chart's resolution."""
    x = _LEFT + (_WIDTH - _RIGHT - _LEFT) * time[::3] / time[-1]
    y = np.asarray(_level(values[::3], low, high))
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
