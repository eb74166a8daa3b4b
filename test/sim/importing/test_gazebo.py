"""Gazebo's models read in. Truth: the equations of gz-sim's LiftDrag, AdvancedLiftDrag and MulticopterMotorModel.

They are written here anew, one state at a time and in Gazebo's own axes (forward-left-up), as the sources state them.
"""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from aircraft_loads import loads, motion, planes, scales, trimmed
from level_flight import level_flight

from sysid_node.errors import InputError
from sysid_node.sim.importing.gazebo.read import read_gazebo

SHARED = Path(__file__).resolve().parents[4] / "shared" / "models"
FLIP = np.diag([1.0, -1.0, -1.0])

#: A flying wing of our own: two surfaces with a joint each, a fin, and a motor.
SMALL = """<sdf version="1.9"><model name="small wing">
<link name="base"><inertial><pose>0.02 0 0.01 0 0 0</pose><mass>1.2</mass>
<inertia><ixx>0.06</ixx><iyy>0.04</iyy><izz>0.1</izz><ixz>0.002</ixz></inertia></inertial></link>
<link name="rotor"><pose>0.3 0 0 0 1.5707963 0</pose><inertial><mass>0.05</mass>
<inertia><ixx>1e-5</ixx><iyy>1e-5</iyy><izz>1e-5</izz></inertia></inertial></link>
{joints}
{wings}
<plugin filename="x" name="gz::sim::systems::MulticopterMotorModel">
<jointName>spin</jointName><linkName>rotor</linkName>
<turningDirection>ccw</turningDirection><timeConstantUp>0.02</timeConstantUp><timeConstantDown>0.02</timeConstantDown>
<maxRotVelocity>900</maxRotVelocity><motorConstant>1.5e-05</motorConstant><momentConstant>0.01</momentConstant>
<rotorDragCoefficient>8e-05</rotorDragCoefficient><rollingMomentCoefficient>1e-06</rollingMomentCoefficient></plugin>
</model></sdf>"""


def small(folder):
    joint = (
        '<joint name="{0}" type="revolute"><parent>base</parent><child>base</child><axis><xyz>0 1 0</xyz>'
        "<limit><lower>-0.5</lower><upper>0.5</upper></limit><dynamics><damping>0.4</damping></dynamics></axis></joint>"
        "<plugin filename='x' "
        "name='gz::sim::systems::JointPositionController'><joint_name>{0}</joint_name><p_gain>8</p_gain></plugin>"
    )
    wing = (
        "<plugin filename='x' name='gz::sim::systems::LiftDrag'><a0>{a0}</a0><cla>4.5</cla><cda>{cda}</cda>"
        "<alpha_stall>0.32</alpha_stall><cla_stall>-3</cla_stall><cda_stall>-0.8</cda_stall><cp>{cp}</cp><area>{area}</area><air_density>1.2"
        "</air_density><forward>1 0 0</forward><upward>{up}</upward><link_name>base</link_name>{joint}</plugin>"
    )
    moved = "<control_joint_name>{}</control_joint_name><control_joint_rad_to_cl>{}</control_joint_rad_to_cl>"
    wings = [
        wing.format(a0=0.06, cda=0.5, cp="0 0.4 0.02", area=0.2, up="0 0 1", joint=moved.format("left", -0.4)),
        wing.format(a0=0.06, cda=0.5, cp="0 -0.4 0.02", area=0.2, up="0 0 1", joint=moved.format("right", -0.4)),
        wing.format(a0=-0.03, cda=0.6, cp="-0.6 0 0.02", area=0.06, up="0 0 1", joint=moved.format("tail", -2.0)),
        wing.format(a0=0.0, cda=0.6, cp="-0.6 0 0.1", area=0.04, up="0 1 0", joint=moved.format("fin", 1.5)),
    ]
    path = folder / "small.sdf"
    path.write_text(
        SMALL.format(joints="".join(joint.format(n) for n in ("left", "right", "tail", "fin")), wings="".join(wings))
    )
    return path


@pytest.mark.parametrize(
    ("was", "is_now"),
    [
        ("<cp>-0.6 0 0.02</cp>", "<cp>0 0 1e300</cp>"),
        (">-0.4</control_joint_rad_to_cl>", ">1e300</control_joint_rad_to_cl>"),
    ],
)
def test_numbers_that_no_aircraft_has_are_one_line(tmp_path, was, is_now):
    path = small(tmp_path)
    text = path.read_text()
    assert was in text
    path.write_text(text.replace(was, is_now))
    with pytest.raises(InputError, match="its forces are over"):
        read_gazebo(path, None)


