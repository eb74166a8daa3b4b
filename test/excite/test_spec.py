"""Specs: what the grammar means, and the one line that a wrong spec gets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.excite.kinds import KINDS
from sysid_node.excite.shapes import multistep
from sysid_node.excite.spec import parse_manoeuvre, parse_segments

CDRW = load_aircraft("cdrw")


def test_a_3211():
    manoeuvre = parse_manoeuvre("3211:elevator:amplitude=0.05:start=2:width=0.4", CDRW, rate=200.0)
    assert tuple(manoeuvre.deflections) == ("elevator", "aileron", "rudder", "throttle")
    assert manoeuvre.moved == ("elevator",)
    assert manoeuvre.duration == pytest.approx(2 + 7 * 0.4 + 3)
    expected = 0.05 * multistep(manoeuvre.time - 2, (3, 2, 1, 1), 0.4)
    assert np.array_equal(manoeuvre.deflections["elevator"], expected)
    assert np.array_equal(manoeuvre.surfaces()[:, 0], expected)
    assert manoeuvre.surfaces().shape == (manoeuvre.time.size, 3)


def test_segments_add_up_joined_or_given_one_by_one():
    parts = ["doublet:elevator:amplitude=0.1", "211:rudder:amplitude=1e-1:start=1e+1", "pulse:elevator:amplitude=-0.02"]
    joined = parse_manoeuvre(" + ".join(parts), CDRW)
    assert joined.moved == ("elevator", "rudder")
    listed = parse_manoeuvre(parts, CDRW)
    alone = [parse_manoeuvre(part, CDRW, duration=joined.duration) for part in parts]
    for name in joined.deflections:
        assert np.array_equal(joined.deflections[name], listed.deflections[name])
        assert np.allclose(joined.deflections[name], sum(one.deflections[name] for one in alone))


def test_an_amplitude_each():
    manoeuvre = parse_manoeuvre("multisine:elevator,aileron,rudder:amplitude=0.05,0.04,0.03", CDRW)
    peaks = np.abs(manoeuvre.surfaces()).max(axis=0)
    assert np.all(peaks <= [0.05, 0.04, 0.03])
    assert np.allclose(peaks, [0.05, 0.04, 0.03], rtol=0.01)


MISTAKES = [
    ("", "'' is no kind of manoeuvre"),
    ("321:elevator:amplitude=0.1", "did you mean '3211'?"),
    ("doublet:wing", "no control 'wing'; expected one of elevator, aileron, rudder, throttle"),
    ("doublet:elvator:amplitude=0.1", "did you mean 'elevator'?"),
    ("doublet:elevator,elevator:amplitude=0.1", "named twice"),
    ("doublet:elevator:amp=0.1", "'amp' is no key of doublet"),
    ("doublet:elevator:amplitude", "got 'amplitude', expected key=value"),
    ("doublet:elevator:amplitude=0.1:amplitude=0.2", "amplitude is given twice"),
    ("doublet:elevator:amplitude=big", "amplitude is 'big', expected a number"),
    ("doublet:elevator:amplitude=nan", "amplitude is 'nan', expected a number"),
    ("doublet:elevator:amplitude=0.1,0.2", "2 amplitudes for 1 controls"),
    ("doublet:elevator:amplitude=0.1:width=0", "width is 0, expected above zero (s)"),
    ("doublet:elevator:amplitude=0.1:start=-1", "start is -1, expected not negative (s)"),
    ("doublet:elevator:amplitude=0.1:repeat=1.5", "repeat is 1.5, expected a whole number"),
    (
        "doublet:elevator:amplitude=0.1:repeat=2:every=0.9",
        "every is 0.9 s, but it lasts 1 s; begin again after its end",
    ),
    ("random:elevator:amplitude=0.1:seed=1.5", "seed is 1.5, expected a whole number"),
    ("random:elevator:amplitude=0.1:seed=1e30", "seed is 1e+30, expected a whole number, at most 9.0072e+15"),
    ("doublet:elevator:amplitude=5", "elevator moves 5 rad from trim at 1.00 s, but cdrw's limit is 0.35 rad"),
    ("sweep:elevator:amplitude=0.1:low=2:high=1", "high is 1 Hz, expected more than low, 2 Hz"),
    ("sweep:elevator:amplitude=0.1:high=60", "60 Hz cannot be drawn at 100 Hz"),
    ("multisine:elevator:amplitude=0.1:length=0.1", "no harmonic of 1/0.1 s"),
    ("multisine:elevator:amplitude=0.1:length=1e9", "at most 5000000 samples"),
]


@pytest.mark.parametrize(("spec", "expected"), MISTAKES, ids=[spec for spec, _ in MISTAKES])
def test_a_mistake_gets_one_line(spec, expected):
    with pytest.raises(InputError) as caught:
        parse_manoeuvre(spec, CDRW)
    message = str(caught.value)
    assert message.startswith("manoeuvre ")
    assert expected in message
    assert "\n" not in message


def test_without_an_amplitude_it_is_a_share_of_the_limit():
    (segment,) = parse_segments("doublet:elevator,throttle:width=0.3", CDRW)
    assert segment.amplitude == (0.0525, 0.129)  # nine tenths of the 0.1438 of full throttle in level flight
    (fast,) = parse_segments("doublet:throttle", CDRW, 40.0)
    assert fast.amplitude == (0.15,)  # level flight at 40 m/s takes 0.4 of full throttle: there is room
    unlimited = replace(CDRW, throttle=replace(CDRW.throttle, max_thrust=None))
    with pytest.raises(InputError, match=r"amplitude is missing, and cdrw gives throttle no limit"):
        parse_segments("doublet:throttle", unlimited)


@pytest.mark.parametrize("spec", ["3211", "3211:width=0.5", "3211:start=1:repeat=2"])
def test_without_controls_all_surfaces_move_in_turn(spec):
    segments = parse_segments(spec, CDRW)
    assert [segment.controls for segment in segments] == [("elevator",), ("aileron",), ("rudder",)]
    manoeuvre = parse_manoeuvre(spec, CDRW)
    assert np.all((np.abs(manoeuvre.surfaces()) > 0.0).sum(axis=1) <= 1)
    assert manoeuvre.moved == ("elevator", "aileron", "rudder")
    assert parse_segments(manoeuvre.spec, CDRW) == segments


@pytest.mark.parametrize("spec", ["multisine", "random:amplitude=0.04"])
def test_kinds_that_keep_controls_apart_move_all_surfaces_at_once(spec):
    (segment,) = parse_segments(spec, CDRW)
    assert segment.controls == ("elevator", "aileron", "rudder")


def test_terms_without_controls_are_joined():
    assert len(parse_segments("3211 + multisine+doublet:rudder", CDRW)) == 5


@given(st.text(alphabet="3211doubletsweepelevator:,=+.-0123456789amplitudestart ", max_size=60))
def test_any_text_gives_a_manoeuvre_or_one_line(text):
    try:
        manoeuvre = parse_manoeuvre(text, CDRW)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.all(np.isfinite(manoeuvre.surfaces()))


def test_the_documentation_names_every_kind_and_its_examples_parse():
    page = (Path(__file__).parents[2] / "docs" / "reference" / "manoeuvres.md").read_text()
    for kind in KINDS:
        assert f"| `{kind}` |" in page
    examples = [line.strip() for line in page.split("```spec\n")[1].split("```")[0].splitlines()]
    assert len(examples) >= 4
    for example in examples:
        parse_manoeuvre(example, CDRW)


@pytest.mark.parametrize("throttle", [CDRW.throttle, None])
@pytest.mark.parametrize("spec", ["3211", "multisine"])
def test_an_aircraft_without_surfaces_is_said_with_the_users_own_text(spec, throttle):
    with pytest.raises(InputError, match=rf"^manoeuvre '{spec}': cdrw has no surfaces that it could move$"):
        parse_manoeuvre(spec, replace(CDRW, controls={}, throttle=throttle))


def test_no_control_is_expected_of_an_aircraft_without_any():
    with pytest.raises(InputError, match=r"^manoeuvre 'doublet:elevator': cdrw has no controls$"):
        parse_manoeuvre("doublet:elevator", replace(CDRW, controls={}, throttle=None))


@pytest.mark.parametrize(
    ("spec", "problem"),
    [
        ("3211:amplitude=0.5", "elevator moves 0.5 rad from trim"),
        ("3211:amplitude=0.2+doublet:elevator:amplitude=0.2", "elevator moves 0.4 rad from trim"),
        ("3211:width=0.001", "steps of 0.001 s cannot be drawn"),
        ("3211:repeat=9", "lasts until"),
    ],
)
def test_what_cannot_be_flown_is_said_with_the_users_own_text(spec, problem):
    """And not with the terms that move one control after the other, which the user did not write."""
    with pytest.raises(InputError) as caught:
        parse_manoeuvre(spec, CDRW, duration=20.0)
    assert str(caught.value).startswith(f"manoeuvre '{spec}': {problem}")
