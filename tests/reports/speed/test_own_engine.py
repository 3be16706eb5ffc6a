"""An engine's file is timed like any other, also if it refuses a world in which nothing moves."""

from pathlib import Path

import pytest

from crosscheck2d.adapters.host.engine import TEMPLATES, row_of_file
from crosscheck2d.reports.run.stepping import CALL, EMPTY, READ
from crosscheck2d.reports.speed.ladder import times_of


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "measured"),
    [("walls gravity", {READ}), ("walls gravity static", {EMPTY, CALL, READ})],
)
def test_what_a_file_refuses_is_not_timed(words: str, measured: set[str], tmp_path: Path):
    # Its steps in the scene are; the empty step needs a disk that cannot move.
    path = tmp_path / "ball.js"
    line = 'models = "disks walls gravity static forces rotation wrap"'
    text = TEMPLATES["javascript"].read_text()
    assert line in text
    path.write_text(text.replace(line, f'models = "{words}"'))
    make, who = row_of_file(path).make, "ball"
    samples = times_of("bouncing_ball_e09", 0, {(who, 1, 0): make}, 1, 0.1, also={who: make})

    assert {sample.key for sample in samples} == {(who, 1, 0), *((who, each) for each in measured)}
    assert all(sample.cost > 0 for sample in samples)
