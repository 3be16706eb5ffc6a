"""An engine is played once and closed; where a collision begins in the impulses that it reports of,
step by step."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crosscheck2d.adapters.engine import ContactImpulse, Engine, NotStarted, Unsupported
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play, play_once
from crosscheck2d.adapters.run import first_collisions
from crosscheck2d.scenarios.catalogue import scenario

NAME, SCENE = "reference:exercise", scenario("slow_collision")
DT = SCENE.dt(SCENE.substeps[0])


class Closing:
    def __init__(self, raises: Exception | None = None) -> None:
        self.inner, self.raises, self.closed = ENGINES[NAME].make(), raises, 0

    def load(self, scene: Any, dt: float) -> None:
        if self.raises:
            raise self.raises
        self.inner.load(scene, dt)

    def close(self) -> None:
        self.closed += 1
        self.inner.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


def once(engine: Closing) -> str:
    return play_once(lambda: cast(Engine, engine), NAME, SCENE, DT).status


def test_an_engine_that_is_played_once_is_closed_once_whatever_it_does():
    for raises, status in (
        (None, "ok"),
        (Unsupported("no"), "unsupported"),
        (ValueError("no"), "error"),
    ):
        engine = Closing(raises)
        assert once(engine) == status
        assert engine.closed == 1
    for outside in (MemoryError(), NotStarted("no")):
        engine = Closing(outside)
        with pytest.raises(type(outside)):
            once(engine)
        assert engine.closed == 1
    engine = Closing()
    assert play(cast(Engine, engine), NAME, SCENE, DT).status == "ok"
    assert engine.closed == 0  # negative control: `play` leaves that to who made the engine


def test_no_source_file_closes_an_engine_by_hand():
    # The engines of the game and the gases outlive a function; else it is `play_once` or `closing`.
    root = Path(__file__).parents[2]
    found = {
        path.relative_to(root).as_posix()
        for folder in ("adapters", "reports", "scenarios")
        for path in [*(root / folder).rglob("*.py"), *(root / folder).rglob("*.md")]
        if "out" not in path.parts and "engine.close()" in path.read_text(encoding="utf-8")
    }

    assert found == {"reports/game/flight.py", "reports/speed/sizes.py"}


def test_weight_in_consecutive_steps_is_one_collision_and_collisions_are_each_their_own():
    collisions = [
        ContactImpulse(3, 1, 0, 2.0),
        ContactImpulse(4, 0, 1, 1.0),
        ContactImpulse(5, 1, 0, 1.0),
        ContactImpulse(7, 0, 1, 4.0),
        ContactImpulse(4, -1, 0, 8.0),
    ]
    found = first_collisions(collisions, 0.5, weight=1.0)
    assert len(first_collisions(collisions, 0.5)) == 5
    assert (
        len(first_collisions([*collisions, ContactImpulse(9, 0, 1, 1e-9)], 0.5)) == 5
    )  # a rounding of the impulses above
    assert found.t.tolist() == [2.0, 2.5, 4.0]
    assert list(zip(found.i.tolist(), found.j.tolist())) == [(0, 1), (0, -1), (0, 1)]
    assert found.impulse.tolist() == [2.0, 8.0, 4.0]
    assert len(first_collisions([], 0.5)) == 0


@settings(derandomize=True)
@given(
    st.sets(
        st.tuples(st.integers(0, 12), st.sampled_from([(0, 1), (0, 2), (1, 2), (1, -1), (1, -2)]))
    )
)
def test_collisions_are_the_beginnings_of_runs_of_impulses(impulses):
    rows = sorted((step, pair) for step, pair in impulses)
    found = first_collisions(
        [ContactImpulse(step, *pair, 1.0) for step, pair in rows], 1.0, weight=1.0
    )
    begins = {(step + 1.0, *pair) for step, pair in impulses if (step - 1, pair) not in impulses}
    assert set(zip(found.t.tolist(), found.i.tolist(), found.j.tolist())) == begins
    assert (np.diff(found.t) >= 0).all()


def test_a_negative_impulse_is_a_collision_too():
    negative = [ContactImpulse(3, 0, 1, -2.0), ContactImpulse(9, 0, 1, -1.0)]
    found = first_collisions([*negative, ContactImpulse(20, 0, 1, -1e-9)], 0.5)

    assert found.t.tolist() == [2.0, 5.0]
    assert found.impulse.tolist() == [-2.0, -1.0]
