"""What is put in place of what in a good scene file, and what the reader must say of it."""

from pathlib import Path

SCENES = Path(__file__).parents[2] / "tests" / "data" / "scenes"
TWO = (SCENES / "two.toml").read_text()
DISK = "[[disk]]\nposition = [-1.0, 0.0]\nvelocity = [1.0, 0.0]\nradius = 0.25\nmass = 1.0\n"
THRUST = "\n[[thrust]]\ndisk = 0\nstart = 0.5\nstop = 1.0\nforce = [0.1, 0.0]\n"
LENGTH = "must be positive and finite (m)"
MASS = "must be positive and finite (kg); left out if static"
PLACE = "must be two finite numbers [x, y] (m)"
LADDER = "must be whole numbers from 1, increasing"
FRICTION = "must be finite and at least 0"
SHARE = "must be from 0 to 1"
SCALE = "must be from 1e-09 to 1e+09 (SI)"
STEPS = "must give at most 10000000"
NAME = "must be at most 100 of a-z, 0-9, '_' and '-'"
DIVIDES = "does not divide the duration 2.0 s; must go into it a whole number of times, as"

# A line of two.toml, the key in its place, the value, and what is said of both.
INSTEAD = [
    ("radius = 0.25", "disk[0].radius", "-0.25", LENGTH),
    ("radius = 0.25", "disk[0].radius", "0", LENGTH),
    ("radius = 0.25", "disk[0].radius", "inf", LENGTH),
    ("radius = 0.25", "disk[0].radius", "true", f"of type boolean; {LENGTH}"),
    ("radius = 0.25", "disk[0].radius", "1e-200", f"out of scale; {SCALE}"),
    ("mass = 2.0", "disk[1].mass", "nan", MASS),
    ("mass = 2.0", "disk[1].mass", "inf", MASS),
    ("mass = 2.0", "disk[1].mass", '"2 kg"', f"of type string; {MASS}"),
    ("restitution = 0.9", "restitution", "1.5", SHARE),
    ("restitution = 0.9", "restitution", "-0.1", SHARE),
    ("duration = 2.0", "duration", "0", "must be positive and finite (s)"),
    ("sample_interval = 0.02", "sample_interval", "0.03", f"{DIVIDES} 0.0298507462686567 does"),
    ("sample_interval = 0.02", "sample_interval", "5.0", f"{DIVIDES} 2 does"),
    ("sample_interval = 0.02", "sample_interval", "1e-300", f"out of scale; {SCALE}"),
    ("sample_interval = 0.02", "sample_interval", "1e-09", f"2e+09 samples; {STEPS}"),
    ("position = [-1.0, 0.0]", "disk[0].position", "[-1.0]", f"1 item; {PLACE}"),
    ("position = [-1.0, 0.0]", "disk[0].position", "[-1.0, 0.0, 0.0]", f"3 items; {PLACE}"),
    ("position = [-1.0, 0.0]", "disk[0].position", '"left"', f"of type string; {PLACE}"),
    ("position = [-1.0, 0.0]", "disk[0].position", "2020-01-01", f"of type date; {PLACE}"),
    ('name = "two-disks"', "name", '"Two disks"', NAME),
]
# A line of two.toml, the key that is added after it, its value, and what is said.
ADDED = [
    ("mass = 2.0", "disk[1].inertia", "0", "must be positive (kg m2); inf: it does not turn"),
    ("mass = 2.0", "disk[1].static", "1", "of type integer; must be true or false"),
    ("restitution = 0.9", "friction", "-0.5", FRICTION),
    ("restitution = 0.9", "friction", "inf", FRICTION),
    ("restitution = 0.9", "friction", "nan", FRICTION),
    ("restitution = 0.9", "friction", '"rough"', f"of type string; {FRICTION}"),
    ("restitution = 0.9", "friction", "1e-12", f"out of scale; {SCALE}"),
    ("= 0.02", "substeps", "[1000000000]", f"more than 10000000 steps in all; {STEPS}"),
    ("= 0.02", "substeps", "[]", f"0 items; {LADDER}"),
    ("= 0.02", "substeps", "[4, 2]", f"not increasing; {LADDER}"),
    ("= 0.02", "substeps", "[1, 1000000]", "100000100 steps in all; must give at"),
    ("= 0.02", "box", "4", "of type integer; must be a table"),
    ("= 0.02", "thrust", "4", "of type integer; must be [[thrust]] tables"),
]
# A line that is left out, its key, and what is said.
LEFT_OUT = [
    ("radius = 0.25", "disk[0].radius", f"missing; {LENGTH}"),
    ("mass = 2.0", "disk[1].mass", f"missing; {MASS}"),
    (
        "velocity = [1.0, 0.0]",
        "disk[0].velocity",
        "missing; must be two finite numbers [x, y] (m/s)",
    ),
    ('name = "two-disks"', "name", f"missing; {NAME}"),
    ("restitution = 0.9", "restitution", f"missing; {SHARE}"),
    ("start = [-3.0, -1.0]", "wall[0].start", f"missing; {PLACE}"),
]

