"""Lesson 6.9: sequential impulses in a touching row."""

from __future__ import annotations

import numpy as np

from adapters.mechanisms.ablated import BOX2D, EXERCISE, AblatedReference
from reports.lessons.lesson import Claim, Curve, LessonChart, Settings, Shown, Slider
from reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    PLAIN,
    asked,
    distances,
    filmed,
    follows,
    lies_on,
    over,
    page,
    runs_of,
)
from reports.page.style import TRUTH, number
from scenarios.families.placing import lay_out


def show_row(settings: Settings) -> Shown:
    """The velocities after a disk has struck a row that touches."""
    n = settings["n"]
    scene = lay_out(
        position=np.column_stack([[-2.01, *range(n)], np.zeros(n + 1)]),
        velocity=[[5.0, 0.0], *[[0.0, 0.0]] * n],
        radius=np.full(n + 1, 0.5),
        mass=np.ones(n + 1),
        restitution=1.0,
    )
    scenario = asked(scene, 1.0)
    order = {"pair by pair": EXERCISE, "together": BOX2D}[settings["order"]]
    names = ["box2d:matched", "pymunk:matched"]
    runs = runs_of(
        names,
        AblatedReference(order, iterations=settings["iterations"], touching=True),
        scenario,
        4,
    )
    curves = over(np.arange(n + 1.0), runs, lambda each: each.velocity[-1, :, 0])
    facts = distances(runs, curves, "m/s")
    film = filmed(scenario, runs)
    assert film.truth is not None
    curves.append(Curve(TRUTH, np.arange(n + 1.0), film.truth.velocity[-1, :, 0]))
    chart = LessonChart("Velocity after the collision", "disk", "m/s", curves)
    return Shown([chart], film, facts, row_claims(n, settings["order"], settings["iterations"]))


def row_claims(n: int, order: str, iterations: int) -> list[Claim]:
    """Who gets what of 5 m/s."""
    last = np.append(np.zeros(n), 5.0)
    # 8 iterations over up to 5 contacts, at 5 m/s.
    single = 8 * n * 5 * FLOAT32

    def shared(shown: Shown) -> bool:
        y = shown.y("box2d:matched")
        return bool(y[0] < -1 and (y[1:] > 1).all() and abs(y.sum() - 5) < 1e-4)

    claims = [
        Claim(
            "In the exact answer the last disk takes all of the 5 m/s and the others stay.",
            follows(TRUTH, last, 0.0),
        ),
        Claim(
            "So it is with the solvers that take one pair after the other, reference:exercise and"
            " pymunk:matched.",
            lambda shown: all(
                follows(name, last, 1e-12)(shown) for name in (PLAIN, "pymunk:matched")
            ),
        ),
        Claim(
            "In Box2D the first disk is thrown back and all others move on; the momentum is the"
            " same.",
            shared,
        ),
    ]
    if order == "pair by pair":
        claims.append(lies_on("pymunk:matched", True, 1e-12, "m/s"))
    if order == "together" and iterations == 50:
        together = 10 / (n + 1)  # m/s: one body of n disks, struck with e = 1
        claims.append(
            Claim(
                "After 50 iterations the row of the ablated reference moves on as one body, at"
                f" {number(together)} m/s, within 1 mm/s.",
                follows(ABLATED, np.append(5 - n * together, np.full(n, together)), 1e-3),
            )
        )
    else:
        claims.append(
            lies_on("box2d:matched", order == "together" and iterations == 8, single, "m/s")
        )
    return claims


ROW = page(
    9,
    "row",
    "Sequential impulses in a touching row",
    "What comes out of a row that touches?",
    "A disk strikes a row of disks that touch. The exercise lets one pair after the other"
    " collide. A solver of simultaneous contacts first fixes what each contact shall become: e"
    " times its closing speed, and 0 where two disks only touch. Then it goes through all"
    " contacts again and again, a number of <b>iterations</b>.",
    ["box2d:matched", "pymunk:matched"],
    show_row,
    Slider("order", "Contacts", ("pair by pair", "together"), 0),
    Slider("iterations", "Iterations", (1, 2, 4, 8, 50), 3),
    Slider("n", "Disks in the row", (2, 3, 5), 1),
)