def numbers(element, tag, default):
    text = element.findtext(tag)
    values = [float(part) for part in text.split()] if text else [default] if np.isscalar(default) else list(default)
    return values[0] if len(values) == 1 else np.array(values)


def lift_drag(plugin, velocity, joints):
    """Force (3,) of one LiftDrag at its place, forward-left-up; after LiftDragPrivate::Update."""
    get = lambda tag, default: numbers(plugin, tag, default)  # noqa: E731
    forward, upward = get("forward", (1, 0, 0)), get("upward", (0, 0, 1))
    span = np.cross(forward, upward)
    direction = velocity / np.linalg.norm(velocity)
    cos_sweep = 1.0 - np.clip(span @ direction, -1, 1) ** 2
    in_plane = velocity - (velocity @ span) * span
    drag_axis = -in_plane / np.linalg.norm(in_plane)
    lift_axis = np.cross(span, in_plane)
    lift_axis = lift_axis / np.linalg.norm(lift_axis)
    turn = math.acos(np.clip(lift_axis @ upward, -1, 1))
    alpha = get("a0", 0.0) + (turn if lift_axis @ forward >= 0 else -turn)
    q = 0.5 * get("air_density", 1.2041) * (in_plane @ in_plane)
    stall = get("alpha_stall", math.pi / 2)
    values = {}
    for name in ("cla", "cda"):
        before, after = get(name, 1.0), get(f"{name}_stall", 0.0)
        if alpha > stall:
            values[name] = (before * stall + after * (alpha - stall)) * cos_sweep
        elif alpha < -stall:
            values[name] = (-before * stall + after * (alpha + stall)) * cos_sweep
        else:
            values[name] = before * alpha * cos_sweep
    cl = max(values["cla"], 0.0) if alpha > stall else min(values["cla"], 0.0) if alpha < -stall else values["cla"]
    joint = plugin.findtext("control_joint_name")
    if joint:
        cl += get("control_joint_rad_to_cl", 4.0) * joints[joint]
    area = get("area", 1.0)
    return cl * q * area * lift_axis + abs(values["cda"]) * q * area * drag_axis


def advanced(plugin, velocity, rates, joints):
    """Force (3,) at the place and moment (3,), forward-left-up; after AdvancedLiftDragPrivate::Update, Cem mended."""
    get = lambda tag: numbers(plugin, tag, 0.0)  # noqa: E731
    x, y, z = np.eye(3)[0], -np.eye(3)[1], -np.eye(3)[2]  # forward, right, down
    in_plane = velocity - (velocity @ y) * y
    speed = np.linalg.norm(in_plane)
    sx = in_plane / speed
    sz = np.cross(sx, y)
    alpha, beta = math.atan2(sx @ z, sx @ x), math.atan2(velocity @ y, velocity @ x)
    AR, area, stall = get("AR"), get("area"), get("alpha_stall")
    span, mac = math.sqrt(area * AR), get("mac")
    rr, pr, yr = rates[0], -rates[1], -rates[2]
    M, a = 15.0, alpha
    sigma = (1 + math.exp(-M * (a - stall)) + math.exp(M * (a + stall))) / (
        (1 + math.exp(-M * (a - stall))) * (1 + math.exp(M * (a + stall)))
    )
    control = dict.fromkeys(("CL", "CD", "CY", "Cell", "Cem", "Cen"), 0.0)
    for surface in plugin.findall("control_surface"):
        angle = math.degrees(joints[surface.findtext("name")]) * float(surface.findtext("direction"))
        for name in control:
            control[name] += angle * float(surface.findtext(f"{name}_ctrl"))
    CL = (1 - sigma) * (get("CL0") + get("CLa") * a) + sigma * 2 * np.sign(a) * math.sin(a) ** 2 * math.cos(a)
    CL += get("CLb") * beta + control["CL"]
    flat = 2 / (1 + math.exp(-0.224 - 0.115 * max(AR, 1 / AR)))
    CD = (1 - sigma) * (get("CD0") + CL**2 / (math.pi * AR * get("eff"))) + sigma * abs(
        flat * (0.5 - 0.5 * math.cos(2 * a))
    )
    CD += control["CD"]
    Cem = get("Cem0") + get("Cema") * a
    if abs(a) > stall:
        Cem = get("Cem0") + math.copysign(stall, a) * get("Cema") + get("Cema_stall") * (a - math.copysign(stall, a))
    steady = {"CL": CL, "CD": CD, "Cem": Cem + get("Cemb") * beta + control["Cem"]}
    for name in ("CY", "Cell", "Cen"):
        steady[name] = get(f"{name}a") * a + get(f"{name}b") * beta + control[name]
    rho = get("air_density")
    q, half = 0.5 * rho * speed**2, 0.5 * rho * speed
    terms = {
        n: v * q + half * (get(f"{n}p") * rr * span / 2 + get(f"{n}q") * pr * mac / 2 + get(f"{n}r") * yr * span / 2)
        for n, v in steady.items()
    }
    force = area * (-terms["CL"] * sz - terms["CD"] * sx + terms["CY"] * y)
    return force, area * (terms["Cem"] * mac * y + terms["Cell"] * span * x + terms["Cen"] * span * z)


