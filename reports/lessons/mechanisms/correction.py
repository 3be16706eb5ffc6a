"""Lesson 6.5: slop and position correction."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from crosscheck2d.adapters.mechanisms.ablated import BOX2D
from crosscheck2d.reports.lessons.lesson import Claim, Lesson, Shown, Simulation, Slider
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
from crosscheck2d.reports.page.style import number
from crosscheck2d.scenarios.families.placing import lay_out

NAMES = (NO_CCD, PLAIN, ABLATED)


def show_position_correction(share: float, slop: float) -> Shown:
    """How an overlap that is there at the start is undone."""
    x, still = [[0.0, 0.0], [0.8, 0.0]], np.zeros((2, 2))
    scenario = asked(
        lay_out(position=x, velocity=still, radius=0.5, mass=[np.inf, 2.0], restitution=0.0),
        0.4,
    )
    corrects = ablated(order=BOX2D, correction_most=0.2, correction_share=share, slop=slop / 1e3)
    played = Simulation.by(scenario, NAMES, 1, {**unswept(length_unit=1.0), **corrects})
    chart = played.over_time(
        "Overlap",
        "mm, 0 drawn as 0.001",
        lambda each: np.maximum(1e3 * (1.0 - each.position[:, 1, 0]), 1e-3),
        "y",
    )
    own = f"{number(1e3 * played.runs[0].settings['linear slop in m'][1])} mm"
    return Shown(
        [chart],
        played.film,
        [(f"{NO_CCD}, linear slop", own), *distances(chart, "mm")],
        list(correction_claims(share, slop)),
    )


def correction_claims(share: float, slop: float) -> Iterator[Claim]:
    """The overlap that remains of 200 mm after a step, and in the end; slop in mm."""
    own = 2.5  # mm, the slop of Box2D in a scene of metres
    single = 1e3 * 72 * FLOAT32  # mm: 24 steps, three corrections each, of coordinates up to 1 m
    left = np.array(box2d_overlaps(200.0, own, 24))
    yield Claim(
        "reference:exercise removes the overlap in the first step.",
        lambda shown: shown.y(PLAIN)[0] > 199 and shown.y(PLAIN)[1:].max() <= 1e-3,
    )
    yield Claim(
        "Box2D undoes 0.2 of what exceeds its slop of 2.5 mm, three times a step as long as the"
        f" overlap is more than three slops, and once a step from then on: {number(left[1])} mm"
        " are left after the first step, and in the end the slop and less than 0.1 mm more.",
        lambda shown: (
            np.abs(shown.y(NO_CCD) - left[: len(shown.y(NO_CCD))]).max() <= single
            and own <= shown.y(NO_CCD)[-1] < own + 0.1
        ),
    )
    yield Claim(
        f"The ablated reference never goes below its slop of {number(slop)} mm."
        if share
        else "The ablated reference undoes no share of the overlap yet: it stays at 200 mm.",
        lambda shown: (
            (np.diff(shown.y(ABLATED)) <= 0).all()
            and shown.y(ABLATED).min() >= (slop - 1e-9 if share else 200 - 1e-9)
        ),
    )
    yield lies_on(NO_CCD, (share, slop) == (0.2, own), single, "mm")


def box2d_overlaps(overlap: float, slop: float, steps: int) -> list[float]:
    """mm at the start and after each step of up to three passes; the first that begins within three
    slops is its last (b2Island::Solve, b2ContactSolver::SolvePositionConstraints of Box2D 2.3)."""
    found = [overlap]
    for _ in range(steps):
        for _ in range(3):
            before = overlap
            overlap -= 0.2 * (overlap - slop)
            if before <= 3 * slop:
                break
        found.append(overlap)
    return found


CORRECTION = Lesson(
    name="correction",
    number="6.5",
    title="Slop and position correction",
    asks="What becomes of an overlap?",
    text="""
    The exercise removes an overlap in one step, by projection. Box2D removes a share of it in
    each pass and leaves a small overlap, the <b>slop</b>, so that the disks stay in contact.
    Here a disk starts deep in a fixed disk, for which there is no exact answer. Continuous
    collision detection (CCD, see [gravity]) is off in Box2D (<code>+no_ccd</code>), because it
    removes the overlap by other means.
    """,
    sliders=(
        Slider("share", "Share undone each time", (0.0, 0.1, 0.2, 0.4), 0),
        Slider("slop", "Slop", (0.0, 1.25, 2.5, 5.0), 0, "mm"),
    ),
    names=NAMES,
    show=show_position_correction,
)
