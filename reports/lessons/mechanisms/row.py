"""Lesson 6.9: sequential impulses in a touching row."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from crosscheck2d.adapters.mechanisms.ablated import BOX2D, EXERCISE
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
    run_of,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    NO_CCD,
    PLAIN,
    ablated,
    asked,
    distances,
    lies_on,
    unswept,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario

NAMES = (NO_CCD, "pymunk:matched", PLAIN, ABLATED)
ORDERS = {"pair by pair": EXERCISE, "together": BOX2D}
GAP = 1e-6  # m, between the disks of the row that is set beside the touching one
OVERLAP = 1e-12  # m, of the disks of the other one
ROUNDING = 1e-12  # m/s: up to 5 impulses at 5 m/s, each rounded a few times in float64


def show_row(order: str, iterations: int, n: int) -> Shown:
    """The velocities after a disk has struck a row that touches."""
    makes = {**unswept(), **ablated(order=ORDERS[order], iterations=iterations, touching=True)}
    played = Simulation.by(struck(n, 0.0), NAMES, 4, makes)
    curves = played.curves(lambda each: each.velocity[-1, :, 0], np.arange(n + 1.0))
    chart = LessonChart("Velocity after the collision", "disk", "m/s", curves)
    return Shown(
        [chart],
        played.film,
        distances(chart, "m/s"),
        list(row_claims(n, order, iterations)),
        # pair by pair goes through the contacts once
        said={} if order == "together" else {"iterations": "not used pair by pair"},
    )


def struck(n: int, gap: float) -> Scenario:
    """A disk at 5 m/s strikes a row of `n` equal disks, `gap` m apart."""
    scene = lay_out(
        position=np.column_stack([[-2.01, *((1.0 + gap) * np.arange(n))], np.zeros(n + 1)]),
        velocity=[[5.0, 0.0], *[[0.0, 0.0]] * n],
        radius=0.5,
    )
    return asked(scene, 1.0)


@cache
def with_gaps(n: int) -> Array:
    """(n + 1,) m/s at the end of the exact answer to the row with gaps of `GAP`, in which no two
    collisions are simultaneous."""
    return Simulation(struck(n, GAP), ()).truth.velocity[-1, :, 0]


@cache
def overlapping(n: int) -> Array:
    """(n + 1,) m/s: what pymunk:matched makes of a row whose disks overlap by `OVERLAP`."""
    run = run_of("pymunk:matched", struck(n, -OVERLAP), 4)
    assert run.trajectory is not None
    return run.trajectory.velocity[-1, :, 0]


def row_claims(n: int, order: str, iterations: int) -> Iterator[Claim]:
    """How the 5 m/s are shared among the disks."""
    last, thrown = np.append(np.zeros(n), 5.0), overlapping(n)
    # 8 iterations over up to 5 contacts, at 5 m/s.
    single = 8 * n * 5 * FLOAT32

    def shared(shown: Shown) -> bool:
        y = shown.y(NO_CCD)
        return bool(y[0] < -1 and (y[1:] > 1).all() and abs(y.sum() - 5) < 1e-4)

    yield Claim(
        "In the exact answer the last disk takes all of the 5 m/s and the others stay.",
        lambda shown: shown.follows(TRUTH, last, 0.0),
    )
    yield Claim(
        f"With gaps of {number(1e6 * GAP)} µm between the disks the pairs collide one after the"
        " other, and the exact answer ends with the same velocities.",
        lambda shown: shown.follows(TRUTH, with_gaps(n), ROUNDING),
    )
    yield Claim(
        "reference:exercise takes one pair after the other, and ends with these velocities, too.",
        lambda shown: shown.follows(PLAIN, last, ROUNDING),
    )
    yield Claim(
        "So does pymunk:matched here, because it finds no contact between disks that just touch. If"
        f" the disks of the row overlap by {number(OVERLAP)} m, it solves their contacts together:"
        f" the first disk is thrown back at {number(-thrown[0])} m/s, and all others move on.",
        lambda shown: (
            shown.follows("pymunk:matched", last, ROUNDING)
            and bool(thrown[0] < -1 and (thrown[1:] > 1).all())
        ),
    )
    yield Claim(
        "In Box2D without CCD (+no_ccd) the first disk is thrown back and all others move on; the"
        " momentum is the same.",
        shared,
    )
    if order == "pair by pair":
        yield lies_on("pymunk:matched", True, ROUNDING, "m/s")
    if order == "together" and iterations == 50:
        together = 10 / (n + 1)  # m/s: one body of n disks, struck with e = 1
        yield Claim(
            "After 50 iterations the row of the ablated reference moves on as one body, at"
            f" {number(together)} m/s, within 1 mm/s.",
            lambda shown: shown.follows(
                ABLATED, np.append(5 - n * together, np.full(n, together)), 1e-3
            ),
        )
    else:
        yield lies_on(NO_CCD, order == "together" and iterations == 8, single, "m/s")


ROW = Lesson(
    name="row",
    number="6.9",
    title="Sequential impulses in a touching row",
    asks="What comes out of a row that touches?",
    text="""
    A disk strikes a row of disks that touch. All contacts act at the same instant, and
    mechanics does not fix the order in which the pairs collide. The exact answer takes one pair
    after the other. It tries every order, and it exists only where all orders end with the same
    velocities. Here they do: the masses are equal and e = 1, so a collision exchanges the two
    velocities.

    The exercise, too, lets one pair after the other collide. A solver of simultaneous contacts
    first fixes the separation speed of each contact: e times its closing speed, and 0 where two
    disks only touch. Then it goes through all contacts again and again, a number of
    <b>iterations</b>.
    """,
    sliders=(
        Slider("order", "Contacts", tuple(ORDERS), 0),
        Slider("iterations", "Iterations", (1, 2, 4, 8, 50), 3),
        Slider("n", "Disks in the row", (2, 3, 5), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_row,
)