def rotor(plugin, velocity, share):
    """Force (3,) at the rotor and torque (3,), forward-left-up, at a share of the full thrust."""
    get = lambda tag: numbers(plugin, tag, 0.0)  # noqa: E731
    axis = axis_of(plugin)
    omega = get("maxRotVelocity") * math.sqrt(share)
    thrust = get("motorConstant") * omega**2
    across = velocity - (velocity @ axis) * axis
    sign = -1 if plugin.findtext("turningDirection") == "cw" else 1
    force = thrust * axis - omega * get("rotorDragCoefficient") * across
    return force, -sign * thrust * get("momentConstant") * axis - omega * get("rollingMomentCoefficient") * across


def axis_of(plugin):
    """The rotor's z axis: both models pitch it forward."""
    pitch = float(plugin.get("pitch"))
    return np.array([math.sin(pitch), 0.0, math.cos(pitch)])


def pose_of(model, element):
    """Six numbers; what a pose is relative to does not turn it in these models."""
    pose = element.find("pose")
    numbers = np.array([float(v) for v in (element.findtext("pose") or "0 0 0 0 0 0").split()])
    base = pose.get("relative_to") if pose is not None else None
    if not base:
        return numbers
    (other,) = [e for kind in ("link", "joint") for e in model.findall(kind) if e.get("name") == base]
    return numbers + pose_of(model, other)


def theirs(path, x, aircraft):
    """Loads (N, 6) about the centre of gravity, forward-right-down, summed over all plugins."""
    model = ElementTree.parse(path).getroot().find(".//model")
    bodies = {}
    for link in model.findall("link"):
        inertial = link.find("inertial")
        pose = pose_of(model, link)
        inner = (
            np.array([float(v) for v in (inertial.findtext("pose") or "0 0 0 0 0 0").split()])
            if inertial is not None
            else pose
        )
        bodies[link.get("name")] = (pose, pose[:3] + inner[:3], float(inertial.findtext("mass")))
    mass = sum(m for _, _, m in bodies.values())
    centre = sum(m * c for _, c, m in bodies.values()) / mass
    controls = list(aircraft.controls.values())
    joints = sorted({j for c in controls for j in c.joints})
    mixing = np.linalg.inv([[c.joints.get(j, 0.0) for j in joints] for c in controls])
    velocity, rates = motion(aircraft, x)
    result = []
    for i in range(len(x["V"])):
        angles = dict(zip(joints, mixing @ [x[c.symbol][i] for c in controls], strict=True))
        v, w = FLIP @ velocity[i], FLIP @ rates[i]
        total = np.zeros(6)
        for plugin in model.findall("plugin"):
            kind = plugin.get("name").rpartition("::")[2]
            if kind in ("LiftDrag", "AdvancedLiftDrag"):
                arm = numbers(plugin, "cp", (0, 0, 0)) - centre
                at = v + np.cross(w, arm)
                force, torque = (
                    (lift_drag(plugin, at, angles), 0.0) if kind == "LiftDrag" else advanced(plugin, at, w, angles)
                )
            elif kind == "MulticopterMotorModel":
                pose, place, _ = bodies[plugin.findtext("linkName")]
                plugin.set("pitch", str(pose[4]))
                arm = place - centre
                force, torque = rotor(plugin, v + np.cross(w, arm), x["throttle"][i])
            else:
                continue
            total += np.concatenate([force, torque + np.cross(arm, force)])
        result.append(np.concatenate([FLIP @ total[:3], FLIP @ total[3:]]))
    return np.array(result)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["small", "px4_advanced_plane", "px4_rc_cessna"])
