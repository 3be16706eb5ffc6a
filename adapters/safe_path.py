"""Keeps modules that only lie about from being imported: of the current folder, and of the one that
this program is in.

What lies where a command is started is no part of it: a student's random.py would be run in the
place of Python's own. Nor is a scipy.py beside README.md, where people are reported to stand: an
installation that can be edited puts that folder on the path, for the sake of four packages. Those
alone are found there. A sitecustomize.py there is run all the
same: Python does that by itself, before anything of this program.
"""

# and nothing else than what Python has imported before such a folder was on its path, not even
# typing
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec

PROGRAM = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PACKAGES = ("adapters", "reference_impl", "reports", "scenarios")
TESTS = "tests"  # of which a worker takes engines, where those who start it are tests


class OwnPackages:
    """Finds the packages of this program where it lies, and nothing else that lies there."""

    def __init__(self, names: tuple[str, ...]) -> None:
        from importlib.machinery import PathFinder  # now, as it would be asked for itself

        self.names, self.finder = names, PathFinder

    def find_spec(
        self, name: str, _path: object = None, _target: object = None
    ) -> "ModuleSpec | None":
        """As `sys.meta_path` asks for it."""
        return self.finder.find_spec(name, [PROGRAM]) if name in self.names else None


def keep_path_safe(names: tuple[str, ...] = PACKAGES) -> None:
    """Take the current folder and that of the program off `sys.path`; the packages of these names
    are still found.

    Python has put the current one there for `python -m`, and for an empty entry of PYTHONPATH, as
    in `$PYTHONPATH:/else` where nothing was set before. A folder of installed packages, or of
    Python's own, stays where it was last.
    """
    unsafe = {os.path.realpath(PROGRAM)}
    try:  # noqa: SIM105 - a foreign `contextlib` might be found
        unsafe.add(os.path.realpath(os.getcwd()))
    except OSError:
        pass  # nothing lies in a folder that is gone
    installed, path = installed_folders(), sys.path[:]
    real = [os.path.realpath(folder) for folder in path]
    sys.path[:] = [
        folder
        for k, folder in enumerate(path)
        if folder
        and (real[k] not in unsafe or (real[k] in installed and real[k] not in real[k + 1 :]))
    ]
    sys.meta_path.insert(0, OwnPackages(names))


def installed_folders() -> set[str]:
    """The folders of Python's own modules and of installed packages."""
    site = sys.modules.get("site")
    folders = [os.path.dirname(os.__file__)]
    if site is not None:
        folders += [*site.getsitepackages(), site.USER_SITE or PROGRAM]
    if any(
        name.startswith("crosscheck2d-") and name.endswith(".dist-info")
        for name in os.listdir(PROGRAM)
    ):
        folders.append(PROGRAM)  # by `pip install --target`, say
    return {os.path.realpath(folder) for folder in folders}


def python(statements: str) -> list[str]:
    """The words that start this Python with as safe a path, which does these statements of this
    program."""
    names = (*PACKAGES, TESTS) if TESTS in sys.modules else PACKAGES
    begin = (
        f"import sys; sys.path.insert(0, {PROGRAM!r}); from adapters.safe_path import"
        " keep_path_safe"
    )
    return [sys.executable, "-P", "-c", f"{begin}; keep_path_safe({names!r}); {statements}"]


def path_of_this() -> str:
    """PYTHONPATH of a process that is to find what this one finds."""
    program = os.path.realpath(PROGRAM)
    return os.pathsep.join(
        folder for folder in sys.path if folder and os.path.realpath(folder) != program
    )
