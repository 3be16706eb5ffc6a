"""Plays one input in a folder of its own and says what became of it.

The command runs in a process that is forked from one in which everything is imported: a start takes 0.05 s, not 1.5.
Where the interpreter itself is asked something (its locale, its streams), it is started as a person does.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple

SENTENCE, DONE, FINDINGS, STOPPED = "clear sentence", "done", "done, with findings", "stopped when told"
TRACEBACK, HANG, LOST, WRONG = "traceback", "hang", "file lost", "wrong exit code or sentence"
GOOD, BAD = (SENTENCE, DONE, FINDINGS, STOPPED), (TRACEBACK, HANG, LOST, WRONG)
BY_CODE = {0: DONE, 1: FINDINGS, 2: SENTENCE, 130: STOPPED, 143: STOPPED}
SECONDS = 90.0  # that an input may take on a busy machine; what is bounded by its own --timeout takes a fraction of it
LINES = 12  # of a refusal: one sentence a fault, and a few faults at once
LOADED = ["reports.cli", "reports.commands", "reports.run_command", "reports.truth_command", "reports.diff_command",
          "reports.replay_command", "reports.check.command", "reports.speed.command", "reports.stability.command",
          "reports.lessons.command", "reports.tune.command"]  # fmt: skip
CROSSCHECK = Path(sys.executable).parent / "crosscheck"
# Colours that a terminal is told, where it is one, are taken out before; nothing else may steer it.
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


class Input(NamedTuple):
    """What is tried, and what must come of it.

    Attributes:
        name: in a few words, unlike every other of its family.
        words: the command line after `crosscheck`; the current folder is the input's own.
        files: path in that folder -> what is in it; everything there is the user's, and must be there afterwards.
        prepare: what else is done in the folder before; what it makes is the user's, too.
        replaced: paths that the command may replace, or take away: it made them, or was told to write them.
        codes: exit codes that are right.
        says: what its output must hold, stdout or stderr; "" for anything.
        environment: variables that are set; then, and with `shell`, the interpreter is started anew.
        shell: a line for sh in place of `words`, with `$crosscheck` in it: streams that are closed or full.
    """

    name: str
    words: tuple[str, ...] = ()
    files: Mapping[str, str | bytes] = {}
    prepare: Callable[[Path], None] | None = None
    replaced: tuple[str, ...] = ()
    codes: tuple[int, ...] = (2,)
    says: str = ""
    environment: Mapping[str, str] = {}
    shell: str = ""


class Outcome(NamedTuple):
    """What became of an input: one of `GOOD` or `BAD`, the exit code, and what was printed."""

    word: str
    code: int | None
    printed: str


def outcome_of(tried: Input, folder: Path) -> Outcome:
    """Play an input in an empty folder."""
    user = folder / "here"
    user.mkdir(parents=True)
    for name, content in tried.files.items():
        path = user / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    if tried.prepare is not None:
        tried.prepare(user)
    before = kept(user, tried.replaced)
    code = ended(tried, user, folder)
    stdout, stderr = ((folder / name).read_text("utf-8", "backslashreplace") for name in ("stdout", "stderr"))
    lost = [name for name, digest in before.items() if kept(user, tried.replaced).get(name) != digest]
    printed = f"{stdout}\n{stderr}\nlost: {lost}" if lost else f"{stdout}\n{stderr}"
    return Outcome(word_of(tried, code, stdout, stderr, lost), code, printed)


def word_of(tried: Input, code: int | None, stdout: str, stderr: str, lost: list[str]) -> str:
    """The outcome, the worst first."""
    both = stdout + stderr
    if code is None:
        return HANG
    if "Traceback (most recent call last)" in both or re.search(r"\w(Error|Warning): ", stderr) or code < 0:
        return TRACEBACK
    if lost:
        return LOST
    refusal = [line for line in stderr.splitlines() if line.strip()]
    clear = code != 2 or 0 < len(refusal) <= LINES
    if code not in tried.codes or tried.says not in both or not clear or CONTROL.search(both.replace("\r", "")):
        return WRONG
    return BY_CODE[code]


def kept(user: Path, replaced: tuple[str, ...]) -> dict[str, str]:
    """What is in the user's folder, but for what may be replaced: path -> what tells whether it has changed."""
    found = {}
    for path in sorted(user.rglob("*")):
        name = str(path.relative_to(user))
        if any(name == one or name.startswith(f"{one}/") for one in replaced):
            continue
        if path.is_symlink():
            found[name] = os.readlink(path)
        elif path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def ended(tried: Input, user: Path, folder: Path) -> int | None:
    """Play it; its exit code, None where it had to be killed. What is printed goes into files beside `user`."""
    if tried.environment or tried.shell:
        line = ["sh", "-c", tried.shell] if tried.shell else [CROSSCHECK, *tried.words]
        env = os.environ | {"crosscheck": str(CROSSCHECK)} | dict(tried.environment)
        with (folder / "stdout").open("wb") as stdout, (folder / "stderr").open("wb") as stderr:
            process = subprocess.Popen(
                line, cwd=user, env=env, stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr, start_new_session=True
            )
            try:
                return process.wait(SECONDS)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                return None
    forked = context().Process(target=child, args=(tried.words, user, folder))
    forked.start()
    return code_of(forked)


def context() -> multiprocessing.context.ForkServerContext:
    """Where processes are forked from: one that has imported everything, and has no thread."""
    forks = multiprocessing.get_context("forkserver")
    forks.set_forkserver_preload(LOADED)
    return forks


def code_of(process: BaseProcess) -> int | None:
    """Wait for it; None where it had to be killed, with all that it had started."""
    process.join(SECONDS)
    if process.exitcode is None:
        assert process.pid is not None
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
        return None
    return process.exitcode


def child(words: tuple[str, ...], user: Path, folder: Path) -> None:
    """The command in a forked process, which leads a group of its own."""
    from reports.__main__ import main

    os.setsid()
    for number, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT, 0o644), number)
    os.chdir(user)
    sys.argv = ["crosscheck", *words]
    sys.exit(main())