def test_loads_are_those_of_the_plugins_at_the_tables_points(tmp_path, name):
    path = small(tmp_path) if name == "small" else SHARED / f"{name}.sdf"
    if not path.is_file():
        pytest.skip("the models of other projects are not here (../shared/models)")
    aircraft = read_gazebo(path).aircraft
    level = level_flight(aircraft)
    x = planes(aircraft, level, 5)
    error = loads(aircraft, x, x["throttle"] * aircraft.throttle.max_thrust) - theirs(path, x, aircraft)
    assert np.abs(error / scales(aircraft, x)).max() < 1e-6


def test_masses_servos_and_signs(tmp_path):
    """1.25 kg at two places; a servo of gain 8 against damping 0.4 lags by 0.05 s; signs are the aircraft file's."""
    aircraft = read_gazebo(small(tmp_path)).aircraft
    assert aircraft.mass == pytest.approx(1.25)
    apart = np.array([0.28, 0.0, -0.01])
    reduced = 1.2 * 0.05 / 1.25
    assert aircraft.inertia.Iyy == pytest.approx(0.04 + 1e-5 + reduced * (apart @ apart))
    assert aircraft.inertia.Ixz == pytest.approx(0.002 - reduced * apart[0] * apart[2])
    assert [u.value for u in aircraft.effects["actuator_lag"].values()] == pytest.approx(
        [0.05] * len(aircraft.controls)
    )
    assert aircraft.effects["motor_lag"]["time_constant"].value == pytest.approx(0.02)
    assert aircraft.throttle.max_thrust == pytest.approx(1.5e-5 * 900**2)
    assert set(aircraft.controls["aileron"].joints) == {"left", "right"}
    assert set(aircraft.controls["elevator"].joints) == {"tail"}
    for name in ("Cm_de", "Cl_da", "Cn_dr"):
        assert aircraft.derivatives[name].value < 0.0
    assert aircraft.ideal


def test_a_glider_without_joints_has_no_controls(tmp_path):
    path = tmp_path / "glider.sdf"
    path.write_text(
        "<sdf><model name='m'><link name='l'><inertial><mass>1</mass></inertial></link>"
        "<plugin name='x::LiftDrag'><link_name>l</link_name></plugin></model></sdf>"
    )
    aircraft = read_gazebo(path).aircraft
    assert not aircraft.controls
    assert aircraft.derivatives["CL_alpha"].value == pytest.approx(1.0, rel=0.01)  # the plugin's default cla


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<sdf/>", "has no <model>"),
        ("<sdf><model name='m'/></sdf>", "has no links"),
        ("<sdf><model name='m'><link name='l'/></model></sdf>", "no plugin LiftDrag or AdvancedLiftDrag"),
        (
            "<sdf><model name='m'><link name='l'/><plugin name='x::LiftDrag'><link_name>no</link_name></plugin>"
            "</model></sdf>",
            "names the link 'no'",
        ),
        (
            "<sdf><model name='m'><link name='l'/><plugin name='x::LiftDrag'><cla>1 2</cla></plugin></model></sdf>",
            "<cla>: got '1 2', expected 1 numbers",
        ),
        (
            "<sdf><model name='m'><link name='l'/><plugin name='x::AdvancedLiftDrag'><AR>0</AR><eff>1</eff></plugin>"
            "</model></sdf>",
            "AR of an AdvancedLiftDrag plugin is 0; it must be above zero",
        ),
        (
            "<sdf><model name='m'><link name='l'/><plugin name='x::LiftDrag'><area>-0.2</area></plugin></model></sdf>",
            "area of a LiftDrag plugin is -0.2; it must be above zero",
        ),
        (
            "<sdf><model name='m'><link name='l'/><plugin name='x::AdvancedLiftDrag'><AR>6</AR><eff>1</eff>"
            "<air_density>0</air_density></plugin></model></sdf>",
            "air_density of an AdvancedLiftDrag plugin is 0",
        ),
        (
            "<sdf><model name='m'><link name='l'><inertial><mass>-2</mass></inertial></link></model></sdf>",
            "link 'l' has a mass of -2 kg; it must not be negative",
        ),
        ("<sdf", "not XML"),
        ("<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]><a>&b;</a>", "declares XML entities"),
        ("<!DOCTYPE a [<!ENTITY b 'x'><!ENTITY c '&b;&b;'>]><a>&c;</a>", "declares XML entities"),
    ],
)
def test_what_is_no_model_is_one_line(tmp_path, text, said):
    path = tmp_path / "model.sdf"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_gazebo(path)


