"""``sysid gap`` of a user's own simulator: by its JSBSim model, flown again in JSBSim, and by its own flights.

Truth: the elevator's servo of the aircraft that is flown, 0.12 s, where the simulator has 0.03 s.
"""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main

SLOW = "actuator_lag:elevator=0.12:aileron=0.03:rudder=0.03"
STEPS = ("--manoeuvre", "3211:width=0.3:repeat=2", "--duration", "24", "--rate", "100")
SMOOTH = ("--manoeuvre", "multisine:length=20", "--duration", "24", "--rate", "100")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A JSBSim model, the aircraft file that was read from it, and two flights of an aircraft with a slow servo."""
    pytest.importorskip("jsbsim", reason="JSBSim is not installed")
    folder = tmp_path_factory.mktemp("simulator")
    model, file = folder / "kestrel.xml", folder / "kestrel.yaml"
    servos = ("--effect", "actuator_lag:time_constant=0.03")
    assert main(["export", "kestrel", "--format", "jsbsim", *servos, "--out", str(model)]) == 0
    read = ("--format", "jsbsim", "--airspeed", "16", "--altitude", "0")
    assert main(["import", str(model), *read, "--out", str(file)]) == 0
    for seed, (name, manoeuvre) in enumerate((("first", STEPS), ("second", SMOOTH))):
        fly(folder, name, *manoeuvre, "--effect", SLOW, "--seed", str(seed))
    return folder


def fly(folder: Path, name: str, *words: str) -> None:
    aircraft = ("--aircraft", str(folder / "kestrel.yaml"))
    assert main(["simulate", *aircraft, *words, "--quiet", "--out", str(folder / name)]) == 0


def diagnosed(folder: Path, *simulator: str) -> tuple[Path, dict]:
    """The folder of results and ``gap.json``."""
    out = folder / "gap"
    flights = [str(folder / "first"), "--holdout", str(folder / "second")]
    words = ["gap", *flights, "--aircraft", str(folder / "kestrel.yaml"), *simulator, "--quiet", "--out", str(out)]
    assert main(words) == 0
    return out, json.loads((out / "gap.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_the_correction_is_written_into_the_jsbsim_model_and_flown_in_it(place: Path) -> None:
    out, said = diagnosed(place, "--simulator", f"jsbsim:{place / 'kestrel.xml'}")
    (cause,) = said["causes"]
    assert cause["label"] == "actuator_lag of elevator"
    assert cause["parameters"]["elevator"][0] == pytest.approx(0.12, rel=0.1)
    flown = said["reflown"]
    assert flown["noise_floor"] < flown["after"] < 0.4 * flown["before"]
    assert flown["ci95"][0] <= flown["shrink_percent"] <= flown["ci95"][1]
    model = ElementTree.parse(out / "corrected_simulator" / "aircraft" / "kestrel" / "kestrel.xml")
    lags = sorted(float(lag.text) for lag in model.iter("lag"))  # 1/s: the elevator's, and those of the others
    assert lags[:3] == pytest.approx([1.0 / cause["parameters"]["elevator"][0], 1.0 / 0.03, 1.0 / 0.03], rel=1e-3)
    assert "Flown in jsbsim:" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_simulator_is_known_by_its_own_flights(place: Path) -> None:
    fly(place, "simulated_first", *STEPS, "--noise", "0", "--seed", "5")
    fly(place, "simulated_second", *SMOOTH, "--noise", "0", "--seed", "6")
    out, said = diagnosed(place, "--simulated", str(place / "simulated_first"), str(place / "simulated_second"))
    (cause,) = said["causes"]
    assert cause["label"] == "actuator_lag of elevator"
    assert cause["believed"]["elevator"] == pytest.approx(0.03, rel=0.1)
    assert 0.0 <= said["surrogate"]["error"] < 0.05
    surrogate = load_aircraft(str(out / "surrogate.yaml"))
    assert surrogate.effects["actuator_lag"]["elevator"].value == pytest.approx(0.03, rel=0.1)
    assert "s of its own flights" in (out / "report.html").read_text(encoding="utf-8")
