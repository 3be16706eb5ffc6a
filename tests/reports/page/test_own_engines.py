"""The sentence of a reader's own engine begins with what it does otherwise than the scene says, and
an engine that breaks a law is not ranked."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from crosscheck2d.adapters.conformance.conform import ask
from crosscheck2d.adapters.conformance.physics import LAWS
from crosscheck2d.adapters.conformance.probe import Departure
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.host.engine import TEMPLATES, row_of_file
from crosscheck2d.adapters.host.process import processes_reused
from crosscheck2d.reports.page.findings import WORDS, is_lawless, own_engine_sentences
from tests.reports.terminal.command_line import crosscheck
from tests.thinned import thinned

PROBES = (*LAWS, "order_and_shapes", "load_forgets", "static_stays", "pair_momentum")
# As a stranger writes one: disks and gravity alone, no rotation, no walls, no list of collisions.
BARE = """
const models = "disks gravity";
const create = (s, dt) => ({ g: s.gravity, e: s.restitution, b: s.position.map((p, i) => ({
  x: p[0], y: p[1], u: s.velocity[i][0], v: s.velocity[i][1], r: s.radius[i], m: s.mass[i] })) });
function step(w, dt) {
  for (const a of w.b) { a.u += w.g[0] * dt; a.v += w.g[1] * dt; a.x += a.u * dt; a.y += a.v * dt; }
  for (let i = 0; i < w.b.length; i++) for (let j = i + 1; j < w.b.length; j++) {
    const a = w.b[i], c = w.b[j], d = Math.hypot(c.x - a.x, c.y - a.y);
    if (d > a.r + c.r) continue;
    const nx = (c.x - a.x) / d, ny = (c.y - a.y) / d, vn = (c.u - a.u) * nx + (c.v - a.v) * ny;
    if (vn > 0) continue;
    const J = -(1 + w.e) * vn / (1 / a.m + 1 / c.m);
    a.u -= J * nx / a.m; a.v -= J * ny / a.m; c.u += J * nx / c.m; c.v += J * ny / c.m;
  }
}
const read = (w) => ({
  position: w.b.map((a) => [a.x, a.y]), velocity: w.b.map((a) => [a.u, a.v]) });