LIFTER = (
    '<link name="up{0}"><pose>{1} 0.2 0 0 0 0</pose><inertial><mass>0.01</mass></inertial></link>'
    "<plugin filename='x' name='gz::sim::systems::MulticopterMotorModel'><jointName>lift{0}</jointName>"
    "<linkName>up{0}</linkName></plugin>"
)


def test_of_a_vtol_the_motor_that_pulls_forward_is_the_engine(tmp_path):
    path = small(tmp_path)
    alone = read_gazebo(path).aircraft.throttle
    head, motor, tail = path.read_text().partition('<plugin filename="x" name="gz::sim::systems::Multicopter')
    path.write_text(head + LIFTER.format(0, 0.2) + LIFTER.format(1, -0.2) + motor + tail)
    found = read_gazebo(path)
    assert found.aircraft.throttle.joint == "spin"
    assert found.aircraft.throttle.max_thrust == pytest.approx(alone.max_thrust)
    assert any(note.startswith("Of 3 motors only that of spin is held") for note in found.notes)


def test_products_of_inertia_that_a_file_has_not_are_said(tmp_path):
    path = small(tmp_path)
    assert not any("Ixy" in note for note in read_gazebo(path).notes)
    path.write_text(path.read_text().replace("<ixz>0.002</ixz>", "<ixz>0.002</ixz><iyz>0.01</iyz>"))
    assert any(note.startswith("Ixy or Iyz is ") for note in read_gazebo(path).notes)


def test_a_surface_whose_joint_is_not_there_is_one_line(tmp_path):
    path = small(tmp_path)
    path.write_text(path.read_text().replace("<control_joint_name>tail<", "<control_joint_name>elevator<"))
    with pytest.raises(InputError, match="names the joint 'elevator', which the model does not have"):
        read_gazebo(path)


def test_what_the_rotor_does_besides_pulling_follows_the_throttle(tmp_path):
    """At the tables' points: its torque grows with the throttle, its drag with the root of it."""
    path = small(tmp_path)
    aircraft = read_gazebo(path).aircraft
    level = level_flight(aircraft)
    for throttle in (0.0, 0.01, 0.2, 1.0):
        x = trimmed(aircraft, level) | {"throttle": np.array([throttle])}
        error = loads(aircraft, x, throttle * aircraft.throttle.max_thrust) - theirs(path, x, aircraft)
        assert np.abs(error / scales(aircraft, x)).max() < 1e-6


ROTOR = "<pose>0.3 0 0 0 1.5707963 0</pose>"


@pytest.mark.parametrize(
    "pose",
    [
        '<pose degrees="true">0.3 0 0 0 90 0</pose>',
        '<pose relative_to="__model__">0.3 0 0 0 1.5707963 0</pose>',
        '<pose relative_to="nose">0 0 0.1 0 0 0</pose>',
        '<pose relative_to="mount">0 0.2 0 0 0 0</pose>',
    ],
)
def test_poses_are_in_degrees_and_relative_where_they_say_so(tmp_path, pose):
    """The same place in other words: SDF's specification of //pose/@degrees, @relative_to and //frame/@attached_to."""
    path = small(tmp_path)
    known = read_gazebo(path).aircraft
    frames = (
        '<frame name="nose"><pose>0.2 0 0 0 1.5707963 0</pose></frame>'
        '<joint name="mount" type="fixed"><parent>base</parent><child>base</child>'
        '<pose relative_to="side">0 0.1 0 0 1.5707963 0</pose></joint>'
        '<frame name="side" attached_to="nose"><pose degrees="1">0 -0.3 0.1 0 -90 0</pose></frame>'
    )
    assert path.read_text().count(ROTOR) == 1
    path.write_text(path.read_text().replace(ROTOR, pose).replace("</model>", frames + "</model>"))
    found = read_gazebo(path).aircraft
    assert vars(found.inertia) == pytest.approx(vars(known.inertia), abs=1e-8)
    assert found.throttle.arm == pytest.approx(known.throttle.arm, abs=1e-8)
    assert found.throttle.inclination == pytest.approx(known.throttle.inclination, abs=1e-6)


