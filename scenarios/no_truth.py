"""The one refusal of everything that answers exactly."""

from __future__ import annotations


class NoTruth(ValueError):
    """A scene has no exact answer from `at` s on; str() says why, in one sentence."""

    def __init__(self, reason: str, at: float = 0.0) -> None:
        super().__init__(reason)
        self.at = at
