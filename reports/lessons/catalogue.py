"""The lessons in reading order."""

from __future__ import annotations

from reports.lessons.crowd import COST, HORIZON
from reports.lessons.lesson import Lesson
from reports.lessons.limits import LIMITS
from reports.lessons.mechanisms import MECHANISMS
from reports.lessons.meeting import MEETING
from reports.lessons.motion import BOX, PARTICLE, THRUST

ALL = (PARTICLE, THRUST, BOX, MEETING, COST, *MECHANISMS, HORIZON, LIMITS)
LESSONS: dict[str, Lesson] = {lesson.name: lesson for lesson in ALL}
