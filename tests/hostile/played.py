"""Plays one input in a folder of its own and says what became of it.

The command runs in a process that is forked from one in which everything is imported: a start takes
0.05 s, not 1.5. Where the interpreter itself is asked something (its locale, its streams), it is
started as a person does.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, NamedTuple

from tests.forks import crosscheck_in, start
from tests.hostile.talks import NOT_ANY_MORE, free_port, hear

SENTENCE, DONE, FINDINGS, STOPPED = (
    "clear sentence",
    "done",
    "done, with findings",
    "stopped when signalled",
)
TRACEBACK, HANG, LOST, STRAY = "traceback", "hang", "file lost", "file where none was asked for"
LEFT, WRONG = "process left behind", "wrong exit code or sentence"
GOOD, BAD = (SENTENCE, DONE, FINDINGS, STOPPED), (TRACEBACK, HANG, LOST, STRAY, LEFT, WRONG)
BY_CODE = {0: DONE, 1: FINDINGS, 2: SENTENCE, 130: STOPPED, 143: STOPPED}
# that an input may take on a busy machine; what is bounded by its own --timeout takes a fraction of
# it
SECONDS = 90.0
# of a refusal: one sentence a fault, as many as the reader of scenes lists, and one that there are
# more
LINES = 101
GRACE = 3.0  # s in which a process that has been signalled to end is gone
CROSSCHECK = Path(sys.executable).parent / "crosscheck"
WIDE = {"COLUMNS": "400"}  # so that no sentence is broken where a line ends
# What Python says by itself: an exception that nobody caught, or one in a destructor; a warning; a
# crash in C.
RAW = re.compile(
    r"Traceback \(most recent call last\)|^[\w.]+(Error|Exception|Interrupt|Exit)(: |$)|:\d+:"
    r" \w*Warning: "
    r"|Exception ignored|Fatal Python error|Segmentation fault|resource_tracker",
    re.MULTILINE,
)
# Line ends but for a newline, escape codes, what turns text round: nothing but a terminal's own
# progress may steer it.
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


class Input(NamedTuple):
    """What is tried, and what must come of it.

    Attributes:
        name: in a few words, unlike every other of its family.
        words: the command line after `crosscheck`; the current folder is the input's own.
        files: path in that folder -> what is in it; everything there is the user's, and must be
            there afterwards.
        prepare: what else is done in the folder before; what it makes is the user's, too. It may
            give what some of the `words` stand for.
        writes: paths that the command may make, replace or take away; nothing else there may come
            or go.
        codes: exit codes that are right.
        says: what its output must hold, stdout or stderr; "" for anything.
        environment: variables that are set; then, and with `shell`, the interpreter is started
            anew.
        shell: a line for sh in place of `words`, with `$crosscheck` in it: streams that are closed
            or full.
        talk: of a command that serves: what is sent to the port, and gives what is heard, in which
            `says` is looked for, too. Then it must serve on, until it is signalled to stop.
    """

    name: str
    words: str | tuple[str, ...] = ()
    files: Mapping[str, str | bytes] = {}
    prepare: Callable[[Path], Any] | None = None
    writes: tuple[str, ...] = ()
    codes: tuple[int, ...] = (2,)
    says: str = ""
    environment: Mapping[str, str] = {}
    shell: str = ""
    talk: Callable[[int], str] | None = None

    @property
    def line(self) -> tuple[str, ...]:
        return tuple(shlex.split(self.words)) if isinstance(self.words, str) else self.words


class Outcome(NamedTuple):
    word: str
    code: int | None
    printed: str


def outcome_of(tried: Input, folder: Path) -> Outcome:
    user = folder / "here"
    user.mkdir(parents=True)
    for name, content in tried.files.items():
        path = user / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    meant = tried.prepare(user) if tried.prepare is not None else None
    if isinstance(meant, dict):
        tried = tried._replace(words=tuple(meant.get(word, word) for word in tried.line))
    before = kept(user, tried.writes)
    code, heard = ended(tried, user, folder)
    left = left_behind(user)
    stdout, stderr = (
        (folder / name).read_text("utf-8", "backslashreplace") for name in ("stdout", "stderr")
    )
    after = kept(user, tried.writes)
    lost = [name for name, what in before.items() if after.get(name) != what]
    stray = [name for name in after if name not in before]
    stray += [
        path.name for path in folder.iterdir() if path.name not in ("here", "stdout", "stderr")
    ]
    printed = "\n".join(
        [
            stdout,
            stderr,
            heard,
            *(f"{what}: {found}" for what, found in (("lost", lost), ("stray", stray)) if found),
        ]
    )
    return Outcome(
        word_of(tried, code, stdout, stderr, heard, bool(lost), bool(stray), left), code, printed
    )


def word_of(
    tried: Input,
    code: int | None,
    stdout: str,
    stderr: str,
    heard: str,
    lost: bool,
    stray: bool,
    left: bool,
) -> str:
    both = stdout + stderr
    if code is None:
        return HANG
    if RAW.search(both) or code < 0:
        return TRACEBACK
    if lost or stray or left:
        return LOST if lost else STRAY if stray else LEFT
    refusal = [line for line in stderr.splitlines() if line.strip()]
    clear = 0 < len(refusal) <= LINES if code == 2 else code != 1 or both.strip()
    right = code in tried.codes and tried.says in both + heard and NOT_ANY_MORE not in heard
    return BY_CODE[code] if right and clear and not CONTROL.search(both) else WRONG


def kept(user: Path, writes: tuple[str, ...]) -> dict[str, str]:
    """What is in the user's folder, but for what may be written: path -> its content's hash."""
    found = {}
    for path in sorted(user.rglob("*")):
        name = str(path.relative_to(user))
        if any(name == one or name.startswith(f"{one}/") for one in writes):
            continue
        mode = path.lstat().st_mode
        if stat.S_ISLNK(mode):
            found[name] = os.readlink(path)
        elif stat.S_ISREG(mode):
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            found[name] = oct(stat.S_IFMT(mode))
    return found


def ended(tried: Input, user: Path, folder: Path) -> tuple[int | None, str]:
    if tried.environment or tried.shell:
        line = ["sh", "-c", tried.shell] if tried.shell else [CROSSCHECK, *tried.line]
        env = os.environ | {"crosscheck": str(CROSSCHECK)} | WIDE | dict(tried.environment)
        with (folder / "stdout").open("wb") as stdout, (folder / "stderr").open("wb") as stderr:
            process = subprocess.Popen(
                line,
                cwd=user,
                env=env,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
            )
            try:
                return process.wait(SECONDS), ""
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                return None, ""
    port = free_port() if tried.talk is not None else 0
    words = tuple(word.replace("PORT", str(port)) if port else word for word in tried.line)
    forked = start(crosscheck_in, words, user, folder, WIDE)
    heard = "" if tried.talk is None else hear(tried.talk, forked, folder / "stdout")
    return code_of(forked), heard


def code_of(process: BaseProcess) -> int | None:
    process.join(SECONDS)
    if process.exitcode is None:
        assert process.pid is not None
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
        return None
    return process.exitcode


def left_behind(user: Path) -> bool:
    end = time.monotonic() + GRACE
    while (found := working_in(user)) and time.monotonic() < end:
        time.sleep(0.05)
    for pid in found:
        os.kill(pid, signal.SIGKILL)
    return bool(found)


def working_in(user: Path) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and f"{os.readlink(entry / 'cwd')}/".startswith(
                f"{user.resolve()}/"
            ):
                found.append(int(entry.name))
        except OSError:
            continue  # it has ended, or is somebody else's
    return found
