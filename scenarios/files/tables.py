"""The tables of a scene file, and the values allowed for each key; scene_file.py reports the
faults.

A description completes the sentence "KEY = VALUE: must be ...". A check that needs two keys sits on
the later one, so that a fault in one key never hides the faults of another.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

MOST_DISKS = 100_000
MOST_WALLS = 10_000
# disks times walls; all their distances are computed when a scene is read: some 2 s
MOST_PAIRS = 20_000_000
MOST_STEPS = 10_000_000  # over the whole dt ladder, for one engine
SMALLEST, LARGEST = 1e-9, 1e9
"""The scale of a scene, SI: no number of it is larger than `LARGEST`, nothing that has a size
(radius, mass, time, wall, box) is smaller than `SMALLEST`. So no square, energy or path that is
made of a few of them leaves float64."""


def in_scale(value: float) -> float:
    """Any number of a scene but those that may be infinite, or have a size."""
    if abs(value) > LARGEST:
        raise ValueError(f"out of scale; must be from {-LARGEST:g} to {LARGEST:g} (SI)")
    return value


def of_size(value: float, power: int = 1) -> float:
    """What is positive; `power`: the product of so many such numbers. What is not positive has
    another fault."""
    smallest, largest = SMALLEST**power, LARGEST**power
    if value > 0 and not smallest <= value <= largest:
        raise ValueError(f"out of scale; must be from {smallest:g} to {largest:g} (SI)")
    return value


Strict = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Finite = Annotated[Strict, AfterValidator(in_scale)]
Size = Annotated[Strict, AfterValidator(of_size)]
Time = Annotated[
    float,
    Field(strict=True),
    AfterValidator(lambda value: value if math.isinf(value) else in_scale(value)),
]
# kg m m; what is infinite does not turn
Inertia = Annotated[
    float,
    Field(strict=True),
    AfterValidator(lambda value: value if math.isinf(value) else of_size(value, power=3)),
]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Count = Annotated[int, Field(strict=True, ge=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid")


class DiskTable(_Table):
    static: bool = Field(False, strict=True, description="true or false")
    position: Pair = Field(description="two finite numbers [x, y] (m)")
    velocity: Pair | None = Field(
        None, validate_default=True, description="two finite numbers [x, y] (m/s)"
    )
    radius: Size = Field(gt=0, description="positive and finite (m)")
    mass: Size | None = Field(
        None,
        gt=0,
        validate_default=True,
        description="positive and finite (kg); left out if static",
    )
    inertia: Inertia | None = Field(
        None, gt=0, description="positive (kg m2); inf: it does not turn"
    )
    angle: Finite = Field(0.0, description="a finite number (rad)")
    angular_velocity: Finite = Field(0.0, description="a finite number (rad/s)")

    @field_validator("velocity", "mass")
    @classmethod
    def _may_be_left_out_if_static(cls, value: Any, info: ValidationInfo) -> Any:
        if value is None and info.data.get("static") is False:
            raise PydanticCustomError("missing", "missing")
        return value

    @field_validator("velocity", "angular_velocity")
    @classmethod
    def _static_is_at_rest(cls, value: Any, info: ValidationInfo) -> Any:
        if info.data.get("static") and np.any(value or 0.0):
            raise ValueError("the disk is static; must be zero or left out")
        return value


class WallTable(_Table):
    start: Pair = Field(description="two finite numbers [x, y] (m)")
    end: Pair = Field(description="two finite numbers [x, y] (m)")

    @field_validator("end")
    @classmethod
    def _has_length(cls, end: list[float], info: ValidationInfo) -> list[float]:
        start = info.data.get("start", [math.inf, math.inf])
        if end == start:
            raise ValueError("the wall has no length; must differ from its start")
        if (length := math.dist(start, end)) < SMALLEST:
            raise ValueError(
                f"out of scale: a wall of {length:g} m; must be {SMALLEST:g} m from its start or"
                " more"
            )
        return end


class CornersTable(_Table):
    low: Pair = Field(description="the lower left corner, two finite numbers [x, y] (m)")
    high: Pair = Field(description="the upper right corner, two finite numbers [x, y] (m)")

    @field_validator("high")
    @classmethod
    def _above_low(cls, high: list[float], info: ValidationInfo) -> list[float]:
        low = info.data.get("low", high)
        if low is not high and not (low[0] < high[0] and low[1] < high[1]):
            raise ValueError(f"not above low = {low}; must be greater in both x and y (m)")
        if low is not high and min(high[0] - low[0], high[1] - low[1]) < SMALLEST:
            raise ValueError(
                f"out of scale: too near to low = {low}; must be {SMALLEST:g} m above it or more"
            )
        return high


class ThrustTable(_Table):
    disk: int = Field(strict=True, description="the number of a disk in this file, from 0")
    start: Finite = Field(ge=0, description="finite and at least 0 (s)")
    stop: Time = Field(description="after start (s); inf: to the end")
    force: Pair = Field([0.0, 0.0], description="two finite numbers [x, y] (N)")
    torque: Finite = Field(0.0, description="a finite number (N m)")
    frame: Literal["world", "body"] = Field("world", description='"world" or "body"')

    @field_validator("disk")
    @classmethod
    def _is_there(cls, disk: int, info: ValidationInfo) -> int:
        last = (info.context or {}).get("disks", math.inf) - 1
        if not 0 <= disk <= last:
            raise ValueError(f"no such disk; must be from 0 to {last}")
        return disk

    @field_validator("stop")
    @classmethod
    def _after_start(cls, stop: float, info: ValidationInfo) -> float:
        start = info.data.get("start", -math.inf)
        if not stop > start:
            raise ValueError(f"not after start = {start}; must be later (s)")
        return stop


class SceneToml(_Table):
    name: str = Field(
        pattern=r"\A[a-z0-9][a-z0-9_-]{0,99}\z", description="at most 100 of a-z, 0-9, '_' and '-'"
    )
    asks: str | None = Field(None, description="a question, a string")
    duration: Size = Field(gt=0, description="positive and finite (s)")
    sample_interval: Size = Field(gt=0, description="positive and finite (s)")
    substeps: list[Count] = Field(
        [1, 2, 4, 8],
        min_length=1,
        validate_default=True,
        description="whole numbers from 1, increasing",
    )
    gravity: Pair = Field([0.0, 0.0], description="two finite numbers [x, y] (m/s2)")
    restitution: Strict = Field(ge=0, le=1, description="from 0 to 1")
    friction: Size = Field(0.0, ge=0, description="finite and at least 0")
    disk: list[DiskTable] = Field(
        min_length=1, max_length=MOST_DISKS, description=f"1 to {MOST_DISKS} [[disk]] tables"
    )
    wall: list[WallTable] = Field(
        [], max_length=MOST_WALLS, description=f"at most {MOST_WALLS} [[wall]] tables"
    )
    box: CornersTable | None = Field(None, description="one [box] table with low and high")
    wrap: CornersTable | None = Field(None, description="one [wrap] table with low and high")
    thrust: list[ThrustTable] = Field([], description="[[thrust]] tables")

    @field_validator("wall")
    @classmethod
    def _can_be_measured(cls, walls: list[WallTable], info: ValidationInfo) -> list[WallTable]:
        most = MOST_PAIRS // max(1, len(info.data.get("disk", [])))
        if len(walls) > most:
            raise ValueError(f"{len(walls)} walls for so many disks; must be at most {most}")
        return walls

    @field_validator("restitution")
    @classmethod
    def _is_no_rounding_of_0(cls, restitution: float) -> float:
        if 0 < restitution < SMALLEST:
            raise ValueError(f"out of scale; must be 0, or from {SMALLEST:g} to 1")
        return restitution

    @field_validator("sample_interval")
    @classmethod
    def _divides_duration(cls, interval: float, info: ValidationInfo) -> float:
        duration = info.data.get("duration", interval)
        if duration > MOST_STEPS * interval:
            raise ValueError(f"{duration / interval:.4g} samples; must give at most {MOST_STEPS}")
        samples = max(1, round(duration / interval))
        if abs(duration / interval - samples) > 1e-9 * samples:  # the rule of `Scenario`
            near = f"must go into it a whole number of times, as {duration / samples:.15g} does"
            raise ValueError(f"does not divide the duration {duration} s; {near}")
        return interval

    @field_validator("substeps")
    @classmethod
    def _is_a_ladder(cls, substeps: list[int], info: ValidationInfo) -> list[int]:
        if any(fine <= coarse for coarse, fine in pairwise(substeps)):
            raise ValueError("not increasing; must be whole numbers from 1, increasing")
        if substeps[-1] > MOST_STEPS:
            raise ValueError(f"more than {MOST_STEPS} steps in all; must give at most {MOST_STEPS}")
        interval = info.data.get("sample_interval", math.inf)
        steps = round(info.data.get("duration", 0.0) / interval) * sum(substeps)
        if steps > MOST_STEPS:
            raise ValueError(f"{steps} steps in all; must give at most {MOST_STEPS}")
        return substeps


TABLES: dict[str, type[_Table]] = {
    "disk": DiskTable,
    "wall": WallTable,
    "box": CornersTable,
    "wrap": CornersTable,
    "thrust": ThrustTable,
}
