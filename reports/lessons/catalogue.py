"""The lessons in reading order."""

from __future__ import annotations

from reports.lessons.box import BOX
from reports.lessons.crowd import COST
from reports.lessons.friction.bounce import BOUNCE
from reports.lessons.friction.cone import CONE
from reports.lessons.friction.lever import LEVER
from reports.lessons.friction.rolling import ROLLING
from reports.lessons.horizon import HORIZON
from reports.lessons.lesson import Lesson
from reports.lessons.limits import LIMITS
from reports.lessons.mechanisms.cap import CAP
from reports.lessons.mechanisms.correction import CORRECTION
from reports.lessons.mechanisms.digits import DIGITS
from reports.lessons.mechanisms.float32 import SINGLE
from reports.lessons.mechanisms.gravity import GRAVITY
from reports.lessons.mechanisms.javascript import JAVASCRIPT
from reports.lessons.mechanisms.mixing import MIXING_RULE
from reports.lessons.mechanisms.order import ORDER
from reports.lessons.mechanisms.row import ROW
from reports.lessons.mechanisms.substeps import SUBSTEPS
from reports.lessons.mechanisms.threshold import THRESHOLD
from reports.lessons.meeting import MEETING
from reports.lessons.particle import PARTICLE
from reports.lessons.thrust import THRUST

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
