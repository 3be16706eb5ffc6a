"""How far to trust a report: what is proven, measured, checked independently, and where the project
judges its own engines."""

from __future__ import annotations

from collections.abc import Sequence

from reports.compare.comparison import Comparison
from reports.page.style import number
from scenarios.truth.exact import CLOSED_FORM, EVENT_DRIVEN, answered_by
from scenarios.truth.oracle.numbers import has_balls


def how_far_to_trust(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """Heading -> its text for this run."""
    return {
        "Exact answers": exact_answers(comparisons),
        "How far they hold": how_far_they_hold(comparisons),
        "Measured": (
            "Everything else is measured in this run. Each engine is played with the settings that"
            " this page shows. Failures stay in the tables. A number from too few samples is marked"
            " as not judged."
        ),
        "Checked from outside": (
            "Three checks share no code with what they check: a simulation of all pairs in 420"
            " bits, plain scripts for each engine, and metrics computed again from the"
            " trajectories. uv run pytest -m independent repeats them, and"
            " tests/independent/README.md lists what has not been checked."
        ),
        "Our own engines": (
            "reference and event_driven belong to this project, which also judges them. So the"
            " exact answers import none of their code; a test checks this. The same command"
            " searches the settings of every engine, on scenes that are not scored. Solvers that"
            " stand still, gain energy or double their speed must be caught in every scene in"
            " which something moves."
        ),
    }


def exact_answers(comparisons: Sequence[Comparison]) -> str:
    """How the exact answers of these scenes were found, and how far off they may be."""
    models = [answered_by(each.scenario) if each.truth is not None else "" for each in comparisons]
    closed, event_driven, none = (
        models.count(CLOSED_FORM),
        models.count(EVENT_DRIVEN),
        models.count(""),
    )
    parts = [f"{closed} of {len(models)} scenes have a closed form"] if closed else []
    if event_driven:
        bound = max(
            c.truth.error_bound
            for c, m in zip(comparisons, models)
            if m == EVENT_DRIVEN and c.truth is not None
        )
        how = (
            "proven by interval arithmetic"
            if has_balls()
            else "computed at two precisions that agree"
        )
        parts.append(
            f"{event_driven} {'is' if event_driven == 1 else 'are'} computed from collision to"
            f" collision in many digits, {how}, and off by at most {number(bound)} m"
        )
    if none:
        parts.append(
            f"{none} {'has' if none == 1 else 'have'} no exact answer and no score: engines are"
            " checked there against the laws of physics only"
        )
    return "; ".join(parts) + "."


def how_far_they_hold(comparisons: Sequence[Comparison]) -> str:
    """The times up to which engines are compared with the exact answers of these scenes."""
    ends = {
        each.scenario.name: (each.truth.horizon, each.scenario.duration)
        for each in comparisons
        if each.truth is not None and each.truth.horizon < each.scenario.duration
    }
    if not ends:
        return "Every exact answer holds to the end of its scene."
    listed = ", ".join(
        f"{name} to {number(until)} s of {number(whole)} s" for name, (until, whole) in ends.items()
    )
    return (
        f"{listed}: later samples have no score, because a rounding of the start has grown to a"
        " billionth of a radius, or the motion has no single answer. The section of the scene says"
        " which. All other exact answers hold to the end of their scene."
    )
