"""The lessons in reading order."""

from __future__ import annotations

from crosscheck2d.reports.lessons.box import BOX
from crosscheck2d.reports.lessons.crowd import COST
from crosscheck2d.reports.lessons.friction.bounce import BOUNCE
from crosscheck2d.reports.lessons.friction.cone import CONE
from crosscheck2d.reports.lessons.friction.lever import LEVER
from crosscheck2d.reports.lessons.friction.rolling import ROLLING
from crosscheck2d.reports.lessons.horizon import HORIZON
from crosscheck2d.reports.lessons.lesson import Lesson
from crosscheck2d.reports.lessons.limits import LIMITS
from crosscheck2d.reports.lessons.mechanisms.cap import CAP
from crosscheck2d.reports.lessons.mechanisms.correction import CORRECTION
from crosscheck2d.reports.lessons.mechanisms.digits import DIGITS
from crosscheck2d.reports.lessons.mechanisms.float32 import SINGLE
from crosscheck2d.reports.lessons.mechanisms.gravity import GRAVITY
from crosscheck2d.reports.lessons.mechanisms.javascript import JAVASCRIPT
from crosscheck2d.reports.lessons.mechanisms.mixing import MIXING_RULE
from crosscheck2d.reports.lessons.mechanisms.order import ORDER
from crosscheck2d.reports.lessons.mechanisms.row import ROW
from crosscheck2d.reports.lessons.mechanisms.substeps import SUBSTEPS
from crosscheck2d.reports.lessons.mechanisms.threshold import THRESHOLD
from crosscheck2d.reports.lessons.meeting import MEETING
from crosscheck2d.reports.lessons.particle import PARTICLE
from crosscheck2d.reports.lessons.thrust import THRUST

ALL = (
    PARTICLE,
    THRUST,
    BOX,
    MEETING,
    COST,
    THRESHOLD,
    MIXING_RULE,
    ORDER,
    GRAVITY,
    CORRECTION,
    SUBSTEPS,
    DIGITS,
    CAP,
    ROW,
    SINGLE,
    JAVASCRIPT,
    HORIZON,
    LIMITS,
    BOUNCE,
    CONE,
    LEVER,
    ROLLING,
)
LESSONS: dict[str, Lesson] = {lesson.name: lesson for lesson in ALL}