"""
TEMPLATE = TEMPLATES["javascript"].read_text()
IMPULSE = "-(1 + world.e) * closing / light"
Change = tuple[str, str]
FAULTS: dict[str, tuple[str, list[Change], str]] = {
    "gravity upside down": (BARE, [("a.v += w.g[1]", "a.v -= w.g[1]")], "gravity acts upward."),
    "no test of approach": (
        BARE,
        [("    if (vn > 0) continue;\n", "")],
        "disks stick where e = 0.9 is stated.",
    ),
    "its own dt": (BARE, [("function step(w, dt) {", "$&\n  dt = 1 / 60;")], "dt is ignored."),
    "speeds per frame": (
        BARE,
        [("a.x += a.u * dt; a.y += a.v * dt", "a.x += a.u / 60; a.y += a.v / 60")],
        "dt is ignored.",
    ),
    "a frame rate twice": (
        BARE,
        [("a.x += a.u * dt; a.y += a.v * dt", "a.x += a.u * dt * 60; a.y += a.v * dt * 60")],
        "a disk of 1.5 m/s moves by 90 m in a second.",
    ),
    "no normal": (
        BARE,
        [("a.u -= J * nx / a.m; a.v -= J * ny / a.m; c.u += J * nx / c.m; c.v += J * ny / c.m;",
          "for (const k of ['u', 'v']) { const P = (1 + w.e) * (c[k] - a[k]) / (1 / a.m + 1 / c.m);"
          " a[k] += P / a.m; c[k] -= P / c.m; }")],
        "an off-centre collision changes the tangential velocity.",
    ),
    "masses exchanged": (
        BARE,
        [("J * nx / a.m; a.v -= J * ny / a.m", "J * nx / c.m; a.v -= J * ny / c.m"),
         ("J * nx / c.m; c.v += J * ny / c.m", "J * nx / a.m; c.v += J * ny / a.m")],
        "momentum is not kept where masses differ.",
    ),
    "one disk changes": (BARE, [(" c.u += J * nx / c.m; c.v += J * ny / c.m;", "")],
                         "momentum is not kept; "),
    "velocities exchanged": (
        BARE,
        [("    const J", "    [a.u, c.u, a.v, c.v] = [c.u, a.u, c.v, a.v]; continue;\n$&")],
        "momentum is not kept where masses differ; bounces with e = 1 where 0.9 is stated; "
        "an off-centre collision changes the tangential velocity.",
    ),
    "a list of all scenes": (
        BARE,
        [("const create", "const all = [];\n$&"),
         ("b: s.position.map", "b: ((l) => (all.push(...l), all))(s.position.map"),
         ("m: s.mass[i] })) })", "m: s.mass[i] }))) })")],
        "state of the scene before is kept.",
    ),
    "e of the first scene": (
        BARE,
        [("const create", "let E;\n$&"), ("e: s.restitution", "e: E ??= s.restitution")],
        "state of the scene before is kept.",
    ),
    "air": (BARE, [("a.x += a.u", "a.u *= 0.999; a.v *= 0.999; $&")],
            "a free disk of 1.5 m/s does not keep its speed and ends at 1.2 m/s."),
    "gravity of its own": (BARE, [("w.g[1]", "-9.81")], "gravity acts where none is stated."),
    "its own e": (BARE, [("e: s.restitution", "e: 0.9")],
                  "bounces with e = 0.9 where 0.5 is stated."),
    "energy added": (BARE, [("-(1 + w.e) * vn", "-(1 + w.e) * 1.05 * vn")],
                     "bounces with e = 0.99 where 0.9 is stated."),
    "no e at walls": (
        TEMPLATE,
        [(IMPULSE, "-(1 + (j < 0 ? 1 : world.e)) * closing / light")],
        "bounces off walls with e = 1 where 0.9 is stated.",
    ),
    "turned back by walls": (
        TEMPLATE,
        [("  const impulse", "  if (j < 0) { a.u *= -world.e; a.v *= -world.e; return; }\n$&")],
        "a collision with a wall changes the tangential velocity.",
    ),
    "all speeds damped at walls": (
        TEMPLATE,
        [("  const impulse", "  if (j < 0) { a.u = world.e * (a.u - 2 * closing * nx);"
          " a.v = world.e * (a.v - 2 * closing * ny); return; }\n$&")],
        "a collision with a wall changes the tangential velocity.",
    ),
    "atan for atan2": (
        BARE,
        [("const nx = (c.x - a.x) / d, ny = (c.y - a.y) / d", "const way = Math.atan((c.y - a.y) /"
          " ((c.x - a.x) || 1e-9)), nx = Math.cos(way), ny = Math.sin(way)")],
        "disks pass through each other.",
    ),
    "a cap on speed": (
        BARE,
        [("a.x += a.u", "a.u = Math.max(-8, Math.min(8, a.u)); $&")],
        "a free disk of 10 m/s does not keep its speed and ends at 8 m/s.",
    ),
    "slow disks are stopped": (
        BARE,
        [("a.x += a.u", "if (Math.hypot(a.u, a.v) < 0.2) a.u = a.v = 0; $&")],
        "gravity does not act on a disk at rest.",
    ),
    "read upside down": (
        BARE,
        [("[a.x, a.y])", "[a.x, -a.y])")],
        "before the first step, read differs from the scene: position of disk ",
    ),
    "half of an overlap each": (
        TEMPLATE,
        [("nx * overlap * d.light / light", "nx * overlap / 2"),
         ("ny * overlap * d.light / light", "ny * overlap / 2")],
        "a static disk moves.",
    ),
}  # fmt: skip
RIGHT: dict[str, tuple[str, list[Change]]] = {
    "bare": (BARE, []),
    "the template": (TEMPLATE, []),
    "a threshold of 1 m/s": (
        TEMPLATE,
        [(IMPULSE, "-(1 + (closing > -1 ? 0 : world.e)) * closing / light")],
    ),
    "positions first": (
        BARE,
        [
            (
                "a.u += w.g[0] * dt; a.v += w.g[1] * dt; a.x += a.u * dt; a.y += a.v * dt;",
                "a.x += a.u * dt; a.y += a.v * dt; a.u += w.g[0] * dt; a.v += w.g[1] * dt;",
            )
        ],
    ),
    "float32": (BARE, [("a.x += a.u * dt", "a.u = Math.fround(a.u); a.x = Math.fround(a.x); $&")]),
}


def written(folder: Path, text: str, changes: list[Change]) -> Path:
    """`mine.js` with the changes; `$&` stands for what is replaced."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new.replace("$&", old))
    path = folder / "mine.js"
    path.write_text(text)
    return path


