"""Cross-validation of 2D disk solvers: the same scenes through every engine, each judged against an
exact answer.

`scene`, `run`, `truth`, `check` and `advise` do what the commands do, and what they return shows
itself in a notebook. They are imported when they are first used: it takes seconds.
"""

TYPE_CHECKING = False  # nothing is imported here: this is run before the path is safe
if TYPE_CHECKING:
    from crosscheck2d.reports.notebook import advise, check, run, scene, truth

__all__ = ["advise", "check", "run", "scene", "truth"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from crosscheck2d.reports import notebook

    return getattr(notebook, name)


def __dir__() -> list[str]:
    return __all__
