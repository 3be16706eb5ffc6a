"""Scene files of every kind of nonsense, and some that are right and hard to answer."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from itertools import cycle
from pathlib import Path

from tests.hostile.cases import CASES
from tests.hostile.played import Input
from tests.hostile.small_run import TWO

FILE = "two.toml"
# A faulty scene is refused alike by whoever reads it: each input asks another command.
COMMANDS = (
    f"truth {FILE}",
    f"run {FILE} --out out",
    f"stability {FILE} --vary speed --out out",
    f"play {FILE}",
    f"speed {FILE} --out out",
    f"truth {FILE} --json",
    f"run free_fall {FILE}",
)
THRUST = "[[thrust]]\ndisk = 0\nstart = 0.0\nstop = 1.0\nforce = [{}, 0.0]\n"
BOX = "[box]\nlow = [-3.0, -1.0]\nhigh = [3.0, 1.0]\n"

# What is put in place of what in a good scene; what must be said of it.
NUMBERS: dict[str, tuple[str, str, str]] = {
    "a radius of zero": ("radius = 0.25", "radius = 0", "disk[0].radius = 0"),
    "a negative radius": ("radius = 0.25", "radius = -1", "disk[0].radius = -1"),
    "a radius that is not a number": ("radius = 0.25", "radius = nan", "disk[0].radius = nan"),
    "an infinite radius": ("radius = 0.25", "radius = inf", "disk[0].radius = inf"),
    "a radius smaller than float64 can square": (
        "radius = 0.25",
        "radius = 1e-200",
        "out of scale",
    ),
    "a radius of a light year": ("radius = 0.25", "radius = 1e16", "out of scale"),
    "a mass of zero": ("mass = 2.0", "mass = 0", "disk[1].mass = 0"),
    "a mass of the smallest float": ("mass = 2.0", "mass = 5e-324", "out of scale"),
    "a mass of the largest float": ("mass = 2.0", "mass = 1.7976931348623157e308", "out of scale"),
    "a negative inertia": ("mass = 2.0", "mass = 2.0\ninertia = -1.0", "disk[1].inertia = -1.0"),
    "an inertia out of scale": ("mass = 2.0", "mass = 2.0\ninertia = 1e300", "out of scale"),
    "an angle out of scale": ("mass = 2.0", "mass = 2.0\nangle = 1e200", "out of scale"),
    "an angular velocity out of scale": (
        "mass = 2.0",
        "mass = 2.0\nangular_velocity = -1e99",
        "out of scale",
    ),
    "a velocity faster than light": ("[1.0, 0.0]", "[1e10, 0.0]", "out of scale"),
    "a velocity that is not a number": ("[1.0, 0.0]", "[nan, nan]", "disk[0].velocity"),
    "a position out of scale": ("[-1.0, 0.0]", "[-1e300, 0.0]", "out of scale"),
    "gravity out of scale": ("restitution", "gravity = [0, -1e160]\nrestitution", "gravity"),
    "infinite gravity": ("restitution", "gravity = [0, -inf]\nrestitution", "gravity"),
    "a restitution above one": ("= 0.9", "= 1.0000001", "restitution"),
    "a negative restitution": ("= 0.9", "= -1e-9", "restitution"),
    "a restitution of a rounding": ("= 0.9", "= 5e-324", "restitution"),
    "a restitution that is not a number": ("= 0.9", "= nan", "restitution = nan"),
    "no duration at all": ("duration = 2.0", "duration = 0", "duration = 0"),
    "a duration backwards": ("duration = 2.0", "duration = -2.0", "duration = -2.0"),
    "a duration of the age of the world": ("duration = 2.0", "duration = 4e17", "duration"),
    "an endless duration": ("duration = 2.0", "duration = inf", "duration = inf"),
    "a duration of 5000 digits": ("duration = 2.0", f"duration = {'9' * 5000}", "digits"),
    "a sample interval that is longer": ("= 0.02", "= 4.0", "does not divide"),
    "a sample interval that does not divide": ("= 0.02", "= 0.03", "does not divide"),
    "too many samples": ("= 0.02", "= 1e-8", "samples"),
    "no substeps": ("= 0.02", "= 0.02\nsubsteps = []", "substeps = []"),
    "half a substep": ("= 0.02", "= 0.02\nsubsteps = [0.5]", "substeps[0] = 0.5"),
    "a substep of a thousand million": (
        "= 0.02",
        "= 0.02\nsubsteps = [1000000000]",
        "more than 10000000 steps",
    ),
    "substeps that fall": ("= 0.02", "= 0.02\nsubsteps = [2, 1]", "not increasing"),
    "the same substeps twice": ("= 0.02", "= 0.02\nsubsteps = [2, 2]", "not increasing"),
    "a thrust that nothing can follow": (
        "[[wall]]",
        f"{THRUST.format('1e160')}[[wall]]",
        "out of scale",
    ),
    "a thrust on a disk that is not there": (
        "[[wall]]",
        f"{THRUST.format('1.0')}[[wall]]".replace("disk = 0", "disk = 7"),
        "no such disk",
    ),
    "a thrust that ends before it begins": (
        "[[wall]]",
        f"{THRUST.format('1.0')}[[wall]]".replace("start = 0.0", "start = 1.5"),
        "not after start",
    ),
    "a thrust without an end in text": (
        "[[wall]]",
        f"{THRUST.format('1.0')}[[wall]]".replace("stop = 1.0", 'stop = "never"'),
        "thrust[0].stop",
    ),
    "a wall without length": ("start = [-3.0, -1.0]", "start = [3.0, -1.0]", "no length"),
    "a wall shorter than an atom": (
        "start = [-3.0, -1.0]",
        "start = [2.9999999999, -1.0]",
        "out of scale",
    ),
    "a wall to infinity": ("start = [-3.0, -1.0]", "start = [-inf, -1.0]", "wall[0].start"),
    "a box inside out": (
        "[[wall]]",
        f"{BOX.replace('3.0, 1.0', '-9.0, 1.0')}[[wall]]",
        "not above low",
    ),
    "a box with one corner": (
        "[[wall]]",
        f"{BOX.splitlines()[0]}\nlow = [-3.0, -1.0]\n[[wall]]",
        "box.high: missing",
    ),
}
SHAPES: dict[str, tuple[str, str, str]] = {
    "disks that overlap": ("[-1.0, 0.0]", "[0.9, 0.0]", "overlaps disk[0]"),
    "one disk in another": ("[-1.0, 0.0]", "[1.0, 0.0]", "overlaps disk[0] by 0.5 m"),
    "a disk in a wall": ("[-1.0, 0.0]", "[-1.0, -0.9]", "overlaps wall[0]"),
    "a disk outside of where it wraps": (
        "[[wall]]",
        f"{BOX.replace('box', 'wrap').replace('-3.0', '0.0')}[[wall]]",
        "outside [wrap]",
    ),
    "a static disk that moves": ("mass = 2.0", "static = true", "the disk is static"),
    "a word for a number": ("mass = 2.0", 'mass = "two"', "of type string"),
    "a truth value for a number": ("mass = 2.0", "mass = true", "of type boolean"),
    "a date for a number": ("mass = 2.0", "mass = 1979-05-27", "of type date"),
    "a list for a number": ("mass = 2.0", "mass = [2.0]", "disk[1].mass"),
    "a table for a number": ("mass = 2.0", "mass = {kg = 2.0}", "disk[1].mass"),
    "three coordinates": ("[-1.0, 0.0]", "[-1.0, 0.0, 0.0]", "3 items"),
    "no coordinates": ("[-1.0, 0.0]", "[]", "0 items"),
    "words for coordinates": ("[-1.0, 0.0]", '["left", "down"]', "disk[0].position[0]"),
    "a number for gravity": ("restitution", "gravity = 9.81\nrestitution", "gravity = 9.81"),
    "a key that does not exist": ("asks =", "question =", "unknown key"),
    "a key that is misspelt": ("restitution =", "resitution =", "did you mean restitution?"),
    "a table that does not exist": ("[[wall]]", "[spring]\nk = 1\n[[wall]]", "unknown key"),
    "no disks": (TWO[TWO.index("[[disk]]") :], "", "disk: missing"),
    "one table for all disks": ("[[disk]]", "[disk]", "two.toml: line"),
    "a name with spaces": ('"two-disks"', '"two disks"', "name = "),
    "a name that climbs": ('"two-disks"', '"../../../two"', "name = "),
    "a name of 300 letters": ('"two-disks"', f'"{"a" * 300}"', "name = "),
    "an empty name": ('"two-disks"', '""', "name = "),
    "a name that acts on a terminal": ('"two-disks"', '"\\u001b[2J\\u0007"', "name = "),
    "a name in markup": ('"two-disks"', '"[/nope]"', 'name = "[/nope]"'),
    "a key that acts on a terminal": ("asks =", '"\\u001b[31m" =', "unknown key"),
    "a question that is a number": ('"Does a head-on collision keep momentum?"', "42", "asks = 42"),
}


def turned(number: int, name: str, old: str, new: str, says: str) -> Input:
    assert old in TWO, name
    return Input(
        name, COMMANDS[number % len(COMMANDS)], {FILE: TWO.replace(old, new, 1)}, says=says
    )


FAULTY = [
    turned(number, name, *fault) for number, (name, fault) in enumerate((NUMBERS | SHAPES).items())
]

# Whole files, as they are.
TEXTS: dict[str, tuple[str | bytes, str]] = {
    "an empty file": ("", "missing"),
    "a comment and nothing else": ("# nothing\n", "missing"),
    "an open bracket": (f"{TWO}[[wall]\n", "line 27"),
    "a key twice": (f'name = "again"\n{TWO}', "line 3"),
    "a table twice": (f"{BOX}{BOX}", "two.toml: line"),
    "thousands of brackets in brackets": (f"name = {'[' * 20_000}", "arrays in arrays"),
    "thousands of tables in tables": (f"{'.'.join('a' * 5_000)} = 1", "two.toml: "),
    "random bytes": (bytes(range(256)) * 20, "two.toml: "),
    "a program in machine code": (b"\x7fELF\x02\x01\x01" + bytes(1000), "two.toml: "),
    "letters of another encoding": (TWO.replace("Does", "D\xfcrf").encode("latin-1"), "two.toml: "),
    "UTF-16": (TWO.encode("utf-16"), "two.toml: "),
    "null bytes": (TWO.replace("Does", "\0"), "two.toml: "),
    "a lone surrogate": (TWO.replace("Does", "\\ud800"), "two.toml: "),
    "JSON": ('{"name": "two", "duration": 2.0}', "line 1"),
    "a page": ("<!doctype html><html></html>", "line 1"),
    "one line of three million letters": ("x" * 3_000_000, "two.toml: "),
    "a file that is larger than any scene": (f"# {'x' * 6_000_000}\n{TWO}", "two.toml: "),
    "old line ends alone": (TWO.replace("\n", "\r"), "two.toml: "),
    "two hundred faults": (TWO + "[[wall]]\nstart = 1\n" * 200, "wall[2].start"),
}
AS_THEY_ARE = [
    Input(name, COMMANDS[number % len(COMMANDS)], {FILE: text}, says=says)
    for number, (name, (text, says)) in enumerate(TEXTS.items())
]


def linked(to: str, here: Path) -> None:
    (here / FILE).symlink_to(to)


NO_FILES: dict[str, Callable[[Path], None]] = {
    "no file": lambda _: None,
    "a folder as scene file": lambda here: (here / FILE).mkdir(),
    "a pipe as scene file": lambda here: os.mkfifo(here / FILE),
    "a link to nothing": partial(linked, "nothing.toml"),
    "a link to itself": partial(linked, FILE),
    "a link to a folder": partial(linked, "."),
    "a device without an end": partial(linked, "/dev/zero"),
    "a terminal that is none": partial(linked, "/dev/tty"),
    "a file of the kernel": partial(linked, "/proc/self/mem"),
}
READERS = cycle(COMMANDS[:4])
NOT_FILES = [
    Input(f"{name}, {words.split()[0]}", words, prepare=prepare, says="two.toml: ")
    for name, prepare in NO_FILES.items()
    for words in [next(READERS), next(READERS)]
]

SCENES = (*FAULTY, *AS_THEY_ARE, *NOT_FILES, *CASES)
