"""What is put in place of what in a good scene file, and what the reader must say of it."""

from pathlib import Path

SCENES = Path(__file__).parents[2] / "tests" / "data" / "scenes"
TWO = (SCENES / "two.toml").read_text()
DISK = "[[disk]]\nposition = [-1.0, 0.0]\nvelocity = [1.0, 0.0]\nradius = 0.25\nmass = 1.0\n"
THRUST = "\n[[thrust]]\ndisk = 0\nstart = 0.5\nstop = 1.0\nforce = [0.1, 0.0]\n"

# What is put in place of what in two.toml, and what the reader must say of it (after "two.toml: ").
FAULTS = [
    ("radius = 0.25", "radius = -0.25", "disk[0].radius = -0.25: must be positive and finite (m)"),
    ("radius = 0.25", "radius = 0", "disk[0].radius = 0: must be positive and finite (m)"),
    ("radius = 0.25", "radius = inf", "disk[0].radius = inf: must be positive and finite (m)"),
    (
        "radius = 0.25",
        "radius = true",
        "disk[0].radius = true: of type boolean; must be positive and finite (m)",
    ),
    ("radius = 0.25", "", "disk[0].radius: missing; must be positive and finite (m)"),
    (
        "radius = 0.25",
        "radius = 1e-200",
        "disk[0].radius = 1e-200: out of scale; must be from 1e-09 to 1e+09 (SI)",
    ),
    (
        "mass = 2.0",
        "mass = nan",
        "disk[1].mass = nan: must be positive and finite (kg); left out if static",
    ),
    (
        "mass = 2.0",
        "mass = inf",
        "disk[1].mass = inf: must be positive and finite (kg); left out if static",
    ),
    (
        "mass = 2.0",
        "",
        "disk[1].mass: missing; must be positive and finite (kg); left out if static",
    ),
    (
        "mass = 2.0",
        'mass = "2 kg"',
        (
            'disk[1].mass = "2 kg": of type string; must be positive and finite (kg); left out if'
            " static"
        ),
    ),
    (
        "mass = 2.0",
        "mass = 2.0\ninertia = 0",
        "disk[1].inertia = 0: must be positive (kg m2); inf: it does not turn",
    ),
    (
        "mass = 2.0",
        "static = true",
        "disk[1].velocity = [-1.0, 0.0]: the disk is static; must be zero or left out",
    ),
    (
        "mass = 2.0",
        "mass = 2.0\nstatic = 1",
        "disk[1].static = 1: of type integer; must be true or false",
    ),
    (
        "radius = 0.25",
        "raduis = 0.25\nradius = 1",
        "disk[0].raduis = 0.25: unknown key; did you mean radius?",
    ),
    (
        "velocity = [1.0, 0.0]",
        "",
        "disk[0].velocity: missing; must be two finite numbers [x, y] (m/s)",
    ),
    (
        "[-1.0, 0.0]",
        "[-1.0]",
        "disk[0].position = [-1.0]: 1 item; must be two finite numbers [x, y] (m)",
    ),
    (
        "[-1.0, 0.0]",
        "[-1.0, 0.0, 0.0]",
        "disk[0].position = [-1.0, 0.0, 0.0]: 3 items; must be two finite numbers [x, y] (m)",
    ),
    (
        "[-1.0, 0.0]",
        "[nan, 0.0]",
        "disk[0].position[0] = nan: must be two finite numbers [x, y] (m)",
    ),
    (
        "[-1.0, 0.0]",
        '"left"',
        'disk[0].position = "left": of type string; must be two finite numbers [x, y] (m)',
    ),
    (
        "[-1.0, 0.0]",
        "{x = 1}",
        "disk[0].position = {...}: of type table; must be two finite numbers [x, y] (m)",
    ),
    (
        "[-1.0, 0.0]",
        "2020-01-01",
        "disk[0].position = 2020-01-01: of type date; must be two finite numbers [x, y] (m)",
    ),
    ('name = "two-disks"', "", "name: missing; must be at most 100 of a-z, 0-9, '_' and '-'"),
    (
        '"two-disks"',
        '"Two disks"',
        "name = \"Two disks\": must be at most 100 of a-z, 0-9, '_' and '-'",
    ),
    ('"two-disks"', '"two\\n"', "name = \"two\\n\": must be at most 100 of a-z, 0-9, '_' and '-'"),
    (
        "asks = ",
        "ask = ",
        'ask = "Does a head-on collision keep momentum?": unknown key; did you mean asks?',
    ),
    ("asks = ", "a.b = ", "a = {...}: unknown key; must be one of name, asks, duration,"),
    ("restitution = 0.9", "restitution = 1.5", "restitution = 1.5: must be from 0 to 1"),
    ("restitution = 0.9", "restitution = -0.1", "restitution = -0.1: must be from 0 to 1"),
    ("restitution = 0.9", "", "restitution: missing; must be from 0 to 1"),
    (
        "restitution = 0.9",
        "restitution = 0.9\nfriction = -0.5",
        "friction = -0.5: must be finite and at least 0",
    ),
    (
        "restitution = 0.9",
        "restitution = 0.9\nfriction = inf",
        "friction = inf: must be finite and at least 0",
    ),
    (
        "restitution = 0.9",
        "restitution = 0.9\nfriction = nan",
        "friction = nan: must be finite and at least 0",
    ),
    (
        "restitution = 0.9",
        'restitution = 0.9\nfriction = "rough"',
        'friction = "rough": of type string; must be finite and at least 0',
    ),
    (
        "restitution = 0.9",
        "restitution = 0.9\nfriction = 1e-12",
        "friction = 1e-12: out of scale; must be from 1e-09 to 1e+09 (SI)",
    ),
    (
        "restitution = 0.9",
        "restitution = 1\ngravity = 9.81",
        "gravity = 9.81: of type float; must be two finite",
    ),
    ("duration = 2.0", "duration = 0", "duration = 0: must be positive and finite (s)"),
    (
        "sample_interval = 0.02",
        "sample_interval = 0.03",
        (
            "sample_interval = 0.03: does not divide the duration 2.0 s; "
            "must go into it a whole number of times, as 0.0298507462686567 does"
        ),
    ),
    (
        "sample_interval = 0.02",
        "sample_interval = 5.0",
        (
            "sample_interval = 5.0: does not divide the duration 2.0 s; must go into it a whole"
            " number of times, as 2 does"
        ),
    ),
    (
        "= 0.02",
        "= 1e-300",
        "sample_interval = 1e-300: out of scale; must be from 1e-09 to 1e+09 (SI)",
    ),
    ("= 0.02", "= 1e-9", "sample_interval = 1e-09: 2e+09 samples; must give at most 10000000"),
    (
        "[1.0, 0.0]",
        "[1e160, 0.0]",
        "disk[0].velocity[0] = 1e+160: out of scale; must be from -1e+09 to 1e+09 (SI)",
    ),
    (
        "= 0.02",
        "= 0.02\nsubsteps = [1000000000]",
        "substeps = [1000000000]: more than 10000000 steps in all; must give at most 10000000",
    ),
    (
        "= 0.02",
        "= 2e-6",
        "substeps = [1, 2, 4, 8]: 15000000 steps in all; must give at most 10000000",
    ),
    (
        "= 0.02",
        "= 0.02\nsubsteps = []",
        "substeps = []: 0 items; must be whole numbers from 1, increasing",
    ),
    (
        "= 0.02",
        "= 0.02\nsubsteps = [1, 2.5]",
        "substeps[1] = 2.5: of type float; must be whole numbers from 1, increasing",
    ),
    (
        "= 0.02",
        "= 0.02\nsubsteps = [0, 1]",
        "substeps[0] = 0: must be whole numbers from 1, increasing",
    ),
    (
        "= 0.02",
        "= 0.02\nsubsteps = [4, 2]",
        "substeps = [4, 2]: not increasing; must be whole numbers from 1, increasing",
    ),
    (
        "= 0.02",
        "= 0.02\nsubsteps = [1, 1000000]",
        "substeps = [1, 1000000]: 100000100 steps in all; must give at",
    ),
    (
        "start = [-3.0, -1.0]",
        "start = [3, -1]",
        "wall[0].end = [3.0, -1.0]: the wall has no length; must differ",
    ),
    ("start = [-3.0, -1.0]", "", "wall[0].start: missing; must be two finite numbers [x, y] (m)"),
    (
        "[[wall]]",
        "[thrust]\ndisk = 0\n[[wall]]",
        "thrust = {...}: of type table; must be [[thrust]] tables",
    ),
    ("= 0.02", "= 0.02\nbox = 4", "box = 4: of type integer; must be a table"),
    ("= 0.02", "= 0.02\nthrust = 4", "thrust = 4: of type integer; must be [[thrust]] tables"),
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
    ("duration = 2.0", f"duration = 0x{'9' * 5000}", "duration = 0x9999999999999"),
    (
        "duration = 2.0",
        f"duration = {'[' * 9000}",
        "arrays in arrays in arrays; must be as flat as a scene is",
    ),
]
