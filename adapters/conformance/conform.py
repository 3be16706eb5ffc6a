"""The conformance suite: probes of every engine before its numbers are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from crosscheck2d.adapters.conformance.contract import CONTRACT
from crosscheck2d.adapters.conformance.physics import LAWS, PHYSICS
from crosscheck2d.adapters.conformance.probe import Probe, ProbeReading
from crosscheck2d.adapters.engine import NotLoaded, Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.friction import Frictionless
from crosscheck2d.adapters.host.process import processes_reused

PROBES: dict[str, Probe] = CONTRACT | PHYSICS | LAWS


@dataclass(frozen=True)
class Finding:
    """The result of one probe of one engine."""

    engine: str
    profile: str
    probe: str  # a key of `PROBES`, or "make" for an engine that cannot be made
    asked: str  # the question, one plain sentence
    got: float | str  # the answer, a number in the unit of the question, or words
    expected: float | str  # the answer of an engine that follows protocol and scene
    bound: float  # how far a number may be from it
    # "keeps"; "not asked": it refuses the scene of the question, and `note` says why; "departs": it
    # follows the protocol, but its physics differs from the scene; "breaks": no number of this
    # engine may be trusted
    verdict: str
    note: str = ""  # the exception or refusal, or what limits the reading
    departure: str = ""  # the law that is broken, of `Departure`, if the probe tells


def conform(name: str, row: EngineRow) -> list[Finding]:
    """One finding for each probe, in the order of `PROBES`; only the finding "make" if the engine
    cannot be made or its file cannot be loaded.

    Every exception becomes a finding: a refusal (`Unsupported`) counts as not asked, any other
    exception as a failed probe. A solver of the exercise that raises, or does not return, is a
    faulty solver and breaks no protocol: its cells fail with the same reason.
    """
    engine, profile = name.split(":")
    with processes_reused():
        try:
            row.make().close()
        except Exception as error:  # a missing library, or one that fails to start
            return [not_probed(name, type(error).__name__, str(error))]
        try:
            return [ask(engine, profile, probe, row) for probe in PROBES]
        except NotLoaded as fault:
            return [not_probed(name, "not loaded", str(fault))]


def not_probed(
    name: str, what: str, why: str, verdict: Literal["breaks", "departs"] = "breaks"
) -> Finding:
    engine, profile = name.split(":")
    question, note = "Does the engine answer?", f"{what}: {why}"
    return Finding(engine, profile, "make", question, "no", "yes", 0.0, verdict, note)


def ask(engine: str, profile: str, name: str, row: EngineRow) -> Finding:
    probe, own_file = PROBES[name], bool(row.source)  # whose values come from the harness
    excused = name in row.departs or (probe.handed_on and own_file)
    missed: str = "departs" if excused else probe.failure
    try:
        reading = probe.read(row)
        verdict = "keeps" if reading.kept else missed
    except NotLoaded:
        raise
    except Frictionless as refusal:  # a solver need not model friction
        reading = ProbeReading("not modelled", "not modelled", note=str(refusal))
        verdict = "keeps"
    except Unsupported as refusal:
        reading, verdict = ProbeReading("refused", "an answer", note=str(refusal)), "not asked"
    except Exception as error:  # an engine may raise anything; the finding records it
        reading = ProbeReading("raised", "an answer", note=f"{type(error).__name__}: {error}")
        verdict = "departs" if row.exercise else missed if own_file else "breaks"
    # `crosscheck check` says what a solver of the exercise breaks, whose e may be its own
    departure = "" if verdict == "keeps" or row.exercise else reading.departure or ""
    got, expected, bound, note, _ = reading
    return Finding(
        engine, profile, name, probe.asked, got, expected, bound, verdict, note, departure
    )
