"""``sysid simulate``: a bag and the truth beside it, again the same; and the bundled flights."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main
from sysid_node.cli.models import simulate
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.topics import topic_names
from sysid_node.flight.truth import read_truth
from sysid_node.sim.flying import attitude_loops

ROOT = Path(__file__).resolve().parents[3]
BAGS = ROOT / "bags"

MANOEUVRE = [
    "--manoeuvre",
    "3211:elevator:amplitude=0.05:start=1",
    "--manoeuvre",
    "doublet:rudder:amplitude=0.1:start=4",
]


def bundled():
    """``bags/make.py``: the list of flights and how they are made."""
    spec = importlib.util.spec_from_file_location("make_bags", BAGS / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def fly(tmp_path, name, *options):
    out = tmp_path / name
    assert main(["simulate", "--aircraft", "cdrw", "--out", str(out), *options]) == 0
    return out


@pytest.mark.slow
def test_a_bag_and_its_truth(tmp_path, capsys):
    options = [*MANOEUVRE, "--turbulence", "light", "--effect", "actuator_lag:time_constant=0.05", "--seed", "7"]
    bag = fly(tmp_path, "flight", *options, "--effect", "derivative_error:Cm_alpha=-0.05")
    assert "s, " in capsys.readouterr().out
    aircraft = load_aircraft("cdrw")
    record = load_flight_record(bag, aircraft)
    assert record.duration == pytest.approx(8.0, abs=0.5)
    assert np.ptp(record["de"]) > 0.09
    assert np.ptp(record["alpha"]) > 0.02
    assert record["az"].mean() == pytest.approx(-9.8, abs=1.0)
    truth = json.loads((tmp_path / "flight.truth.json").read_text())
    assert truth["effects"]["actuator_lag"] == {"time_constant": 0.05}
    assert truth["effects"]["turbulence"]["intensity"] == pytest.approx(0.77, abs=0.01)
    assert read_truth(bag)["Cm_alpha"] == pytest.approx(aircraft.derivatives["Cm_alpha"].value - 0.05)
    assert str(tmp_path) not in truth["command"]


@pytest.mark.parametrize("surfaces", ["commanded", "measured"])
def test_commands_and_positions_are_both_recorded(tmp_path, surfaces):
    """Each command jumps once in the manoeuvre and is held; its position comes later by the servo's time constant."""
    options = ["--manoeuvre", "doublet:elevator:amplitude=0.1:width=1:start=1", "--open-loop", "--noise", "0"]
    bag = fly(tmp_path, "both", *options, "--effect", "actuator_lag:time_constant=0.05", "--surfaces", surfaces)
    other = {"commanded": "/actuators/position", "measured": "/actuators/command"}[surfaces]
    streams = [read_streams(bag), read_streams(bag, topic_names([f"actuators:={other}"]))]
    commands, positions = (s.actuators for s in (streams if surfaces == "commanded" else streams[::-1]))
    column = commands.names.index("elevator")
    steps = np.flatnonzero(np.diff(commands.positions[:, column]) > 0.05)
    assert steps.size == 2
    begin = commands.arrival.stamp_ns[steps[0] + 1]
    after = (positions.arrival.stamp_ns - begin) / 1e9
    moved = positions.positions[:, column] - positions.positions[0, column]
    rising = (after > 0.01) & (after < 0.9)
    np.testing.assert_allclose(moved[rising], 0.1 * (1.0 - np.exp(-after[rising] / 0.05)), atol=1e-4)


