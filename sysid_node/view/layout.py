"""How a scene is arranged on the screen: the aircraft and the events at the left, plots in tabs at the right."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, sqrt

import rerun.blueprint as rrb

from sysid_node.view.entities import ABOUT, LANES, NOTES, TIMELINE, WORLD, curve_path, place_path
from sysid_node.view.scene import PlotPanel, Scene

#: Panels of a tab up to which each has a legend; more are too small for one, and alike.
_WITH_LEGENDS = 8


def blueprint(scene: Scene) -> rrb.Blueprint:
    """The arrangement for a scene; what the scene lacks has no place in it."""
    left = rrb.Vertical(*_left(scene), row_shares=_shares(scene))
    tabs = [_tab(title, panels) for title, panels in scene.tabs.items() if panels]
    screen = rrb.Horizontal(left, rrb.Tabs(*tabs, name="Plots"), column_shares=[2, 3]) if tabs else left
    return rrb.Blueprint(
        screen,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, playback_speed=1.0),
        auto_views=False,
        auto_layout=False,
    )


def _left(scene: Scene) -> list[rrb.View | rrb.Container]:
    about = rrb.TextDocumentView(origin=ABOUT, name="About")
    notes = [rrb.TextLogView(origin=NOTES, name="Events")] if scene.notes else []
    lanes = [rrb.StateTimelineView(origin=LANES, name="What moves, what fails")] if scene.lanes else []
    space = [_space(scene)] if scene.bodies else []
    return [*space, *lanes, rrb.Tabs(about, *notes, active_tab=0, name="Words")]


def _shares(scene: Scene) -> list[float]:
    """Heights of the left column's parts, relative to each other; every lane is seen without scrolling."""
    return [*([3.0] if scene.bodies else []), *([0.45 + 0.33 * len(scene.lanes)] if scene.lanes else []), 1.6]


def _space(scene: Scene) -> rrb.Spatial3DView:
    """The space around the first aircraft, which stays in the middle, seen from behind and above."""
    away = scene.shape.span * (1.0 if len(scene.bodies) == 1 else 1.6)
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=tuple(side * away for side in (-1.3, 0.6, -0.7)),
        look_target=(0.0, 0.0, 0.0),
        eye_up=(0.0, 0.0, -1.0),
    )
    return rrb.Spatial3DView(
        origin=place_path(scene.bodies[0].name),
        contents=f"/{WORLD}/**",
        name="Aircraft",
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
    )


def _tab(title: str, panels: Sequence[PlotPanel]) -> rrb.Grid:
    columns = 1 if len(panels) < 3 else ceil(sqrt(len(panels))) if len(panels) > 8 else 2
    legend = len(panels) <= _WITH_LEGENDS
    return rrb.Grid(*(_plot(title, panel, legend) for panel in panels), grid_columns=columns, name=title)


def _plot(tab: str, panel: PlotPanel, legend: bool) -> rrb.TimeSeriesView:
    axis = None if panel.span is None else rrb.ScalarAxis(range=panel.span, zoom_lock=False)
    return rrb.TimeSeriesView(
        origin=curve_path(tab, panel.title, "x").rpartition("/")[0],
        name=f"{panel.title}, {panel.unit}" if panel.unit else panel.title,
        axis_y=axis,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop, visible=legend and len(panel.curves) > 1),
    )
