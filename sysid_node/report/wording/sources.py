"""What the sources of uncertainty are called, and what a user can do about each."""

from __future__ import annotations

#: By a tolerance's key, or all of it but its last part: what it is, with the last part for {}, and what reduces it.
_WORDS = {
    "statistical": ("noise and gusts", "fly longer, or with larger inputs"),
    "mass": ("the mass", "weigh the aircraft as flown"),
    "inertia": ("{}", "swing the aircraft as a pendulum"),
    "geometry": ("the reference {}", "measure the wing"),
    "sensors.imu": ("the place of the IMU, {}", "measure it from the centre of gravity"),
    "sensors.air_data": ("the place of the air-data probe, {}", "measure it from the centre of gravity"),
    "cg_shift": ("the centre of gravity, {}", "balance the aircraft as flown"),
    "throttle.max_thrust": ("the thrust", "measure it in a static test, or on a wing without slipstream"),
    "throttle.inclination": ("the angle of the thrust line", "measure it against the fuselage"),
    "throttle.arm": ("the arm of the thrust line", "measure it from the centre of gravity"),
    "delays.imu": ("the delay of the IMU", "state its low-pass filter and its driver's delay in the file"),
    "delays.air_data": ("the delay of the air data", "state the driver's delay in the file"),
    "delays.actuators": ("the delay of the actuators' stamps", "stamp them where the commands are sent"),
    "air_density": ("the air density", "measure temperature and pressure"),
    "imu_scale": ("the IMU's scale, {}", "calibrate the IMU"),
    "imu_bias": ("the IMU's bias, {}", "calibrate the IMU in six positions"),
    "imu_misalignment": ("the IMU's mounting, {}", "level the IMU to the body axes"),
    "airspeed_scale": ("the airspeed's scale", "calibrate the airspeed against GPS on reciprocal courses"),
    "airspeed_bias": ("the airspeed's zero", "zero the airspeed sensor before the flight"),
    "vane_scale": ("the scale of {}", "calibrate the flow angles in flight"),
    "vane_bias": ("the zero of {}", "calibrate the flow angles in level flight"),
    "mean_alpha": ("the mean angle of attack, by the file's lift", "measure it with a vane, or CL_0 in level flight"),
    "air_data_lag": ("the air data's lag", "measure the step response of tubes and sensor"),
    "actuator_lag": ("the {} servo's time", "measure it on the bench, or record positions"),
}


def source_words(key: str) -> tuple[str, str]:
    """What the source of a share of the variance is, and what reduces it; the key itself for one without words."""
    of, _, last = key.rpartition(".")
    if key.startswith("controls."):
        _, control, what = key.split(".")
        return f"the {control}'s {'throw' if what == 'scale' else 'zero'}", "measure it with a throw gauge"
    name, advice = _WORDS.get(key) or _WORDS.get(of) or (key, "state a smaller tolerance in the aircraft file")
    return name.format(last), advice
