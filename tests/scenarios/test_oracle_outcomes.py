"""Where contacts come at once: one outcome is the truth, several are all reported; and where the
oracle has no answer."""

from __future__ import annotations

from dataclasses import replace

import gmpy2
import numpy as np
import pytest

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.exact import computed, with_oracle
from crosscheck2d.scenarios.truth.oracle import contact_finder
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr
from crosscheck2d.scenarios.truth.oracle.ties import CollisionLaw, Contact, Touch
from crosscheck2d.scenarios.truth.record import TruthRecord
from tests.scenarios.test_oracle import asked, states

ROW = lay_out([[-2, 0], [0, 0], [0.5, 0], [1, 0]], [[1, 0], [0, 0], [0, 0], [0, 0]])


def test_contacts_that_touch_are_resolved_one_after_the_other_where_only_one_approaches():
    one = asked(ROW, 3.0)
    truth = states(one, computed(one))

    assert truth.collisions.t.tolist() == [1.5, 1.5, 1.5]
    np.testing.assert_allclose(
        truth.velocity[-1], [[0, 0], [0, 0], [0, 0], [1, 0]], rtol=0, atol=1e-15
    )


def test_a_corner_at_a_right_angle_has_one_outcome():
    scene = lay_out([[0, 0]], [1, 1], radius=0.5, walls=box([-2, -2], [2, 2]), restitution=0.5)
    one = asked(scene, 2.5)
    truth = states(one, computed(one))

    assert truth.collisions.t.tolist() == [1.5, 1.5]
    assert truth.velocity[-1, 0].tolist() == [-0.5, -0.5]


BREAK = lay_out(
    [[-2, 0], [np.sqrt(0.75), 0.5], [np.sqrt(0.75), -0.5]], [[1, 0], [0, 0], [0, 0]], radius=0.5
)
BALL = lay_out([[0, 1], [0, 2]], walls=[[[-9, 0], [9, 0]]], gravity=[0, -9.81], restitution=0.1)
ASIDE = replace(BALL, position=[[0, 1], [0.03, 2]])
SEAM = lay_out([[1.5, 0], [-1.8, 0.1]], [[1, 0], [0, 0]], radius=0.3, wrap=[[-2, -2], [2, 2]])


@pytest.mark.parametrize(
    ("scene", "until", "reason"),
    [
        (
            BREAK,
            2.0,
            (
                "disks 0, 1, 2 touch at once and the outcome depends on the order of their"
                " collisions (2 outcomes)"
            ),
        ),
        # The lower one rests when the upper one arrives, and is its place to roll over.
        (ASIDE, None, "disk 1 rolls over disk 0"),
        (SEAM, 0.5, "disk 0 re-enters over the edge of the wrap onto disk 1 at t = 0.5 s"),
    ],
)
def test_the_truth_ends_where_there_is_no_more_of_it(
    scene: Scene, until: float | None, reason: str
):
    one = asked(scene, 4.0)
    record = computed(one)

    assert reason in record.reason
    if until is not None:
        assert record.horizon == pytest.approx(until, rel=1e-15)
        assert f"at t = {until:.4g}"[:10] in record.reason
    assert states(one, record).t[-1] <= record.horizon
    assert states(one, record).reason == record.reason


CROWD = lay_out(np.arange(402).reshape(201, 2), radius=0.1)


@pytest.mark.parametrize(
    ("one", "reason"),
    [
        (
            asked(replace(ROW, position=ROW.position * [0.9, 1])),
            "disk 1 and disk 2 overlap by 0.05 m at the start",
        ),
        (
            asked(replace(BALL, position=[[0, 0.1], [0, 2]])),
            "disk 0 and wall 0 overlap by 0.15 m at the start",
        ),
        (
            asked(replace(ROW, position=ROW.position * [1 - 2**-47, 1])),
            r"overlap by \d\.?\d*e-15 m at the start",
        ),
        (asked(CROWD), "201 disks are more than the 200"),
        (asked(replace(SEAM, radius=[1e-9, 1])), "a radius of 1e-09 m is below 1e-06 m"),
        (
            asked(replace(BALL, velocity=[[1e9, 0], [0, 0]])),
            r"the largest velocity is 1e\+09 \(SI\), above 1e\+06",
        ),
    ],
)
def test_what_it_cannot_do_is_refused(one: Scenario, reason: str):
    with pytest.raises(NoTruth, match=reason):
        computed(one)


def ends(record: TruthRecord) -> list[dict[int, tuple[float, float]]]:
    return [
        {int(i): (vx, vy) for _, i, vx, vy in record.outcomes[record.outcomes[:, 0] == k].tolist()}
        for k in sorted({*record.outcomes[:, 0]})
    ]


def row(
    speeds: list[float], mass: list[float], restitution: float = 1.0, gaps: tuple[float, ...] = ()
) -> Scene:
    """Disks of radius 0.25 on a line, touching but for `gaps` before the second, the third ..."""
    steps = 0.5 + np.array([*gaps, *[0.0] * (len(speeds) - 1 - len(gaps))])
    x = np.append(0.0, np.cumsum(steps))
    return lay_out(
        np.stack([x, 0 * x], -1), np.stack([speeds, 0 * x], -1), mass=mass, restitution=restitution
    )


