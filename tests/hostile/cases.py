"""Scenes that are right, and hard: what has no answer is said, and everything ends in time."""

from __future__ import annotations

from pathlib import Path

from tests.hostile.played import Input
from tests.hostile.small_run import TWO

SCENES = Path(__file__).parents[1] / "data" / "scenes"
FILE = "two.toml"
TRUTH = f"truth {FILE} --timeout 20"
PLAYED = f"run {FILE} --engine pymunk:shipped --out out --workers 1 --timeout 5"


def scene(
    disks: str, walls: str = "", top: str = "", duration: float = 2.0, interval: float = 0.02
) -> str:
    """A scene file: disks as `x y vx vy`, or with a radius behind it; walls as `x y x y`; a `;`
    between two."""
    text = f'name = "case"\nduration = {duration}\nsample_interval = {interval}\n'
    text += f"{top}\n" if "restitution" in top else f"restitution = 0.9\n{top}\n"
    for disk in disks.split(";"):
        x, y, vx, vy, radius = (*disk.split(), "0.25")[:5]
        text += (
            f"[[disk]]\nposition = [{x}, {y}]\nvelocity = [{vx}, {vy}]\nradius = {radius}\nmass ="
            " 1.0\n"
        )
    for wall in filter(None, walls.split(";")):
        a, b, c, d = wall.split()
        text += f"[[wall]]\nstart = [{a}, {b}]\nend = [{c}, {d}]\n"
    return text


SQUARE = "-0.5 -0.5 0.5 -0.5; 0.5 -0.5 0.5 0.5; 0.5 0.5 -0.5 0.5; -0.5 0.5 -0.5 -0.5"
FALL = "gravity = [0.0, -9.81]\n"
THRUST = "[[thrust]]\ndisk = 0\nstart = 0.0\nstop = 1.0\nforce = [{}, 0.0]\n"
ROW = ";".join(f"{k * 0.5} 0.0 0.0 0.0" for k in range(1, 11))

