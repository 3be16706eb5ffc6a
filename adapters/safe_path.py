"""Prevents the import of stray modules from the current folder and from the folder of this program.

A student's random.py in the current folder would replace Python's own. A scipy.py beside README.md
would be found, too, because an editable installation puts that folder on the path for the sake of
four packages. Only these four are found there. A sitecustomize.py is still run: Python imports it
before this program starts.
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
TESTS = "tests"  # workers load engines from it if tests start them


class OwnPackages:
    """Finds the packages of this program in its folder, and nothing else there."""

    def __init__(self, names: tuple[str, ...]) -> None:
        from importlib.machinery import PathFinder  # now: later this finder would be asked

        self.names, self.finder = names, PathFinder

    def find_spec(
        self, name: str, _path: object = None, _target: object = None
    ) -> "ModuleSpec | None":
        """Called through `sys.meta_path`."""
        return self.finder.find_spec(name, [PROGRAM]) if name in self.names else None


def keep_path_safe(names: tuple[str, ...] = PACKAGES) -> None:
    """Remove the current folder and that of the program from `sys.path`; the packages `names` are
    still found.

    Python adds the current folder for `python -m`, and for an empty entry of PYTHONPATH, as in
    `$PYTHONPATH:/else` if PYTHONPATH was not set. A folder of installed packages, or of Python's
    own, stays at its last position.
    """
    unsafe = {os.path.realpath(PROGRAM)}
    try:  # noqa: SIM105 - a foreign `contextlib` might be found
        unsafe.add(os.path.realpath(os.getcwd()))
    except OSError:
        pass  # a deleted folder contains nothing
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
        folders.append(PROGRAM)  # for example by `pip install --target`
    return {os.path.realpath(folder) for folder in folders}


def python(statements: str) -> list[str]:
    """The command line that runs these statements in a new Python with an equally safe path."""
    names = (*PACKAGES, TESTS) if TESTS in sys.modules else PACKAGES
    begin = (
        f"import sys; sys.path.insert(0, {PROGRAM!r}); from crosscheck2d.adapters.safe_path import"
        " keep_path_safe"
    )
    return [sys.executable, "-P", "-c", f"{begin}; keep_path_safe({names!r}); {statements}"]


def path_of_this() -> str:
    """PYTHONPATH for a process that finds the same modules as this one."""
    program = os.path.realpath(PROGRAM)
    return os.pathsep.join(
        folder for folder in sys.path if folder and os.path.realpath(folder) != program
    )