def probed(path: Path, *probes: str) -> list[dict[str, Any]]:
    row = row_of_file(path)
    with processes_reused():
        return [asdict(ask(path.name, "own", probe, row)) for probe in probes or PROBES]


@pytest.mark.slow
@pytest.mark.parametrize("fault", thinned(FAULTS, 3))
def test_the_sentence_of_an_engine_begins_with_its_fault(fault: str, tmp_path: Path):
    text, changes, words = FAULTS[fault]
    findings = probed(written(tmp_path, text, changes))
    [sentence] = own_engine_sentences(findings)

    assert sentence.startswith(f"mine.js: {words}")
    assert is_lawless(findings)
    assert "so it is not ranked" in sentence


@pytest.mark.slow
@pytest.mark.parametrize("name", RIGHT)
def test_a_right_engine_breaks_no_law(name: str, tmp_path: Path):
    findings = probed(written(tmp_path, *RIGHT[name]))

    assert not is_lawless(findings)
    assert not any("mine.js:" in sentence for sentence in own_engine_sentences(findings))


@pytest.mark.slow
def test_a_threshold_is_named_and_breaks_no_law(tmp_path: Path):
    path = written(tmp_path, *RIGHT["a threshold of 1 m/s"])
    findings = probed(path, *(f"restitution_{v:g}" for v in (0.1, 0.5, 2.0)), "pair_keeps_e")

    assert not is_lawless(findings)
    assert own_engine_sentences(findings) == [
        "mine.js: at 0.1 m/s e is 0 where 0.5 is stated; at 0.5 m/s e is 0 where 0.5 is stated."
    ]


@pytest.mark.slow
def test_an_engine_for_boxes_breaks_no_law_and_is_told_of_single_walls(tmp_path: Path):
    # Its bounds are the outermost coordinates of the walls.
    bounds = (
        "walls.forEach((wall, w) => collide(world, a, nearest(wall, a), -1 - w))",
        "[['x', 'u', 0], ['y', 'v', 1]].forEach(([x, u, k]) => { const c = walls.flat().map((p) =>"
        " p[k]); if (a[x] < Math.min(...c) + a.radius) { a[x] = Math.min(...c) + a.radius; a[u] *="
        " -world.e; } if (a[x] > Math.max(...c) - a.radius) { a[x] = Math.max(...c) - a.radius;"
        " a[u] *= -world.e; } })",
    )
    findings = probed(written(tmp_path, TEMPLATE, [bounds]), *LAWS, "restitution_wall")

    assert not is_lawless(findings)
    [sentence] = own_engine_sentences(findings)
    assert sentence.startswith("mine.js: off a wall that is not one of a box e is ")


@pytest.mark.slow
def test_what_a_file_refuses_is_not_asked_and_named(tmp_path: Path):
    assert own_engine_sentences(probed(written(tmp_path, BARE, []))) == [
        "mine.js keeps the laws that were asked. Not asked, because it refuses them: walls and"
        " static disks."
    ]


def test_each_law_has_its_words():
    assert set(WORDS) == set(Departure)


def test_a_library_departs_by_its_defaults_and_stays_ranked():
    findings = [
        asdict(ask("pymunk", "shipped", probe, ENGINES["pymunk:shipped"])) for probe in LAWS
    ]

    assert [row["departure"] for row in findings if row["departure"]] == [
        Departure.RESTITUTION,
        Departure.WALL_RESTITUTION,
    ]
    assert not is_lawless(findings)
    assert own_engine_sentences(findings) == []


@pytest.mark.slow
def test_terminal_and_page_begin_with_the_fault_and_do_not_rank_it(tmp_path: Path):
    text, changes, words = FAULTS["gravity upside down"]
    written(tmp_path, text, changes)
    run = crosscheck(
        *("run", "head_on_equal_e09", "free_fall_without_spin", "--timings", "0", "--out", "out"),
        *("--engine", "mine.js", "--engine", "pymunk:matched"),
        cwd=tmp_path,
    )
    printed = " ".join(run.stdout.split())
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    first = re.findall(r'<p class="lead">(.*?)</p>', page)

    assert run.returncode == 0, run.stderr
    assert f"- mine.js: {words} It breaks a law, so it is not ranked." in printed
    assert run.stdout.split("\n- ")[1].startswith("mine.js:")
    assert any(sentence.startswith(f"mine.js: {words}") for sentence in first)
    assert "mine.js is within" not in printed
    assert "mine.js:own (" not in printed