# What `truth` is asked: the scene; the exit code and what it must say, if not `ANSWERED`.
ANSWERED = (0,), "horizon"
HARD: dict[str, str | tuple[str, tuple[int, ...], str]] = {
    "a disk alone": scene("0 0 1 0"),
    "walls that cross below a disk that falls": scene(
        "0 2 0.25 0 0.25", "-1 -1 1 1; -1 1 1 -1", "gravity = [0.0, -2.0]\nrestitution = 0.0"
    ),
    "a million seconds in a box": scene(
        "0 0 -2.1938 2.0846 0.3", SQUARE, "restitution = 1.0\nsubsteps = [1]", 1e6, 1.0
    ),
    "a hundred thousand seconds at rest": scene("0 0 0 0", "", "", 1e5, 1.0),
    "a bounce that takes ever less time": (
        scene("0 1 0 0", "-3 0 3 0", f"{FALL}restitution = 0.5"),
        (0,),
        "ends",
    ),
    "a bounce that never ends": scene("0 1 0 0", "-3 0 3 0", f"{FALL}restitution = 1.0", 20.0),
    "a row of ten that touch, and one that comes": (
        scene(f"-3 0 2 0; {ROW}"),
        (0,),
        "none is the truth",
    ),
    "two that touch and move apart": scene("-0.25 0 -1 0; 0.25 0 1 0"),
    "two that touch and press": (scene("-0.25 0 1 0; 0.25 0 -1 0"), (0,), ""),
    "a disk that rests on a floor": scene("0 0.25 0 0", "-3 0 3 0", FALL),
    "a disk that is caught between two walls": (
        scene("0 0 1 0", "-0.25 -1 -0.25 1; 0.25 -1 0.25 1"),
        (1,),
        "",
    ),
    "a disk between two walls that are hardly apart": (
        scene(
            "0 0 1 0", "-0.2500001 -1 -0.2500001 1; 0.2500001 -1 0.2500001 1", "restitution = 1.0"
        ),
        (1,),
        "",
    ),
    "a disk that grazes a disk": scene("-1 0 1 0; 0 0.5 0 0"),
    "a disk that grazes the end of a wall": scene("-1 0.25 1 0", "0 0 3 0"),
    "a disk that meets two at once": (scene("-1 0 1 0; 0 0.25 0 0; 0 -0.25 0 0"), (0,), ""),
    "three that meet in a point": (
        scene(
            "-1 0 1 0; 0.5 0.8660254037844386 -0.5 -0.8660254037844386; 0.5 -0.8660254037844386"
            " -0.5 0.8660254037844386"
        ),
        (0,),
        "",
    ),
    "a corner that is met at once": scene("0 0 1 1", "1 -1 1 1; -1 1 1 1"),
    "a thrust without end": scene(
        "0 0 0 0", "", THRUST.format(1.0).replace("stop = 1.0", "stop = inf")
    ),
    "a thrust of a thousand million newtons": (
        scene("0 0 0 0; 3 0 0 0", "", THRUST.format(1e9)),
        (1,),
        "too large to follow",
    ),
    "a thrust of the smallest float": scene("0 0 0 0", "", THRUST.format(5e-324)),
    "a disk of a thousandth of a millimetre beside one of a kilometre": (
        scene("0 0 0 0 1000; -1001 0 1 0 0.000001"),
        (1,),
        "no exact answer",
    ),
    "a disk that is a million kilometres away": (
        scene("1e9 0 0 0; 999999999 0 1 0"),
        (1,),
        "too large to follow",
    ),
    "a million metres in a second": scene("-1 0 1e6 0; 1 0 0 0"),
    "thirty in a box": (
        scene(
            ";".join(
                f"{x - 2.5} {y - 2} {(x * 7 + y) % 5 - 2}.37 {(x + y * 3) % 5 - 2}.21"
                for x in range(6)
                for y in range(5)
            ),
            "-3.3 -3.3 3.3 -3.3; 3.3 -3.3 3.3 3.3; 3.3 3.3 -3.3 3.3; -3.3 3.3 -3.3 -3.3",
            "restitution = 1.0",
            8.0,
        ),
        (0,),
        "",
    ),
    "a question in markup and escape codes": (
        TWO.replace("Does a head-on", "[/nope] \\u001b[31m \\u0007 \\u202e :boom: Does a"),
        (0,),
        "[/nope] \\x1b[31m",
    ),
    "line ends of Windows": TWO.replace("\n", "\r\n"),
    "a byte order mark": (f"\ufeff{TWO}", (0,), ""),
    "letters of other alphabets": (TWO.replace("Does a", "Хранит ли 保存 هل Does a"), (0,), "保存"),
    "samples at the smallest step": scene("0 0 1 0", "", "", 1e-6, 1e-9),
    "a scene that has no number at all in common with a second": (
        scene("0 0 1e-9 0 1e-9", duration=1e-9, interval=1e-9),
        (1,),
        "no exact answer",
    ),
}
# What `run` is asked, with all that belongs to it; a few, as it starts processes.
RUN: dict[str, tuple[str, tuple[int, ...], str]] = {
    "a million samples": (scene("0 0 1 0", "", "substeps = [1]", 1e5, 0.1), (1,), ""),
    "a ball that settles": (
        scene("0 1 0 0", "-3 0 3 0", f"{FALL}restitution = 0.5"),
        (0,),
        "4 cells ended",
    ),
    "a question in markup": (
        TWO.replace("Does a", "[/nope] [red] \\u001b]0;x\\u0007 Does a"),
        (0,),
        "4 cells ended",
    ),
    "a disk that leaves at once": (scene("0 0 1e9 0; 3 0 0 0"), (0,), "ended: "),
    "an answer that takes too long": (
        scene("0 0 -2.1938 2.0846 0.3", SQUARE, "restitution = 1.0\nsubsteps = [1]", 1e5, 1.0),
        (1,),
        "longer than 5 s",
    ),
}
CASES = (
    *(
        Input(f"truth: {name}", TRUTH, {FILE: text}, codes=codes, says=says)
        for name, row in HARD.items()
        for text, codes, says in [(row, *ANSWERED) if isinstance(row, str) else row]
    ),
    *(
        Input(
            f"run: {name}", PLAYED, {FILE: text}, codes=codes, says=says, writes=("out", "out.part")
        )
        for name, (text, codes, says) in RUN.items()
    ),
    Input(
        "stability: a scene in which nothing moves",
        f"stability {FILE} --vary speed --engine pymunk:shipped --out out",
        {FILE: (SCENES / "still.toml").read_text()},
        codes=(0,),
        writes=("out", "out.part"),
    ),
    Input(
        "stability: a parameter that does not exist",
        f"stability {FILE} --vary colour",
        {FILE: TWO},
        says="colour",
    ),
    Input(
        "stability: a parameter without a scene file",
        "stability slow_collision --vary dt",
        says="--vary",
    ),
    Input(
        "play: more disks than a page can draw",
        f"play {FILE}",
        {FILE: scene(";".join(f"{k} 0 0 0" for k in range(201)))},
        says="201 disks",
    ),
    Input(
        "two files with one name", f"run {FILE} b.toml", {FILE: TWO, "b.toml": TWO}, says="taken by"
    ),
    Input(
        "a file with the name of a scenario",
        f"run {FILE}",
        {FILE: TWO.replace("two-disks", "slow_collision")},
        says="taken by a scenario",
    ),
    Input(
        "a file whose name does not end in .toml", "run two.txt", {"two.txt": TWO}, says="two.txt"
    ),
    Input(
        "a scene that is a folder's name with a slash",
        "truth two.toml/",
        {FILE: TWO},
        says="two.toml/",
    ),
)