@pytest.mark.slow
def test_the_truths_command_flies_it_again(tmp_path):
    bag = fly(tmp_path, "one", *MANOEUVRE, "--seed", "3", "--open-loop", "--rate", "100", "--quiet")
    words = json.loads((tmp_path / "one.truth.json").read_text())["command"].split()[1:]
    words[words.index("--out") + 1] = str(tmp_path / "again")
    assert main([*words, "--quiet"]) == 0
    for first, second in zip(*(read_streams(b).by_topic.values() for b in (bag, tmp_path / "again")), strict=True):
        np.testing.assert_array_equal(first.arrival.stamp_ns, second.arrival.stamp_ns)
        values = "positions" if hasattr(first, "positions") else "values"
        np.testing.assert_array_equal(getattr(first, values), getattr(second, values))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "surfaces", "begin", "changes"),
    [
        (["control_effectiveness_loss:elevator=0.5:onset=0.4"], "measured", 1.0, [(0.4, 0.5)]),
        (["control_effectiveness_loss:elevator=0.5:onset=9"], "measured", 1.0, []),  # after its end
        (["control_effectiveness_loss:elevator=0.5"], "measured", 0.5, []),  # from the beginning on
        (["stuck_surface:elevator=1:onset=0.4"], "measured", 1.0, []),  # where it stands is recorded
        (["stuck_surface:elevator=1:onset=0.4"], "commanded", 1.0, [(0.4, 0.0)]),
        (
            ["stuck_surface:elevator=1:onset=0.4", "control_effectiveness_loss:elevator=0.5:onset=0.2"],
            *("commanded", 1.0, [(0.2, 0.5), (0.4, 0.0)]),
        ),
    ],
)
def test_the_truth_of_a_failure(tmp_path, effects, surfaces, begin, changes):
    """What the recorded surface does, in what it does in a sound aircraft, and since when; all else stays."""
    options = [word for effect in effects for word in ("--effect", effect)]
    flown = ["--duration", "0.6", "--surfaces", surfaces, "--out", str(tmp_path / "bag"), "--quiet"]
    assert main(["simulate", "--aircraft", "cdrw", *options, *flown]) == 0
    truth = json.loads((tmp_path / "bag.truth.json").read_text())
    file = load_aircraft("cdrw").derivatives
    assert truth["derivatives"]["Cm_de"] == pytest.approx(begin * file["Cm_de"].value)
    assert truth["derivatives"]["Cm_alpha"] == file["Cm_alpha"].value
    assert [change["time"] for change in truth["changes"]] == [time for time, _ in changes]
    for change, (_, share) in zip(truth["changes"], changes, strict=True):
        assert change["derivatives"].keys() == {"CL_de", "CD_de", "Cm_de"}
        assert change["derivatives"]["Cm_de"] == pytest.approx(share * file["Cm_de"].value, abs=1e-12)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--effect", "gremlins:size=3"], "'gremlins' is not known; known: command_delay"),
        (["--effect", "actuator_lag:time_constant=9"], "time_constant=9 is impossible; expected 0 to 1 s"),
        (["--manoeuvre", "3211:flaps:amplitude=0.05"], "flaps"),
        (["--manoeuvre", "3211:elevator:amplitude=0.9"], "limit"),
        (["--turbulence", "biblical"], "expected one of none, light"),
        (["--airspeed", "2"], "no steady flight at 2 m/s"),
        (["--height", "-5"], "expected more than 0"),
        (["--height", "50"], "--height 50: there is no turbulence that it changes"),
        (["--linear-gusts"], "there is no turbulence that it changes; give --turbulence, or leave it out"),
        (["--manoeuvre", "3211:throttle:amplitude=0.2"], "throttle reaches -0.05616 at 2.50 s, but cdrw allows 0 to 1"),
        (["--manoeuvre", "3211:elevator:width=0.005"], "steps of 0.005 s cannot be drawn at 100 Hz"),
        (["--manoeuvre", "sweep:elevator:high=40", "--actuator-rate", "50"], "40 Hz cannot be drawn at 50 Hz"),
        (
            ["--turbulence", "light", "--effect", "turbulence:intensity=2"],
            "--turbulence light: --effect turbulence states intensity, too; give one of them",
        ),
        (["--noise", "2", "--effect", "sensor_noise:scale=3"], "--noise 2: --effect sensor_noise states scale, too"),
        (["--seed", "-1"], "expected a whole number, 0 or more"),
        (["--effect", "actuator_lga:time_constant=0.1"], "did you mean 'actuator_lag'?"),
        (["--effect", "mass_error:eror=0.1"], "did you mean 'error'?"),
        (["--effect", "imu_delay:delay=0.1:delay=0.2"], "'delay' is given twice"),
        (["--effect", "imu_delay:delay=0.1", "--effect", "imu_delay:delay=0.2"], "'imu_delay' is given twice"),
        (["--rate", "0"], "expected"),
        (["--duration", "-1"], "expected 0.1 to 36000 s"),
        (["--duration", "36000", "--rate", "5000"], "takes about 180 GB of memory at 5000 steps a second, and"),
        (["--aircraft", "nobody"], "nobody"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, capsys, options, said):
    out = tmp_path / "bag"
    assert main(["simulate", "--aircraft", "cdrw", "--out", str(out), *options]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1
    assert not out.exists()


def test_an_existing_bag_is_kept(tmp_path, capsys):
    (tmp_path / "bag").mkdir()
    assert main(["simulate", "--aircraft", "cdrw", "--out", str(tmp_path / "bag")]) == 2
    assert "exists already" in capsys.readouterr().err


@pytest.mark.slow
def test_bundled_flights_are_what_their_commands_make(tmp_path):
    """One of them, flown again: equal but for what another processor rounds otherwise."""
    name = "cdrw_slow"
    assert main([*bundled().arguments(name, tmp_path), "--quiet"]) == 0
    ours, theirs = read_streams(BAGS / name), read_streams(tmp_path / name)
    np.testing.assert_array_equal(ours.imu.arrival.stamp_ns, theirs.imu.arrival.stamp_ns)
    for first, second, steps in ((ours.imu, theirs.imu, 0.006), (ours.air_data, theirs.air_data, 0.011)):
        difference = np.abs(first.values - second.values)
        assert difference.max() < steps  # at most one step of quantisation
        assert (difference > 1e-9).mean() < 1e-3
    np.testing.assert_allclose(ours.actuators.positions, theirs.actuators.positions, atol=1e-6)
    assert read_truth(BAGS / name) == pytest.approx(read_truth(tmp_path / name))


def test_bundled_flights_are_listed_and_small():
    make = bundled()
    assert (BAGS / "README.md").read_text() == make.readme()
    for name in make.FLIGHTS:
        size = sum(f.stat().st_size for f in (BAGS / name).iterdir())
        assert size < 3_000_000, name  # commands and positions
        assert read_truth(BAGS / name), name


@pytest.mark.slow
def test_the_throttles_usual_amplitude_can_be_flown_by_excite_and_simulate(tmp_path):
    """cdrw flies level at 0.144 of full throttle: 0.15 would have to be clipped."""
    words = ["--aircraft", "cdrw", "--manoeuvre", "pulse:throttle", "--duration", "2.5", "--quiet", "--out"]
    assert main(["simulate", *words, str(tmp_path / "bag")]) == 0
    assert main(["excite", *words, str(tmp_path / "run")]) == 0


def test_with_and_without_the_autopilot_is_a_contradiction(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["simulate", "--aircraft", "cdrw", "--open-loop", "--autopilot", "--out", str(tmp_path / "bag")])
    assert stop.value.code == 2
    assert "--autopilot: not allowed with argument --open-loop" in capsys.readouterr().err


def test_loops_are_those_of_the_autopilots_that_are_known_and_need_one(tmp_path, capsys):
    assert ("own", *attitude_loops.LOOPS) == simulate.LOOPS
    words = ["simulate", "--aircraft", "cdrw", "--loops", "px4", "--open-loop", "--out", str(tmp_path / "bag")]
    assert main(words) == 2
    assert "--loops px4: --open-loop flies without the autopilot" in capsys.readouterr().err
    assert not (tmp_path / "bag").exists()


@pytest.mark.slow
def test_other_loops_answer_gusts_with_more_aileron(tmp_path):
    """By the same gusts; the command that repeats the flight names the loops."""
    moved = {}
    for loops in simulate.LOOPS:
        options = [
            "--turbulence",
            "light",
            "--seed",
            "5",
            "--duration",
            "8",
            "--rate",
            "100",
            "--loops",
            loops,
            "--quiet",
        ]
        bag = fly(tmp_path, loops, *options)
        moved[loops] = load_flight_record(bag, load_aircraft("cdrw"))["da"].std()
        command = json.loads((tmp_path / f"{loops}.truth.json").read_text())["command"]
        assert ("--loops" in command) == (loops != "own")
    assert moved["px4"] > moved["own"]
    assert moved["ardupilot"] > moved["own"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["stuck_surface:elevator=1:onset=9"], "onset=9 s is not within the flight of 1 s, so that it does nothing"),
        (["gust:down=3:start=1"], "start=1 s is not within the flight of 1 s"),
        (["derivative_error:Cm_alpha=8"], "deg, where derivatives do not describe the flight"),
        (["gust:down=1:start=0.5"], ""),
    ],
)
def test_what_was_not_flown_as_it_was_asked_for_is_a_warning(tmp_path, capsys, options, said):
    words = ["--aircraft", "cdrw", "--duration", "1", "--out", str(tmp_path / "bag"), "--effect", *options]
    assert main(["simulate", *words]) == 0
    error = capsys.readouterr().err
    assert said in error
    assert error.count("warning:") == bool(said)