def test_the_break_shot_has_two_outcomes_and_each_comes_with_its_collisions():
    # the cue ends with (-1/8, -+0.2165); the second target, collision first, with (3/4, 0.433)
    one = asked(BREAK, 4.0)
    record = computed(one)
    found = sorted(ends(record), key=lambda end: end[0][1])

    assert len(found) == 2
    for end, mirror, first in zip(found, (1, -1), (1, 2)):
        np.testing.assert_allclose(end[0], (-1 / 8, -mirror * np.sqrt(3) / 8), rtol=0, atol=1e-15)
        np.testing.assert_allclose(end[first], (0.75, mirror * np.sqrt(3) / 4), rtol=0, atol=1e-15)
        np.testing.assert_allclose(
            end[3 - first], (0.375, -mirror * np.sqrt(3) / 8), rtol=0, atol=1e-15
        )
    for k in (0, 1):
        assert {*map(tuple, record.orders[record.orders[:, 0] == k, 1:].tolist())} <= {
            (0, 1),
            (0, 2),
            (1, 0),
            (2, 0),
        }
    assert states(one, record).t[-1] < record.horizon  # none of them is scored


def test_a_squeeze_of_unequal_masses_has_two_outcomes():
    record = computed(asked(row([1, 0, -1], [1, 3, 1], gaps=(1.0, 1.0)), 2.0))
    found = sorted([end[i][0] for i in range(3)] for end in ends(record))

    np.testing.assert_allclose(found, [[-1.25, 0.25, 0.5], [-0.5, -0.25, 1.25]], rtol=0, atol=1e-15)


@pytest.mark.parametrize(("coming", "outcomes"), [(1, (8, 8)), (2, (22, 24))])
def test_a_cradle_that_loses_energy_has_many_outcomes(coming: int, outcomes: tuple[int, int]):
    gaps = tuple(float(k + 1 == coming) for k in range(coming))
    record = computed(asked(row([1.0] * coming + [0.0] * (5 - coming), [1] * 5, 0.9, gaps), 2.0))
    spread = np.ptp([[end[i][0] for i in end] for end in ends(record)], axis=0).max()

    assert outcomes[0] <= len(ends(record)) <= outcomes[1]
    assert spread == pytest.approx({1: 3e-5, 2: 4e-3}[coming], rel=0.3)


def test_taking_the_collisions_of_a_chain_as_they_come_is_caught(monkeypatch: pytest.MonkeyPatch):
    # the planted bug: each collision by itself
    one = asked(row([1.0, 0, 0, 0, 0], [1] * 5, 0.9, (1.0,)), 2.0)
    assert len(ends(computed(one))) == 8
    monkeypatch.setattr(contact_finder.ContactFinder, "alone", lambda *_: True)
    assert computed(one).reason == ""


@pytest.mark.parametrize("coming", [1, 2])
def test_a_cradle_that_keeps_its_energy_has_one(coming: int):
    gaps = tuple(float(k + 1 == coming) for k in range(coming))
    one = asked(row([1.0] * coming + [0.0] * (5 - coming), [1] * 5, 1.0, gaps), 2.0)
    record = computed(one)

    assert (record.reason, len(record.outcomes)) == ("", 0)
    assert states(one, record).velocity[-1, :, 0].tolist() == [0.0] * (5 - coming) + [1.0] * coming


@pytest.mark.parametrize(
    ("degrees", "restitution", "outcomes"),
    [
        (90, 0.5, 1),
        (90, 1.0, 1),
        (60, 1.0, 1),
        (45, 1.0, 1),
        (72, 1.0, 2),
        (50, 1.0, 2),
        (60, 0.5, 2),
    ],
)
def test_a_wedge_of_a_whole_part_of_180_degrees_has_one_outcome(
    degrees: int, restitution: float, outcomes: int
):
    k = mpfr(256)
    with k.precise():
        angle = gmpy2.const_pi() * degrees / 180
        one, zero = gmpy2.mpfr(1), gmpy2.mpfr(0)
        touches = [
            Touch(Contact("wall", 0, 0, 1), zero, -one),
            Touch(Contact("wall", 0, 1, 1), -gmpy2.sin(angle), gmpy2.cos(angle)),
        ]
        found = CollisionLaw(k, [one], k.exact(restitution), False).outcomes(
            touches, {0: (k.exact(-1.0), k.exact(-0.3), k.exact(0.0))}
        )[0]

    assert len(found) == outcomes
    assert all(end.velocities for end in found)


TILTED = lay_out(
    [[0, 1]],
    radius=0.5,
    gravity=[0, -9.81],
    restitution=0.5,
    walls=[[[-3, 2.25], [0, 0]], [[0, 0], [3, 2.25]]],
)


def test_what_can_still_be_said_is_said():
    flat, wedge = (computed(asked(scene, 4.0)) for scene in (ASIDE, TILTED))

    assert any(
        "lie along (1, 0), so their momentum in that direction, 0 N s, is conserved" in said
        for said in flat.remains
    )
    assert any("their kinetic energy" in said and "can only fall" in said for said in flat.remains)
    assert wedge.reason
    assert len(wedge.remains) == 1


def test_past_its_horizon_the_truth_is_cut():
    for one, reason in (
        (with_oracle(asked(BREAK, 4.0)), "(2 outcomes)"),
        (scenario("disk_between_static_disks"), "the unstable orbit"),
    ):
        until = one.truth(one.times).horizon
        before, after = np.array([0.0, until * 0.99]), np.array([until * 1.01])

        assert len(one.truth(np.append(before, after))) == 2
        assert len(one.truth(after)) == 0
        assert reason in one.truth(before).reason
    with pytest.raises(ValueError, match="is known up to 4 s"):
        with_oracle(asked(BREAK, 4.0)).truth(np.array([5.0]))


def test_what_is_said_of_one_disk_is_said_in_the_singular():
    record = computed(asked(TILTED, 4.0))
    assert record.reason.startswith("disk 0 touches several walls at once and the outcome")
    assert record.remains[-1].startswith("disk 0: its kinetic energy, ")
