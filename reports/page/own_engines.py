"""What the probes say of a reader's own engine: the laws that it breaks, in words, and what could
not be asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from crosscheck2d.adapters.conformance.laws import ALLOWED
from crosscheck2d.adapters.conformance.probe import Departure
from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.terminal.counts import listed

Finding = Mapping[str, Any]  # a row of the probes

STATED = "{got} where {expected} is stated"
# In the order in which they are named.
WORDS = {
    Departure.START: "before the first step, read differs from the scene: {got}",
    Departure.MEMORY: "state of the scene before is kept",
    Departure.DT_IGNORED: "dt is ignored",
    Departure.PATH: "a disk of {expected} m/s moves by {got} m in a second",
    Departure.SPEED: "a free disk of {expected} m/s does not keep its speed and ends at {got} m/s",
    Departure.GRAVITY_UNSTATED: "gravity acts where none is stated",
    Departure.GRAVITY_ABSENT: "gravity does not act",
    Departure.GRAVITY_AT_REST: "gravity does not act on a disk at rest",
    Departure.GRAVITY_UPWARD: "gravity acts upward",
    Departure.GRAVITY: f"gravity is {STATED} (m/s2)",
    Departure.MASSES: "momentum is not kept where masses differ",
    Departure.MOMENTUM: "momentum is not kept",
    Departure.STATIC: "a static disk moves",
    Departure.PASSES: "disks pass through each other",
    Departure.STICKS: "disks stick where e = {expected} is stated",
    Departure.RESTITUTION: f"bounces with e = {STATED}",
    Departure.BY_MASS: f"disks of different mass bounce with e = {STATED}",
    Departure.TANGENTIAL: "an off-centre collision changes the tangential velocity",
    Departure.WALL_PASSES: "disks pass through walls",
    Departure.WALL_STICKS: "disks stick to walls where e = {expected} is stated",
    Departure.WALL_RESTITUTION: f"bounces off walls with e = {STATED}",
    Departure.WALL_TANGENTIAL: "a collision with a wall changes the tangential velocity",
}
# What these change, all later readings show, so that no other cause is named beside them; and a
# wrong momentum is also that of what cannot move.
ALONE = (
    Departure.START,
    Departure.DT_IGNORED,
    Departure.PATH,
    Departure.SPEED,
    Departure.GRAVITY_UNSTATED,
)
UNMOVED = (Departure.STATIC, Departure.WALL_PASSES)
# Of an engine that breaks no law, such as one with a threshold.
PROPERTIES = {
    "slow_flight": "a free disk of {expected} m/s ends at {got} m/s",
    "fast_flight": "a free disk of {expected} m/s ends at {got} m/s",
    "fast_spin": "a spin of {expected} rad/s ends at {got} rad/s",
    "spins_freely": "a disk turns by {got} rad where its spin gives {expected}",
    "force_lasts_one_step": "a force lasts for more than one step",
    "mass_by_force": f"a force acts as on a mass of {STATED} (kg)",
    "inertia_by_torque": f"a torque acts as on an inertia of {STATED} (kg m2)",
    "friction": "friction of {got} acts where none is stated",
    "friction_at_rest": f"the friction of a sliding disk is {STATED}",
    "restitution_wall": f"off a wall that is not one of a box e is {STATED}",
    **{f"restitution_{v}": f"at {v} m/s e is {STATED}" for v in ("0.01", "0.1", "0.5", "2", "100")},
}
SCENES = {
    "gravity_is_stated": "gravity",
    "pair_keeps_e": "collisions of disks",
    "wall_keeps_e": "walls",
    "static_stays": "static disks",
}


def is_lawless(findings: Sequence[Finding]) -> bool:
    """Whether these are of a reader's own engine that breaks a law, so that it is not ranked."""
    return any(row.get("departure") and f":{row['profile']}" == OWN for row in findings)


def own_engine_sentences(findings: Sequence[Finding]) -> list[str]:
    """A sentence on a reader's own engine, which begins with its departures; none if it keeps all
    probes."""
    if not findings or f":{findings[0]['profile']}" != OWN:
        return []
    missed = {row["probe"]: row for row in findings if row["verdict"] in ("departs", "breaks")}
    broken = {row["departure"]: row for row in missed.values() if row.get("departure")}
    laws = [law for law in WORDS if law in broken]
    if set(laws) & set(ALONE):
        laws = [law for law in laws if law in (*ALONE, Departure.MEMORY)]
    if {Departure.MASSES, Departure.MOMENTUM} & set(laws):
        laws = [law for law in laws if law not in UNMOVED]
    words = [in_words(WORDS[law], broken[law]) for law in laws]
    if not laws:
        if any(row["verdict"] == "breaks" for row in missed.values()):
            return []  # it is not counted, and a sentence says why
        seen = [probe for probe in PROPERTIES if probe in missed and is_visible(missed[probe])]
        words = [in_words(PROPERTIES[probe], missed[probe]) for probe in seen]
    refused = {row["probe"] for row in findings if row["verdict"] == "not asked"}
    scenes = [scene for probe, scene in SCENES.items() if probe in refused]
    if not words and not scenes:
        return []
    name = findings[0]["engine"]
    said = f"{name}: {'; '.join(words)}." if words else f"{name} keeps the laws that were asked."
    if laws:
        said += f" It breaks {'a law' if len(laws) == 1 else 'laws'}, so it is not ranked."
    return [f"{said} Not asked, because it refuses them: {listed(scenes)}." if scenes else said]


def is_visible(row: Finding) -> bool:
    """Whether a reading is a number, and off by more than a law allows."""
    got, expected = row["got"], row["expected"]
    if isinstance(got, str) or isinstance(expected, str):
        return False
    return not abs(got - expected) <= ALLOWED * (abs(expected) or 1.0)


def in_words(text: str, row: Finding) -> str:
    """The text with the two numbers of a row."""
    got = row["got"] if isinstance(row["got"], str) else round(row["got"], 9)  # 0 for 4e-15
    return text.format(got=number(got, 2), expected=number(row["expected"], 2))
