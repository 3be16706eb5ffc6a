"""What is put in place of what in a good scene file, and what the reader must say of it."""

import tomllib
from pathlib import Path

SCENES = Path(__file__).parents[2] / "tests" / "data" / "scenes"
TWO = (SCENES / "two.toml").read_text()
DISK = "[[disk]]\nposition = [-1.0, 0.0]\nvelocity = [1.0, 0.0]\nradius = 0.25\nmass = 1.0\n"
THRUST = "\n[[thrust]]\ndisk = 0\nstart = 0.5\nstop = 1.0\nforce = [0.1, 0.0]\n"

FAULTS = [
    *map(tuple, tomllib.loads(Path(__file__).with_suffix(".toml").read_text())["faults"]),
    *(
        (
            "duration = 2.0",
            f"duration = {'9' * count}",
            f'line 4: "duration": an integer of {count} digits; must be a number of at most 4300',
        )
        for count in (5000, 4301)
    ),
    ("duration = 2.0", f"duration = 0x{'9' * 5000}", "duration = 0x9999999999999"),
    (
        "duration = 2.0",
        f"duration = {'[' * 9000}",
        "arrays in arrays in arrays; must be as flat as a scene is",
    ),
]
