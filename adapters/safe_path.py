"""Prevents the import of stray modules from the current folder and from the folder of this program.

A student's random.py in the current folder would replace Python's own, and so would one beside
README.md where somebody has put that folder on the path. A sitecustomize.py is still run: Python
imports it before this program starts.
"""

# and nothing else than what Python has imported before such a folder was on its path, not even
# typing
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec

PACKAGE = "crosscheck2d"
TESTS = "tests"  # workers load engines from it if tests start them
PROGRAM = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # the folder of the package


class OwnPackages:
    def __init__(self) -> None:
        from importlib.machinery import PathFinder  # now: later this finder would be asked
        from importlib.util import spec_from_file_location

        self.at_place, self.finder = spec_from_file_location, PathFinder

    def find_spec(
        self, name: str, _path: object = None, _target: object = None
    ) -> "ModuleSpec | None":
        if name == PACKAGE:
            return self.at_place(name, os.path.join(PROGRAM, "__init__.py"))
        return self.finder.find_spec(name, [PROGRAM]) if name == TESTS else None


def keep_path_safe() -> None:
    """Remove the current folder and that of the program from `sys.path`.

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


def installed_folders() -> set[str]:
    """The folders of Python's own modules and of installed packages."""
    site = sys.modules.get("site")
    folders, beside = [os.path.dirname(os.__file__)], os.path.dirname(PROGRAM)
    if site is not None:
        folders += [*site.getsitepackages(), site.USER_SITE or PROGRAM]
    if any(
        name.startswith(f"{PACKAGE}-") and name.endswith(".dist-info")
        for name in os.listdir(beside)
    ):
        folders.append(beside)  # for example by `pip install --target`
    return {os.path.realpath(folder) for folder in folders}


def python(statements: str) -> list[str]:
    """The command line that runs these statements in a new Python with an equally safe path."""
    return [sys.executable, "-P", os.path.abspath(__file__), statements]


if __name__ == "__main__":  # in the new Python of `python`
    keep_path_safe()
    sys.meta_path.insert(0, OwnPackages())
    exec(sys.argv.pop(1))
