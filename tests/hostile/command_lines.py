"""Command lines that ask for what is not there, or cannot be."""

from __future__ import annotations

from tests.hostile.played import Input
from tests.hostile.small_run import TWO

# Words, and what must be said of them.
REFUSED: dict[str, tuple[str | tuple[str, ...], str]] = {
    "a command that does not exist": ("jump", "No such command"),
    "a command in capitals": ("RUN", "No such command"),
    "an empty command": (("",), "No such command"),
    "a command that acts on a terminal": (("\x1b[31m\x07",), "No such command"),
    "a command in markup": (("[/nope]",), "No such command"),
    "an option that does not exist": ("run --fast", "--fast"),
    "an option of another command": ("diff --seed 1 a b", "--seed"),
    "an option without its value": ("run --out", "--out"),
    "a value for a flag": ("run --full=yes", "--full"),
    "a scenario that is misspelt": ("run free_fal", "free_fall"),
    "an empty scenario": (("run", ""), "is not known"),
    "a scenario with a null byte's name": (("run", "\\0"), "is not known"),
    "a scenario of 100000 letters": (("truth", "x" * 100_000), "is not known"),
    "a scenario in markup": (("run", "[/nope]"), "[/nope]"),
    "a scenario in capitals": ("run FREE_FALL", "is not known"),
    "two scenarios that are none": ("run one two", "'two' is not known"),
    "an engine that is misspelt": ("run --engine boxed2d", "box2d"),
    "an empty engine": (("run", "--engine", ""), "is not known"),
    "an engine that is a colon": ("run --engine :", "is not known"),
    "a profile that does not exist": ("run --engine pymunk:best", "is not known"),
    "an engine in escape codes": (("run", "--engine", "\x1b[31m"), "\\x1b[31m"),
    "an engine that is a folder": ("run --engine .", "is not known"),
    "a step of zero": ("run free_fall --dt 0", "0"),
    "a step backwards": ("run free_fall --dt -0.02", "-0.02"),
    "a step that is not a number": ("run free_fall --dt nan", "nan"),
    "an infinite step": ("run free_fall --dt inf", "inf"),
    "a step that is text": ("run free_fall --dt small", "--dt"),
    "a step that does not divide": ("run free_fall --dt 0.0123", "0.0123"),
    "a step of the smallest float": ("run free_fall --dt 5e-324", ""),
    "a step longer than the scene": ("run free_fall --dt 1e9", ""),
    "too many steps": ("run free_fall --dt 1e-12", ""),
    "two steps of which one is none": ("run free_fall --dt 0.01 --dt x", "--dt"),
    "a negative seed": ("run --seed -1", "--seed"),
    "half a seed": ("run --seed 0.5", "--seed"),
    "a seed of 5000 digits": (("truth", "slow_collision", "--seed", "9" * 5000), "--seed"),
    "a negative number of workers": ("run --workers -1", "--workers"),
    "workers in text": ("run --workers all", "--workers"),
    "no time": ("run --timeout 0", "--timeout"),
    "time backwards": ("truth slow_collision --timeout -5", "--timeout"),
    "time that is not a number": ("truth slow_collision --timeout nan", "--timeout"),
    "time without end": ("run --timeout inf", "--timeout"),
    "an age": ("run --timeout 1e30", "--timeout"),
    "a megabyte": ("run --memory 1", "--memory 1"),
    "memory backwards": ("run --memory -1", "--memory"),
    "memory of 400 digits": (("run", "--memory", "9" * 400), "--memory"),
    "timings backwards": ("run --timings -3", "--timings"),
    "a scheduler that is none": ("run free_fall --scheduler here", "here"),
    "a scheduler that does not answer": (
        "run free_fall --scheduler tcp://127.0.0.1:1",
        "tcp://127.0.0.1:1",
    ),
    "a scheduler in escape codes": (("run", "free_fall", "--scheduler", "tcp://\x1b[31m"), ""),
    "truth of nothing": ("truth", "Missing argument"),
    "truth of two": ("truth slow_collision free_fall", "free_fall"),
    "truth of a scenario that does not exist": ("truth slow_hitt", "slow_collision"),
    "truth of an engine": ("truth pymunk", "is not known"),
    "report of nothing": ("report", "Missing argument"),
    "diff of one": ("diff a", "Missing argument"),
    "diff of three": ("diff a b c", "c"),
    "check of nothing": ("check", "Missing argument"),
    "check of what is empty": (("check", ""), ""),
    "a list of what does not exist": ("list solvers", "solvers"),
    "a list of engines in capitals": ("list ENGINES", "is not known"),
    "a list of two": ("list engines metrics", "metrics"),
    "a lesson that does not exist": ("lesson ordre", "order"),
    "an empty lesson to a page": (("lesson", "--export", ""), ""),
    "a case that does not exist": ("stability slow_hitt", "slow_collision"),
    "a scenario as a case": ("stability free_fall", "free_fall"),
    "workers of stability in text": ("stability --workers x", "--workers"),
    "speed of a scenario that does not exist": ("speed free", "is not known"),
    "speed with a seed in text": ("speed --seed one", "--seed"),
    "an engine without settings": ("tune reference", "reference"),
    "an engine to tune that does not exist": ("tune bullet", "bullet"),
    "a flight that is a scenario": ("play free_fall", "free_fall"),
    "a flight that is not there": ("play nowhere.toml", "nowhere.toml"),
    "a flight that is a folder": ("play .", "."),
    "seventeen engines in flight": (
        (
            "play",
            *(
                word
                for _ in range(1)
                for name in ("reference", "pymunk", "box2d", "bullet")
                for word in ("--engine", name)
            ),
        ),
        "bullet",
    ),
    "help in a wrong place": ("--helpp", "--helpp"),
    "a separator of the shell": (("run", ";", "rm", "-rf", "x"), ""),
    "a line of 3000 words": (("run", *(f"s{k}" for k in range(9))), "'s8' is not known"),
    "a word of other letters": ("run 保存 Ünï", "保存"),
    "what is left of a variable": (("run", "$SCENE"), "$SCENE"),
    "a pattern that found nothing": ("run *.toml", "*.toml"),
    "a home that a shell did not find": (("truth", "~/two.toml"), "~/two.toml"),
    "a URL": ("run https://example.com/two.toml", "https:"),
}

