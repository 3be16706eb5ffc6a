"""What the probes say of a reader's own engines: the laws that they break, in words, and what could
not be asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from adapters.conformance.laws import ALLOWED
from adapters.conformance.physics import SPEEDS
from adapters.conformance.probe import Departure
from adapters.engines import OWN
from reports.page.style import number
from reports.terminal.counts import listed

Finding = Mapping[str, Any]  # a row of the probes

# In the order in which they are named; {got} and {expected} are of the finding.
WORDS = {
    Departure.MEMORY: "state of the scene before is kept",
    Departure.DT_IGNORED: "dt is ignored",
    Departure.PATH: "a disk of {expected} m/s moves by {got} m in a second",
    Departure.SPEED: "a free disk of {expected} m/s does not keep its speed and ends at {got} m/s",
    Departure.GRAVITY_UNSTATED: "gravity acts where none is stated",
    Departure.GRAVITY_ABSENT: "gravity does not act",
    Departure.GRAVITY_UPWARD: "gravity acts upward",
    Departure.GRAVITY_DIRECTION: "gravity acts along {got} m/s2 where {expected} is stated",
    Departure.GRAVITY_SIZE: "gravity is {got} m/s2 where {expected} is stated",
    Departure.MASSES: "momentum is not kept where masses differ",
    Departure.MOMENTUM: "momentum is not kept",
    Departure.STATIC: "a static disk moves",
    Departure.PASSES: "disks pass through each other",
    Departure.STICKS: "disks stick where e = {expected} is stated",
    Departure.RESTITUTION: "bounces with e = {got} where {expected} is stated",
    Departure.RESTITUTION_BY_MASS: (
        "disks of different mass bounce with e = {got} where {expected} is stated"
    ),
    Departure.TANGENTIAL: "an off-centre collision changes the tangential velocity",
    Departure.WALL_PASSES: "disks pass through walls",
    Departure.WALL_STICKS: "disks stick to walls where e = {expected} is stated",
    Departure.WALL_RESTITUTION: "bounces off walls with e = {got} where {expected} is stated",
    Departure.WALL_TANGENTIAL: "a collision with a wall changes the tangential velocity",
}
# What these change, all later readings show, so that no other cause is named beside them; and a
# wrong momentum is also that of what cannot move.
ALONE = (Departure.DT_IGNORED, Departure.PATH, Departure.SPEED, Departure.GRAVITY_UNSTATED)
UNMOVED = (Departure.STATIC, Departure.WALL_PASSES)
# Of an engine that breaks no law: a probe -> what it reads.
PROPERTIES = {
    "slow_flight": "a free disk of {expected} m/s ends at {got} m/s",
    "fast_flight": "a free disk of {expected} m/s ends at {got} m/s",
    "same_instant": "where a speed is {expected} m/s, {got} m/s is read",
    "fast_spin": "a spin of {expected} rad/s ends at {got} rad/s",
    "spins_freely": "a disk turns by {got} rad where its spin gives {expected}",
    "force_lasts_one_step": "a force lasts for more than one step",
    "mass_by_force": "a force acts as on {got} kg where {expected} is stated",
    "inertia_by_torque": "a torque acts as on {got} kg m2 where {expected} is stated",
    "friction": "friction of {got} acts where none is stated",
    "friction_at_rest": "friction of {got} acts where {expected} is stated",
}
SCENES = {
    "gravity_is_stated": "gravity",
    "pair_keeps_e": "collisions of disks",
    "wall_keeps_e": "walls",
    "static_stays": "static disks",
}


def is_lawless(findings: Sequence[Finding]) -> bool:
    """Whether these are of a reader's own engine that breaks a law, so that it is not ranked."""
    return any(row.get("departure") and row["profile"] == OWN.strip(":") for row in findings)


def own_engine_sentences(findings: Sequence[Finding]) -> list[str]:
    """A sentence for a reader's own engine: its departures, or nothing if it keeps all probes."""
    if not findings or findings[0]["profile"] != OWN.strip(":"):
        return []
    missed = {row["probe"]: row for row in findings if row["verdict"] in ("departs", "breaks")}
    broken = {row["departure"]: row for row in missed.values() if row.get("departure")}
    laws = [law for law in WORDS if law in broken]
    if any(law in ALONE for law in laws):
        laws = [law for law in laws if law in (*ALONE, Departure.MEMORY)]
    if Departure.MASSES in laws or Departure.MOMENTUM in laws:
        laws = [law for law in laws if law not in UNMOVED]
    words = [WORDS[law].format(**in_words(broken[law])) for law in laws] or properties(missed)
    refused = {row["probe"] for row in findings if row["verdict"] == "not asked"}
    scenes = [scene for probe, scene in SCENES.items() if probe in refused]
    if not words and not scenes:
        return []
    name = findings[0]["engine"]
    said = f"{name}: {'; '.join(words)}." if words else f"{name} keeps the laws that were asked."
    if laws:
        said += f" It breaks {'a law' if len(laws) == 1 else 'laws'}, so it is not ranked."
    return [f"{said} Not asked, because it refuses them: {listed(scenes)}." if scenes else said]


def properties(missed: Mapping[str, Finding]) -> list[str]:
    """The departures of an engine that breaks no law, such as a threshold."""
    visible = {probe: row for probe, row in missed.items() if is_visible(row)}
    words = [
        PROPERTIES[probe].format(**in_words(visible[probe]))
        for probe in PROPERTIES
        if probe in visible
    ]
    speeds: dict[str, list[str]] = {}
    for speed in SPEEDS:
        if row := visible.get(f"restitution_{speed:g}"):
            e = "e = {got} where {expected} is stated".format(**in_words(row))
            speeds.setdefault(e, []).append(f"{speed:g}")
    return [*words, *(f"collisions at {listed(at)} m/s have {e}" for e, at in speeds.items())]


def is_visible(row: Finding) -> bool:
    """Whether a reading is a number, and off by more than a law allows."""
    got, expected = row["got"], row["expected"]
    if isinstance(got, str) or isinstance(expected, str):
        return False
    return not abs(got - expected) <= ALLOWED * (abs(expected) or 1.0)


def in_words(row: Finding) -> dict[str, str]:
    """The two numbers of a row, as text."""
    return {key: number(row[key], 2) for key in ("got", "expected")}
