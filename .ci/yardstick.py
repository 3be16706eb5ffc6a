"""The yardstick: which numbers does a change of the code change?

    uv run --extra js python .ci/yardstick.py all   the base and this checkout, then compare
    ... measure OUT [--root CHECKOUT] [--groups suite,truths]
    ... compare BASE NEW                            exit 1: something that changed.toml lacks
    ... keep BASE COMMIT                            a new base: its hashes go to base.toml

The base is measured anew on each machine: the last bits differ between processors. OUT gets a
file for each group, with a line for each id and its value: a number (float.hex), a hash of
arrays, or a word of a closed set. It holds no sentence, cell key, duration, version or date. A
group that fails is named, and the others go on. Where two measurements differ, a new id passes;
any other change needs an entry in changed.toml.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import math
import os
import random
import shutil
import subprocess
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from fnmatch import fnmatchcase
from importlib import import_module
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HERE = Path(__file__).resolve()
KEPT = HERE.parent / "yardstick"
CACHE = Path(os.environ.get("YARDSTICK_CACHE", "~/.cache/crosscheck2d-yardstick")).expanduser()
Numbers = Iterator[tuple[str, str | float]]

# The modules of the measured code, old and new ones, and what the groups import from them. All but
# the tests may be in the package `crosscheck2d`.
API = {
    "scenarios.catalogue": "SCENARIOS",
    "scenarios.files.scene_file": "read_scene_file",
    "scenarios.no_truth": "NoTruth",
    "adapters.engines": "ENGINES FETCHED",
    "adapters.conformance.conform": "conform",
    "reports.lessons.catalogue": "LESSONS",
    "reports.stability.cases": "CASES",
    "tests.solvers.mutants": "MUTANTS CORRECT GL_MATRIX",
}
LIBRARIES = ("pymunk", "box2d", "box2d_v3", "planck", "matter", "rapier2d")
PLAYED = [f"--engine={name}" for name in ("reference", "event_driven", *LIBRARIES)]
CELL = ("scenario", "engine", "profile", "dt_s")  # and the seed
STATE = ("t", "position", "velocity", "angle", "angular_velocity")
HITS = [f"collision_{name}" for name in ("t", "i", "j", "impulse")]
SLOWEST = ("thermometer", "equipartition")  # statistics of long gases
RANDOM_SCENES = 300


def load(name: str) -> Any:
    """The object of that name in the measured code."""
    modules = [module for module, names in API.items() if name in names.split()]
    packaged = [f"crosscheck2d.{module}" for module in modules if module[:5] != "tests"]
    for module in [*packaged, *modules]:
        with suppress(ModuleNotFoundError, AttributeError):
            return getattr(import_module(module), name)
    raise LookupError(f"{name}: is in none of {', '.join(modules)}")


def crosscheck(*words: object, codes: tuple[int, ...] = (0, 1)) -> int:
    """The exit status of a command of the measured code."""
    command = [Path(sys.executable).parent / "crosscheck", *map(str, words)]
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
    status = subprocess.run(command, check=False, **quiet).returncode
    if codes and status not in codes:
        raise RuntimeError(f"exit status {status} of crosscheck {' '.join(map(str, words))}")
    return status


def says(command: str, word: str) -> bool:
    """Whether the help of a command of the measured code has a word, as not all code has."""
    words = [Path(sys.executable).parent / "crosscheck", command, "--help"]
    return word in subprocess.run(words, check=False, capture_output=True).stdout.decode()


def digest(*arrays: Any) -> str:
    """A hash of arrays, to the last bit."""
    import numpy as np

    hashed = hashlib.sha256()
    for array in map(np.ascontiguousarray, arrays):
        hashed.update(f"{array.dtype} {array.shape} ".encode() + array.tobytes())
    return f"sha:{hashed.hexdigest()[:16]}"


def rows_of(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


# The groups. Each gets a folder to work in, and runs in a process of its own in the checkout.


def suite(folder: Path) -> Numbers:
    """All scenes through all engines: deviations, statuses, hashes of the trajectories."""
    import numpy as np

    out, cells = folder / "out", {}
    words = ["--trajectories"] * says("run", "--trajectories")
    crosscheck("run", *PLAYED, "--timings", 0, "--workers", 1, "--out", out, *words)
    for row in rows_of(out / "runs.csv"):
        key = tuple(row[name] for name in CELL)
        cells[key] = cell = "/".join((*key, row["seed"]))
        yield f"status/{cell}", row["status"]
        if (path := out / "trajectories" / f"{row['cell']}.npz").exists():
            with np.load(path) as saved:
                yield f"trajectory/{cell}", digest(*(saved[name] for name in (*STATE, *HITS)))
    for row in rows_of(out / "deviations.csv"):
        cell = cells[tuple(row[name] for name in CELL)]
        metric = f"{row['metric']}/{row['disk']}/{row['versus']}"
        yield f"deviation/{cell}/{metric}", float(row["value"] or "nan")


def random_scene(number: int) -> str:
    """A scene file: in turn in a box, on a torus, beside loose walls, above a floor; with or
    without gravity, friction, spin, static disks and a thrust, at e = 1 and below. A place is a
    complex number."""
    rng = random.Random(f"yardstick {number}")
    place = ("box", "wrap", "loose", "floor")[number % 4]
    down = -rng.choice((9.81, 1.0)) if place == "floor" or rng.random() < 0.5 else 0.0
    lines = [
        f'name = "random-{number}"\nduration = 4.0\nsample_interval = 0.25',
        f"gravity = [{rng.choice((0.0, 0.3)) if down else 0.0}, {down}]",
        f"restitution = {rng.choice((1.0, 1.0, 0.9, 0.5, 0.1, 0.0))}",
        f"friction = {rng.choice((0.0, 0.0, 0.1, 0.6))}",
    ]
    walls = {
        "loose": [[complex(x + rng.random(), rng.uniform(0, 4)) for x in (1, 4)] for _ in "ab"],
        "floor": [[-50 + 0j, 50 + 0j]],
    }.get(place, [])
    lines += [f"[[wall]]\nstart = {x_and_y(start)}\nend = {x_and_y(end)}" for start, end in walls]
    lines += [] if walls else [f"[{place}]\nlow = [0.0, 0.0]\nhigh = [6.0, 4.0]"]
    disks: list[tuple[complex, float]] = []
    while len(disks) < 2 + number % 7:
        r = rng.uniform(0.1, 0.5)
        at, room = complex(rng.uniform(r, 6 - r), rng.uniform(r, 4 - r)), r + 0.02  # m
        gaps = [abs(at - other) - size for other, size in disks]
        for start, end in walls:
            share = ((at - start) / (end - start)).real
            gaps.append(abs(at - start - min(1.0, max(0.0, share)) * (end - start)))
        if min(gaps, default=room) < room:
            continue
        moves = not disks or place == "wrap" or rng.random() < 0.85
        disks.append((at, r))
        lines.append(f"[[disk]]\nposition = {x_and_y(at)}\nradius = {r}")
        lines.append(
            f"velocity = [{rng.gauss(0, 2)}, {rng.gauss(0, 2)}]\nmass = {rng.uniform(0.5, 4)}\n"
            f"angular_velocity = {rng.choice((0.0, rng.gauss(0, 5)))}"
            if moves
            else "static = true"
        )
    if number % 3 == 0:
        force = [rng.gauss(0, 4), rng.gauss(0, 4)]
        lines.append(f"[[thrust]]\ndisk = 0\nstart = 0.5\nstop = 1.25\nforce = {force}")
    return "\n".join(lines) + "\n"


def x_and_y(place: complex) -> list[float]:
    """m."""
    return [place.real, place.imag]


def truths(folder: Path) -> Numbers:
    """Exact answers and horizons of all scenes and of random ones."""
    built = load("SCENARIOS")  # of older versions: functions that build them
    scenes = {name: one() if callable(one) else one for name, one in built.items()}
    for number in range(RANDOM_SCENES):
        (path := folder / "scene.toml").write_text(random_scene(number), encoding="utf-8")
        scenes[f"random-{number}"] = load("read_scene_file")(path)
    for name, scene in scenes.items():
        try:
            if scene.truth is None:
                raise load("NoTruth")("")
            truth = scene.truth(scene.times)
        except load("NoTruth"):
            yield f"truth/{name}/horizon", "none"
            continue
        hits = truth.collisions
        yield f"truth/{name}/horizon", truth.horizon
        yield f"truth/{name}/error_bound", truth.error_bound
        yield f"truth/{name}/samples", len(truth.t)
        yield f"truth/{name}/collisions", len(hits.t)
        yield f"truth/{name}/motion", digest(*(getattr(truth, field) for field in STATE))
        yield f"truth/{name}/impulses", digest(hits.t, hits.i, hits.j, hits.impulse)
        if hasattr(scene.truth, "record"):  # beyond what float64 can follow
            yield f"truth/{name}/exact_horizon", scene.truth.record().horizon


def limits(folder: Path) -> Numbers:
    """The quick form of the search for limits, without the slowest cases, maps and laws."""
    out, cases = folder / "out", [name for name in load("CASES") if name not in SLOWEST]
    crosscheck("stability", *cases, *PLAYED, "--workers", 1, "--out", out)
    for row in rows_of(out / "limits.csv"):
        for key in ("works_at", "fails_at", "failed_fraction"):
            limit = f"{row['case']}/{row['engine']}/{row['profile']}"
            yield f"limit/{limit}/{key}", float(row[key] or "nan")


def probes(_folder: Path) -> Numbers:
    """What each engine does in each probe."""
    for name, row in (load("ENGINES") | load("FETCHED")).items():
        for finding in load("conform")(name, row):
            probe = f"probe/{finding.engine}/{finding.profile}/{finding.probe}"
            yield f"{probe}/verdict", finding.verdict
            if not isinstance(finding.got, str):
                yield f"{probe}/got", finding.got


def check(folder: Path) -> Numbers:
    """Verdict and points of each task, of every mutant and every right solver."""
    texts = {mutant.name: mutant.text for mutant in load("MUTANTS")}
    texts |= {f"right-{path.name}": path.read_text(encoding="utf-8") for path in load("CORRECT")}
    for name, text in texts.items():
        (student := folder / "class" / name.replace(".", "-")).mkdir(parents=True)
        file = "solver.py" if name.endswith(".py") else "Exercise.js"
        (student / file).write_text(text, encoding="utf-8")
        shutil.copy(load("GL_MATRIX"), student)  # some call it
    marks = folder / "marks.json"
    words = ("check", folder / "class", "--format", "json", "--out", marks)
    if crosscheck(*words, "--seed", 0, codes=()) > 1:  # code without this option
        crosscheck(*words)
    for solver in json.loads(marks.read_text(encoding="utf-8"))["files"]:
        name = f"check/{solver['id']}"
        yield f"{name}/points", solver["points"]
        yield from ((f"{name}/{task}/verdict", word) for task, word in solver["tasks"].items())
        for task, mark in solver["marks"].items():
            yield f"{name}/{task}/points", mark["points"]


def lessons(_folder: Path) -> Numbers:
    """Whether each claim holds, and the curves it is about, where the sliders begin and end."""
    for name, lesson in load("LESSONS").items():
        timed = name == "crowd"  # its curves are times; a claim on them gets three tries
        corners = product(*({0, len(slider.values) - 1} for slider in lesson.sliders))
        for places in sorted({lesson.start, *corners}):
            at = f"lesson/{name}/{'-'.join(map(str, places))}"
            for _ in range(3 if timed else 1):
                shown = lesson.at(places)
                hold = [bool(claim.holds(shown)) for claim in shown.claims]
                if all(hold):
                    break
            yield from ((f"{at}/claim-{k}", value) for k, value in enumerate(hold))
            for k, chart in enumerate(shown.charts if not timed else ()):
                for m, curve in enumerate(chart.curves):
                    yield f"{at}/chart-{k}/curve-{m}", digest(curve.x, curve.y)


TWO = """name = "two"\nduration = 1.0\nsample_interval = 0.1\nrestitution = 0.9
[[disk]]\nposition = [-1.0, 0.0]\nvelocity = [2.0, 0.0]\nradius = 0.25\nmass = 1.0
[[disk]]\nposition = [1.0, 0.0]\nvelocity = [0.0, 0.0]\nradius = 0.25\nmass = 3.0
"""
FILES = {
    "two.toml": TWO,
    "bad.toml": TWO.replace("mass = 3.0", "mass = -3.0"),
    "overlap.toml": TWO.replace("[-1.0, 0.0]", "[0.9, 0.0]"),
    "text.toml": "a text",
    "empty.js": "",
    "wrong.js": "function integrate(sphere, dt) { sphere.position.x += 1; }",
    "engine.js": "function create() {} function step() {} function read() {}",
}
QUICK = "--engine pymunk:shipped --timings 0 --workers 1"
LINES = f"""--help|--version|jump|list|list engines|list scenarios|list metrics|list solvers
run two.toml {QUICK} --out done|run free_fall {QUICK} --out fall|run free_fall {QUICK} --dt 0.3
run bad.toml|run overlap.toml|run text.toml|run none.toml|run free_fal|run two.toml --engine boxed2d
run two.toml --engine pymunk:best|run two.toml --dt 0|run two.toml --dt 0.03|run two.toml --dt nan
run two.toml --seed -1|run two.toml --workers x|run two.toml --timeout 0|run two.toml --memory -1
run two.toml --engine engine.js --dt 0.1 --timings 0 --out own
run two.toml --engine wrong.js --dt 0.1 --timings 0 --out solver
run two.toml --scheduler here|report done|report none|diff done done|diff done none|diff done
truth two.toml|truth two.toml --json|truth heavy|truth bad.toml|truth two.toml --timeout -5|truth
check right.js --page right.html|check wrong.js --page wrong.html|check wrong.js --format xml
check wrong.js --format csv --out marks.csv|check empty.js|check two.toml|check none.js|check .
check engine.js|stability two.toml --vary colour|stability slow_collision --vary dt|stability none
speed nothing|speed --seed one|advise two.toml --error x|advise nothing|tune bullet|tune reference
lesson nothing|play none.toml|new-engine new.js|new-engine new.js|new-engine new.txt""".replace(
    "\n", "|"
)


def exits(folder: Path) -> Numbers:
    """Exit statuses of command lines with good and bad input."""
    os.chdir(folder)
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    shutil.copy(next(path for path in load("CORRECT") if path.suffix == ".js"), "right.js")
    times: Counter[str] = Counter()
    for line in LINES.split("|"):
        times[line] += 1
        yield f"exit/{line}/{times[line]}", float(crosscheck(*line.split(), codes=()))


# The longest first: two run at a time.
GROUPS: dict[str, Callable[[Path], Numbers]] = {
    group.__name__: group for group in (limits, suite, truths, check, lessons, exits, probes)
}


def write_group(name: str, out: Path) -> int:
    """In the checkout: the numbers of a group, sorted by id."""
    lines: dict[str, str] = {}
    with TemporaryDirectory() as folder:
        for key, value in GROUPS[name](Path(folder)):
            if key in lines:
                raise ValueError(f"{key}: twice")
            lines[key] = value if isinstance(value, str) else float(value).hex()
    text = "".join(f"{key}\t{lines[key]}\n" for key in sorted(lines))
    (out / f"{name}.tsv").write_text(text, encoding="utf-8")
    return 0


def measure(out: Path, root: Path, groups: list[str]) -> int:
    """Measure groups of a checkout, two at a time; 1 if one could not be measured."""
    out.mkdir(parents=True, exist_ok=True)
    out, root = out.resolve(), root.resolve()
    # of this checkout the environment that runs, which need not be .venv
    python = root / ".venv" / "bin" / "python"
    path = [root] if python.exists() else [root, root / ".ci" / "types"]
    python = Path(sys.executable) if root == HERE.parents[1] or not python.exists() else python
    # A cache of its own: exact answers are computed, not looked up.
    shutil.rmtree(out / "cache", ignore_errors=True)
    environment = {name: text for name, text in os.environ.items() if name != "VIRTUAL_ENV"}
    environment |= {
        "PYTHONPATH": os.pathsep.join(map(str, path)),
        "CROSSCHECK_CACHE": str(out / "cache"),
    }

    def run(name: str, *command: object) -> bool:
        began = time.monotonic()
        with (out / f"{name}.log").open("wb") as log:
            status = subprocess.run(
                list(map(str, command)), cwd=root, env=environment, stdout=log, stderr=log
            ).returncode
        ended = f"failed, see {out / name}.log" if status else "done"
        print(f"{name}: {ended} ({time.monotonic() - began:.0f} s)", flush=True)
        return not status

    def run_group(name: str) -> bool:
        (out / f"{name}.tsv").unlink(missing_ok=True)
        return run(name, python, HERE, "group", name, out)

    # The JavaScript engines are fetched before two processes want them.
    line = ("run", "free_fall", "--engine=planck", "--timings", 0, "--out", out / "cache" / "run")
    fetched = run("fetch", python.parent / "crosscheck", *line)
    with ThreadPoolExecutor(2) as pool:
        chosen = [name for name in GROUPS if name in groups]
        return int(not all([fetched, *pool.map(run_group, chosen)]))


def read(folder: Path, groups: list[str]) -> dict[str, str]:
    """The ids and values of those groups that were measured."""
    paths = [path for name in groups if (path := folder / f"{name}.tsv").exists()]
    lines = [line for path in paths for line in path.read_text(encoding="utf-8").splitlines()]
    return dict(line.split("\t") for line in lines)


def hashes(numbers: dict[str, str]) -> dict[str, str]:
    """Kind of id -> how many, and a hash of all."""
    kinds: dict[str, list[str]] = {}
    for key in sorted(numbers):
        kinds.setdefault(key.partition("/")[0], []).append(f"{key}\t{numbers[key]}\n")
    sums = {kind: hashlib.sha256("".join(lines).encode()) for kind, lines in kinds.items()}
    return {kind: f"{len(kinds[kind])} {sums[kind].hexdigest()[:32]}" for kind in kinds}


PRINTED = 40  # faults
DIRECTIONS = ("lower", "higher", "status", "gone", "any")
FIELDS = {"pattern": str, "count": int, "direction": str, "issue": int, "point": str, "reason": str}


def direction(old: str, new: str | None) -> str:
    """How a value has changed: "status" where the two are no numbers that differ in size."""
    if new is None:
        return "gone"
    with suppress(ValueError):
        before, after = float.fromhex(old), float.fromhex(new)
        if before != after and not math.isnan(before + after):
            return "higher" if after > before else "lower"
    return "status"


def read_changes(text: str) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """The entries of changed.toml, and its renamed parts of ids; raises `ValueError`."""
    table = tomllib.loads(text)
    entries = table.get("change", [])
    for number, entry in enumerate(entries, 1):
        wrong = [key for key, kind in FIELDS.items() if type(entry.get(key)) is not kind]
        if wrong or set(entry) - set(FIELDS) or entry["direction"] not in DIRECTIONS:
            raise ValueError(
                f"changed.toml, entry {number}: needs {', '.join(FIELDS)}, no others;"
                f" direction: {', '.join(DIRECTIONS)}"
            )
    return entries, table.get("renamed", {})


def compare(
    base: dict[str, str], new: dict[str, str], changes: str, whole: bool = True
) -> list[str]:
    """What is wrong: every change without an entry, every entry with another count.

    A change counts for the first entry with its pattern and its direction; "any" is every
    direction but "gone". Not `whole`, for some groups only: entries that nothing fits may wait.
    """
    entries, renamed = read_changes(changes)
    counts, faults = [0] * len(entries), []
    for old_key, old in base.items():
        key = "/".join(renamed.get(part, part) for part in old_key.split("/"))
        if new.get(key) == old:
            continue
        how = direction(old, new.get(key))
        allowed = (how,) if how == "gone" else (how, "any")
        for k, entry in enumerate(entries):
            if entry["direction"] in allowed and fnmatchcase(key, entry["pattern"]):
                counts[k] += 1
                break
        else:
            faults.append(f"{how}\t{key}\t{decimal(old)}\t{decimal(new.get(key, ''))}")
    faults += [
        f"count\t{entry['pattern']} ({entry['direction']}): {entry['count']} stated, {count} found"
        for entry, count in zip(entries, counts)
        if entry["count"] != count and (whole or count)
    ]
    return faults


def decimal(value: str) -> str:
    """A value for people."""
    return repr(float.fromhex(value)) if value.lstrip("-")[:2] == "0x" else value


def show(base: Path, new: Path, groups: list[str]) -> int:
    """Print what is wrong, all of it to NEW/faults.tsv; the exit status."""
    places = {name: (base / f"{name}.tsv", new / f"{name}.tsv") for name in groups}
    lacking = [path for pair in places.values() for path in pair if not path.exists()]
    whole = [name for name in groups if not {*places[name]} & {*lacking}]
    before, after = read(base, whole), read(new, whole)
    kept = tomllib.loads((KEPT / "base.toml").read_text(encoding="utf-8"))["numbers"]
    for kind, now in hashes(before).items():
        if now != kept.get(kind):
            print(f"note: {kind}: the base has other bits here than those kept in base.toml")
    changes = (KEPT / "changed.toml").read_text(encoding="utf-8")
    faults = [f"missing\t{path}" for path in lacking]
    faults += compare(before, after, changes, len(whole) == len(GROUPS))
    (new / "faults.tsv").write_text("".join(f"{fault}\n" for fault in faults), encoding="utf-8")
    print("".join(f"{fault}\n" for fault in faults[:PRINTED]), end="")
    for what, count in Counter(fault.partition("/")[0] for fault in faults).items():
        print(f"{count} {what}")
    fresh = len(after.keys() - before.keys())
    print(f"{len(before)} ids, {fresh} new: {len(faults)} faults, in {new / 'faults.tsv'}")
    return int(bool(faults))


def make_base(groups: list[str]) -> Path:
    """The numbers of the base, kept for this commit and this script; measured where missing."""
    commit = tomllib.loads((KEPT / "base.toml").read_text(encoding="utf-8"))["commit"]
    code = CACHE / commit / "code"
    numbers = CACHE / commit / hashlib.sha256(HERE.read_bytes()).hexdigest()[:12]
    if lacking := [name for name in groups if not (numbers / f"{name}.tsv").exists()]:
        if not code.exists():
            add = ["git", "worktree", "add", "--force", "--detach", str(code), commit]
            subprocess.run(add, cwd=HERE.parent, check=True)
        if (lock := HERE.parents[1] / "uv.lock").exists():  # the same versions in both
            shutil.copy(lock, code)
        gone = ("VIRTUAL_ENV", "UV_PROJECT_ENVIRONMENT")
        environment = {name: text for name, text in os.environ.items() if name not in gone}
        subprocess.run(["uv", "sync", "-q", "--extra", "js"], cwd=code, env=environment, check=True)
        measure(numbers, code, lacking)
    return numbers


def keep(base: Path, commit: str) -> int:
    """Write base.toml; raises `ValueError` where a group is missing."""
    if lacking := [name for name in GROUPS if not (base / f"{name}.tsv").exists()]:
        raise ValueError(f"{base}: lacks {', '.join(lacking)}; measure these first")
    lines = [f'{kind} = "{text}"\n' for kind, text in hashes(read(base, [*GROUPS])).items()]
    head = "# The base: its commit, and of each kind of number how many there are and their hash.\n"
    text = f'{head}commit = "{commit}"\n\n[numbers]\n{"".join(lines)}'
    (KEPT / "base.toml").write_text(text, encoding="utf-8")
    return 0


def main() -> int:
    """The commands; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("command", choices=("all", "measure", "compare", "keep", "group"))
    parser.add_argument("places", nargs="*", help="OUT, BASE NEW, or BASE COMMIT")
    parser.add_argument("--root", type=Path, default=HERE.parents[1], help="of what is measured")
    parser.add_argument("--groups", default=",".join(GROUPS), help="default: %(default)s")
    given = parser.parse_args()
    groups, needed = given.groups.split(","), {"measure": 1, "all": 0}.get(given.command, 2)
    if unknown := [name for name in groups if name not in GROUPS]:
        parser.error(f"--groups: {unknown[0]!r} is none of {', '.join(GROUPS)}")
    if len(given.places) != needed:
        parser.error(f"{given.command}: takes {needed} arguments")
    places = [Path(place) for place in given.places]
    try:
        match given.command:
            case "group":
                return write_group(given.places[0], places[1])
            case "measure":
                return measure(places[0], given.root, groups)
            case "keep":
                return keep(places[0], given.places[1])
            case "compare":
                return show(places[0], places[1], groups)
        base, new = make_base(groups), CACHE / "new"
        measure(new, given.root, groups)
        return show(base, new, groups)
    except (ValueError, OSError, subprocess.CalledProcessError) as fault:
        if given.command == "group":
            raise
        print(fault, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
