"""One open page of the game: what it answers, and what it reports of a scene that is flown
again."""

from __future__ import annotations

from math import cos, sin

import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.game.flight import SHIP
from crosscheck2d.reports.game.session import Session, read_message
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "null",
        "[]",
        "1e999",
        '{"do": "fly"}',
        '{"do": "jump"}',
        '{"do": "frames", "count": 5}',
        '{"do": "frames", "count": 1.5}',
        '{"do": "frames", "count": "1"}',
        '{"do": "frames", "count": 1, "more": 2}',
        '{"do": "key", "key": "q", "down": true}',
        '{"do": "key", "key": "w", "down": 1}',
        '{"do": "fly", "engines": []}',
        '{"do": "fly", "engines": ["nobody"]}',
        '{"do": "fly", "engines": ["reference:exercise"], "restitution": 1.5}',
        '{"do": "fly", "engines": ["reference:exercise"], "asteroids": 1000000}',
        '{"do": "fly", "engines": ["reference:exercise"], "seed": -1}',
        '{"do": "save"' + " " * 5000 + "}",
        b"\xff\xfe\x00",
        "[" * 3000,
    ],
)
def test_a_malformed_message_is_reported_in_a_sentence(text: str | bytes):
    with pytest.raises(ValueError, match=r"\w{3,}"):
        read_message(text)


def test_saving_before_flying_is_reported():
    with pytest.raises(ValueError, match="nothing has been flown"):
        Session(["reference:exercise"]).answer('{"do": "save"}')


def test_another_scene_with_a_wrap_is_played_as_the_harness_plays_it():
    scene = lay_out(position=[[3.0, 1.5]], velocity=[1.0, 0.0], wrap=[[0, 0], [4, 3]])
    scenario = Scenario("through-the-edge", "Does it come back?", "", scene, 6.0, 0.125)
    session = Session(["reference:exercise"], scenario)
    session.flight.advance(scenario.intervals)
    run = play(
        ENGINES["reference:exercise"].make(), "reference:exercise", scenario, session.flight.dt
    )
    reported = session.now()

    assert run.trajectory is not None
    assert session.flight.solid.state.position.tolist() == run.trajectory.position[-1].tolist()
    assert (reported["set_back"], reported["won"], session.field()["earth"]) == (None, False, None)


def test_the_flame_is_against_a_thrust_that_turns_with_the_ship():
    whole = SCENARIOS["body_frame_thrust"]
    session = Session(["reference:exercise"], whole)
    [thrust] = whole.thrusts
    x, y = thrust.force
    session.flight.advance(20)
    angle = float(session.flight.solid.state.angle[SHIP])

    assert thrust.frame == "body"
    assert abs(angle) > 0.1
    assert session.force()[:2] == pytest.approx(
        [cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y]
    )