@pytest.mark.parametrize(
    ("base", "said"),
    [
        ("nose", "link 'rotor' stands relative to 'nose', which the model does not have"),
        ("rotor", "stands in a circle"),
    ],
)
def test_a_pose_relative_to_nothing_is_one_line(tmp_path, base, said):
    path = small(tmp_path)
    path.write_text(path.read_text().replace(ROTOR, f'<pose relative_to="{base}">0 0 0 0 0 0</pose>'))
    with pytest.raises(InputError, match=said):
        read_gazebo(path)


def behind_a_ramp(gain, derivative, damping):
    """How late (s) a joint follows a ramp: gz-math's PID::Update(error, dt) against the damping, at 1 ms."""
    step, angle, last = 0.001, 0.0, 0.0
    for k in range(1, 2001):
        command = k * step
        # damping (angle' - angle) / dt = -P error - D (error - last) / dt, error = angle' - command
        angle = (damping * angle / step + gain * command + derivative * (command + last) / step) / (
            damping / step + gain + derivative / step
        )
        last = angle - command
    return command - angle


@pytest.mark.parametrize("derivative", [0.0, 0.4, 4.0])
def test_the_lag_of_a_servo_is_that_behind_a_ramp_whatever_its_derivative_gain(tmp_path, derivative):
    path = small(tmp_path)
    gains = f"<p_gain>8</p_gain><d_gain>{derivative}</d_gain>"
    path.write_text(path.read_text().replace("<p_gain>8</p_gain>", gains))
    found = read_gazebo(path)
    late = behind_a_ramp(8.0, derivative, 0.4)
    assert found.aircraft.effects["actuator_lag"]["elevator"].value == pytest.approx(late, abs=2e-3)
    said = [note for note in found.notes if "d_gain" in note]
    assert bool(said) == bool(derivative)
    if said:
        assert f"tail {derivative / (0.4 + derivative):.0%}" in said[0]


def test_one_controller_may_move_several_joints(tmp_path):
    path = small(tmp_path)
    text = path.read_text()
    known = read_gazebo(path).aircraft.effects["actuator_lag"]
    start = text.index("<plugin filename='x' name='gz::sim::systems::JointPositionController'><joint_name>tail")
    text = text[:start] + text[text.index("</plugin>", start) + len("</plugin>") :]
    fin = "<joint_name>fin</joint_name>"
    path.write_text(text.replace(fin, fin + "<joint_name>tail</joint_name>"))
    assert read_gazebo(path).aircraft.effects["actuator_lag"] == known


def test_a_joint_of_unequal_travel_keeps_the_larger_and_says_so(tmp_path):
    path = small(tmp_path)
    before, tail, after = path.read_text().partition('<joint name="tail"')
    path.write_text(before + tail + after.replace("<lower>-0.5<", "<lower>-0.1<", 1))
    found = read_gazebo(path)
    assert found.aircraft.controls["elevator"].limit == pytest.approx(0.5)
    assert "The joint tail moves from -0.100 to 0.500 rad; a file has one limit both ways." in found.notes


@pytest.mark.parametrize(("gain", "said"), [("", True), ("<i_gain>0</i_gain>", False), ("<i_gain>2</i_gain>", True)])
def test_integral_gains_are_said_also_where_they_are_gz_sims_default(tmp_path, gain, said):
    """gz-sim's JointPositionController: i_gain is 0.1 where none is stated."""
    path = small(tmp_path)
    path.write_text(path.read_text().replace("<p_gain>8</p_gain>", "<p_gain>8</p_gain>" + gain))
    assert ("Integral gains of the joints' controllers are not held." in read_gazebo(path).notes) == said


def test_a_model_of_fins_alone_is_one_line(tmp_path):
    path = small(tmp_path)
    path.write_text(path.read_text().replace("<upward>0 0 1</upward>", "<upward>0 1 0</upward>"))
    with pytest.raises(InputError, match="no LiftDrag surface has <upward> along z, so it has no wing"):
        read_gazebo(path)