PLAYED = "run two.toml --engine pymunk:shipped --dt 0.02 --out out"
DONE: dict[str, tuple[str, tuple[int, ...], str]] = {
    "a thousand workers": (f"{PLAYED} --workers 1000", (0,), "1 cell ended: 1 ok"),
    "workers of 18 digits": (f"{PLAYED} --workers {'9' * 18}", (0,), ""),
    "more memory than there is": (f"{PLAYED} --workers 1 --memory 1000000000", (0,), "1 ok"),
    "a scene twice": (
        f"run two.toml {PLAYED.removeprefix('run ')} --workers 1",
        (0,),
        "1 cell ended",
    ),
    "an engine twice": (f"{PLAYED} --engine pymunk:shipped --workers 1", (0,), "1 cell ended"),
    "a step twice": (f"{PLAYED} --dt 0.02 --workers 1", (0,), "1 cell ended"),
    "an option twice": (
        f"{PLAYED} --workers 9 --workers 1 --seed 1 --seed 2",
        (0,),
        "1 cell ended",
    ),
    "a seed of 18 digits": (("truth", "two.toml", "--seed", "9" * 18), (0,), "horizon"),
    "a tenth of a second": ("truth two.toml --timeout 0.1", (0,), ""),
    "no words at all but help": ("--help", (0,), "Commands"),
    "help after nonsense": ("run nonsense --help", (0,), "Options"),
    "a list of everything": ("list", (0,), "free_fall"),
}
LINES = (
    *(Input(name, words, says=says) for name, (words, says) in REFUSED.items()),
    *(
        Input(name, words, {"two.toml": TWO}, codes=codes, says=says, writes=("out", "out.part"))
        for name, (words, codes, says) in DONE.items()
    ),
    *(
        Input(f"help of {command}", (command, "--help"), codes=(0,), says="Usage")
        for command in (
            "run",
            "truth",
            "report",
            "diff",
            "check",
            "play",
            "lesson",
            "speed",
            "stability",
            "tune",
            "list",
        )
    ),
)
