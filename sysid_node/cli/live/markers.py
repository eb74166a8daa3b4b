"""The program ``markers``: publishes the aircraft as transforms and markers, for RViz, Foxglove and PlotJuggler.

It needs the message packages ``tf2_msgs`` and ``visualization_msgs``, which come with ROS by apt.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.live.viewer_program import run_viewer, watched_flight
from sysid_node.errors import InputError
from sysid_node.parameter import AIRCRAFT, BODY_FRAME, NodeParameter
from sysid_node.view.live import LiveScene
from sysid_node.view.markers import SAME, Trail, Triangles, fixed_parts, moving_parts, pose_of
from sysid_node.view.scene import GREY, ORANGE, PALE, VERMILION, Body, Colour

if TYPE_CHECKING:
    from sysid_node.ros.support.flight_watch import FlightWatch

PERIOD = 0.05  # s between two poses
NEEDED = ("tf2_msgs", "visualization_msgs")
_TEXT_ABOVE = 0.6  # height of the text above the aircraft, spans
_LETTERS, _LINE = 0.15, 0.01  # height of a letter and width of the trail, spans

PARAMETERS = (
    AIRCRAFT,
    BODY_FRAME,
    NodeParameter("world_frame", "map", "", "The fixed frame, east-north-up.", "To the fixed frame of the display."),
    NodeParameter("aircraft_frame", "base_link", "", "The aircraft's frame, forward-left-up.", "To the name it has."),
    NodeParameter(
        "transforms",
        True,
        "",
        "Whether the transform between the frames is published.",
        "To false where the autopilot's bridge publishes it.",
    ),
)


def require_packages() -> None:
    """Raises InputError, in one line, where the message packages are not installed."""
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        apt = " ".join(f"ros-jazzy-{name.replace('_', '-')}" for name in missing)
        raise InputError(f"{' and '.join(missing)} not installed: apt install {apt}, or look with sysid view")


class MarkerPublisher:
    """Publishes ``/tf`` and ``~/markers`` from what a watch hears."""

    def __init__(self, aircraft: Aircraft, watch: FlightWatch, world: str, body: str, transforms: bool) -> None:
        from tf2_msgs.msg import TFMessage  # noqa: PLC0415  # not everywhere installed
        from visualization_msgs.msg import MarkerArray  # noqa: PLC0415

        self._scene, self._watch, self._trail = LiveScene(aircraft), watch, Trail()
        self._shape, self._span = self._scene.declared.shape, aircraft.geometry.b
        self._world, self._body = world, body
        self._deflections: dict[str, float] = {}
        self._frames = watch.node.create_publisher(TFMessage, "/tf", 100) if transforms else None
        self._markers = watch.node.create_publisher(MarkerArray, "~/markers", 10)

    def publish(self) -> None:
        """What came in since the last call; nothing where no attitude came."""
        from visualization_msgs.msg import MarkerArray  # noqa: PLC0415

        scene = self._scene.update(self._watch.start_ns, *self._watch.take(), self._watch.faults)
        if not scene.bodies or not scene.bodies[0].time.size:
            return
        body = scene.bodies[0]
        stamp = self._watch.start_ns + round(1e9 * float(body.time[-1]))
        self._deflections |= {symbol: float(values[-1]) for symbol, values in body.controls.items()}
        self._trail.add(body)
        if self._frames is not None:
            self._frames.publish(self._transform(stamp, body))
        parts = [fixed_parts(self._shape), *moving_parts(self._shape, self._deflections)]
        drawn = [self._triangles(i, stamp, part) for i, part in enumerate(parts)]
        self._markers.publish(MarkerArray(markers=[*drawn, self._way(stamp), self._words(stamp, scene.about)]))

    def _transform(self, stamp: int, body: Body) -> Any:
        from geometry_msgs.msg import Transform, TransformStamped  # noqa: PLC0415
        from tf2_msgs.msg import TFMessage  # noqa: PLC0415

        from sysid_node.ros.support.conversion import header  # noqa: PLC0415

        pose, moved = pose_of(body), Transform()
        _fill(moved.translation, pose.position, "xyz")
        _fill(moved.rotation, pose.orientation, "xyzw")
        stamped = TransformStamped(header=header(stamp, self._world), child_frame_id=self._body, transform=moved)
        return TFMessage(transforms=[stamped])

    def _triangles(self, number: int, stamp: int, part: Triangles) -> Any:
        colour = GREY if part.name == "airframe" else PALE
        marker = self._marker("aircraft", number, stamp, self._body, colour)
        marker.type, marker.frame_locked = marker.TRIANGLE_LIST, True
        _fill(marker.pose.position, part.pose.position, "xyz")
        _fill(marker.pose.orientation, part.pose.orientation, "xyzw")
        _fill(marker.scale, (1.0, 1.0, 1.0), "xyz")
        marker.points = _points(part.corners)
        return marker

    def _way(self, stamp: int) -> Any:
        """The trail; a line of one point is none, and is deleted."""
        marker = self._marker("trail", 0, stamp, self._world, ORANGE)
        points = self._trail.points
        marker.type, marker.action = marker.LINE_STRIP, marker.ADD if len(points) > 1 else marker.DELETE
        marker.scale.x = _LINE * self._span
        marker.points = _points(points)
        return marker

    def _words(self, stamp: int, about: str) -> Any:
        """How many derivatives are valid and what has failed, above the aircraft."""
        faults = self._watch.faults
        marker = self._marker("text", 0, stamp, self._body, VERMILION if faults else GREY)
        marker.type, marker.frame_locked = marker.TEXT_VIEW_FACING, True
        marker.pose.position.z = _TEXT_ABOVE * self._span
        marker.scale.z = _LETTERS * self._span
        first, *rest = [line for line in about.splitlines() if line]
        said = rest[0] if first.endswith(", live") and rest else first.lstrip("# ")
        marker.text = "\n".join([said, *faults.values()])
        return marker

    def _marker(self, group: str, number: int, stamp: int, frame: str, colour: Colour) -> Any:
        from visualization_msgs.msg import Marker  # noqa: PLC0415

        from sysid_node.ros.support.conversion import header  # noqa: PLC0415

        marker = Marker(header=header(stamp, frame), ns=group, id=number, action=Marker.ADD)
        _fill(marker.pose.orientation, SAME.orientation, "xyzw")
        _fill(marker.color, [part / 255.0 for part in colour], "rgb")
        marker.color.a = 1.0
        return marker


def _fill(target: Any, values: Any, names: str) -> None:
    for name, value in zip(names, values, strict=True):
        setattr(target, name, float(value))


def _points(corners: Any) -> list[Any]:
    from geometry_msgs.msg import Point  # noqa: PLC0415

    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in corners]


def main() -> None:
    """Entry point of ``ros2 run sysid_node markers``."""
    run_viewer("markers", __doc__ or "", PARAMETERS, _serve)


def _serve() -> None:
    import rclpy  # noqa: PLC0415

    require_packages()
    with watched_flight(PARAMETERS, name="markers") as (watch, given):
        frames = given["world_frame"], given["aircraft_frame"], given["transforms"]
        publisher = MarkerPublisher(load_aircraft(given["aircraft"]), watch, *frames)
        while rclpy.ok():
            watch.listen(PERIOD)
            publisher.publish()