# What is put in place of what in two.toml, and what the reader must say of it (after "two.toml: ").
FAULTS = [
    *(
        (good, f"{path.split('.')[-1]} = {bad}", f"{path} = {bad}: {said}")
        for good, path, bad, said in INSTEAD
    ),
    *(
        (old, f"{old}\n{path.split('.')[-1]} = {bad}", f"{path} = {bad}: {said}")
        for old, path, bad, said in ADDED
    ),
    *((good, "", f"{path}: {said}") for good, path, said in LEFT_OUT),
    (
        "mass = 2.0",
        "static = true",
        "disk[1].velocity = [-1.0, 0.0]: the disk is static; must be zero or left out",
    ),
    (
        "radius = 0.25",
        "raduis = 0.25\nradius = 1",
        "disk[0].raduis = 0.25: unknown key; did you mean radius?",
    ),
    (
        "[-1.0, 0.0]",
        "[nan, 0.0]",
        "disk[0].position[0] = nan: must be two finite numbers [x, y] (m)",
    ),
    (
        "[-1.0, 0.0]",
        "{x = 1}",
        "disk[0].position = {...}: of type table; must be two finite numbers [x, y] (m)",
    ),
    ('"two-disks"', '"two\\n"', "name = \"two\\n\": must be at most 100 of a-z, 0-9, '_' and '-'"),
    (
        "asks = ",
        "ask = ",
        'ask = "Does a head-on collision keep momentum?": unknown key; did you mean asks?',
    ),
    ("asks = ", "a.b = ", "a = {...}: unknown key; must be one of name, asks, duration,"),
    (
        "restitution = 0.9",
        "restitution = 1\ngravity = 9.81",
        "gravity = 9.81: of type float; must be two finite",
    ),
    (
        "[1.0, 0.0]",
        "[1e160, 0.0]",
        "disk[0].velocity[0] = 1e+160: out of scale; must be from -1e+09 to 1e+09 (SI)",
    ),
    (
        "= 0.02",
        "= 2e-6",
        "substeps = [1, 2, 4, 8]: 15000000 steps in all; must give at most 10000000",
    ),
    (
        "start = [-3.0, -1.0]",
        "start = [3, -1]",
        "wall[0].end = [3.0, -1.0]: the wall has no length; must differ",
    ),
    (
        "[[wall]]",
        "[thrust]\ndisk = 0\n[[wall]]",
        "thrust = {...}: of type table; must be [[thrust]] tables",
    ),
    ("= 0.02", "= 0.02\nsubsteps = [1, 2.5]", f"substeps[1] = 2.5: of type float; {LADDER}"),
    ("= 0.02", "= 0.02\nsubsteps = [0, 1]", f"substeps[0] = 0: {LADDER}"),
    ("= 0.02", "= 0.02\ndisk = 4", "line 9, column 7: cannot overwrite a value; must be TOML"),
    (
        "[[wall]]",
        "[box]\nlow = [-3, -3]\nhigh = [3, -4]\n[[wall]]",
        "box.high = [3, -4]: not above low = [-3.0, -3.0]; must be greater in both x and y (m)",
    ),
    (
        "[[wall]]",
        "[box]\nlow = [-3, -3]\n[[wall]]",
        "box.high: missing; must be the upper right corner",
    ),
    (
        "[[wall]]",
        "[wrap]\nlow = [0, -4]\nhigh = [8, 4]\n[[wall]]",
        (
            "disk[0].position = [-1.0, 0.0]: outside [wrap]; must be from [0.0, -4.0] to [8.0,"
            " 4.0] (m)"
        ),
    ),
    (
        "[[wall]]",
        THRUST.replace("= 0\n", "= 2\n") + "[[wall]]",
        "thrust[0].disk = 2: no such disk; must be from 0 to 1",
    ),
    (
        "[[wall]]",
        THRUST.replace("= 0\n", "= -1\n") + "[[wall]]",
        "thrust[0].disk = -1: no such disk; must be from",
    ),
    (
        "[[wall]]",
        THRUST.replace("0.5", "1") + "[[wall]]",
        "thrust[0].stop = 1.0: not after start = 1.0; must be",
    ),
    (
        "[[wall]]",
        THRUST.replace("0.5", "-1") + "[[wall]]",
        "thrust[0].start = -1: must be finite and at least 0 (s)",
    ),
    (
        "[[wall]]",
        THRUST + 'frame = "up"\n[[wall]]',
        'thrust[0].frame = "up": must be "world" or "body"',
    ),
    (
        "[-1.0, 0.0]",
        "[0.6, 0.0]",
        (
            "disk[1].position = [1.0, 0.0]: overlaps disk[0] by 0.1 m; must be shifted by [0.1, 0]"
            " m or more"
        ),
    ),
    (
        "[-1.0, 0.0]",
        "[1.0, 0.0]",
        (
            "disk[1].position = [1.0, 0.0]: overlaps disk[0] by 0.5 m; must be shifted by [0.5, 0]"
            " m or more"
        ),
    ),
    (
        "[-1.0, 0.0]",
        "[-1.0, -0.9]",
        (
            "disk[0].position = [-1.0, -0.9]: overlaps wall[0] by 0.15 m; must be shifted by [0,"
            " 0.15] m or more"
        ),
    ),
    (
        "[[wall]]",
        "[box]\nlow = [-9, -9]\nhigh = [1.125, 9]\n[[wall]]",
        (
            "disk[1].position = [1.0, 0.0]: overlaps the right of [box] by 0.125 m; must be shifted"
            " by [-0.125,"
        ),
    ),
    (
        "duration = 2.0",
        "duration 2.0",
        "line 4, column 10: expected '=' after a key in a key/value pair; must be",
    ),
    ("end = [3.0, 1.0]\n", "end = [3.0, 1.0", "line 26, column 16: unclosed array; must be TOML"),
    (
        "duration = 2.0",
        f"duration = {'9' * 5000}",
        'line 4: "duration": an integer of 5000 digits; must be a number of at most 4300',
    ),
    (
        "duration = 2.0",
        f"duration = {'9' * 4301}",
        'line 4: "duration": an integer of 4301 digits; must be a number of at most 4300',
    ),
    ("duration = 2.0", f"duration = 0x{'9' * 5000}", "duration = 0x9999999999999"),
    (
        "duration = 2.0",
        f"duration = {'[' * 9000}",
        "arrays in arrays in arrays; must be as flat as a scene is",
    ),
]
