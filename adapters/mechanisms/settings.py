"""The public settings of each library: what it ships with, and what a scene needs instead; and the
search for the few of them that a failure is due to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from math import ceil, inf, isfinite, isnan, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import parsed, row_of
from crosscheck2d.scenarios.model import Scene

MOST = 3  # settings that are changed one after the other
GONE = 0.5  # of the error: a change that leaves more of it does not remove its cause
NO_LIMIT = 1e9
FINER = "finer"  # among the parameters of a setting: the steps in place of one


class Setting(NamedTuple):
    """A setting by its public name: its value in the profile, the value to set, the parameters of
    `EngineRow.make` that set it, and whether the matched profile sets it so, too."""

    name: str
    shipped: Any
    value: Any
    parameters: Mapping[str, Any]
    matched: bool = True

    @property
    def advice(self) -> str:
        to = self.value if isinstance(self.value, str) else f"set {plain(self.value)}"
        return f"`{self.name}` {plain(self.shipped)}; {to}"


class Remedy(NamedTuple):
    """The settings that remove an error, in the order in which they were changed, and the error
    before and after; `tried`: the names of all."""

    settings: tuple[Setting, ...]
    before: float
    after: float
    tried: tuple[str, ...]

    def sentence(self, engine: str) -> str:
        if self.settings:
            sets = "; ".join(each.advice for each in self.settings)
            return f"{engine.partition(':')[0]}: {sets}"
        names = ", ".join(f"`{name}`" for name in self.tried)
        return f"no setting removes it (tried: {names})" if names else ""


def plain(value: Any) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value:.3g}" if number else str(value)


def settings_of(name: str, scene: Scene, dt: float) -> list[Setting]:
    """The settings of the engine `name` in which it differs from what the scene needs; none for an
    engine that has none."""
    library, _, profile = parsed(name)[0].partition(":")
    row, settings = row_of(name), list[Setting]()
    if profile == "shipped" and library in SETTINGS:
        settings = [each for each in SETTINGS[library](scene, dt) if each.shipped != each.value]
    if row.work is not None and row.searched is not None:
        usual = row.searched().chosen[row.work.setting]  # of both profiles
        settings.append(tweak(row.work.setting, usual, row.work.values[-1]))
    return settings


def find_remedy(
    settings: Sequence[Setting], error: Callable[[Mapping[str, Any]], float], bound: float
) -> Remedy:
    """The fewest settings with which `error` of the engine's parameters is at most `bound`, or at
    least `GONE` of it goes; none if no change of a setting does that.

    Each step changes the one that leaves least. Where none helps alone, two are changed at once;
    where these are not enough, all of the matched profile, without those that are not needed.
    """
    before, chosen = off(error({})), list[Setting]()
    left = before
    while left > bound and len(chosen) < MOST:
        rest = [each for each in settings if each.name not in {one.name for one in chosen}]
        groups = [[each] for each in rest], [] if chosen else [*map(list, combinations(rest, 2))]
        for group in groups:
            errors = [off(error(merged([*chosen, *each]))) for each in group]
            least = min(errors, default=inf)
            if isfinite(least) and least <= max(bound, GONE * left):
                chosen, left = [*chosen, *group[errors.index(least)]], least
                break
        else:
            break
    if left > bound:
        enough = max(bound, 0.0 if chosen or not isfinite(before) else GONE * before)
        needed = [each for each in settings if each.matched]
        if off(error(merged(needed))) <= enough:
            for each in list(needed):
                fewer = [other for other in needed if other is not each]
                if off(error(merged(fewer))) <= enough:
                    needed = fewer
            chosen, left = needed, off(error(merged(needed)))
    return Remedy(tuple(chosen), before, left, tuple(dict.fromkeys(one.name for one in settings)))


def without_finer(parameters: Mapping[str, Any]) -> tuple[dict[str, Any], int]:
    return {name: it for name, it in parameters.items() if name != FINER}, parameters.get(FINER, 1)


def off(error: float) -> float:
    return inf if isnan(error) else error


def merged(settings: Sequence[Setting]) -> dict[str, Any]:
    # The parameters of several settings; units of time are multiplied.
    parameters = dict[str, Any]()
    for each in settings:
        for name, value in each.parameters.items():
            before = parameters.get(name, 1.0)
            parameters[name] = before * value if name == "time_unit" else value
    return parameters


def tweak(name: str, shipped: Any, value: Any, *keys: str) -> Setting:
    return one(name, shipped, value, *keys)._replace(matched=False)


def one(name: str, shipped: Any, value: Any, *keys: str) -> Setting:
    return Setting(name, shipped, value, dict.fromkeys(keys or [name], value))


def _pymunk(scene: Scene, _dt: float) -> list[Setting]:
    return [
        one("elasticity", scene.restitution, sqrt(scene.restitution)),
        one("friction", scene.friction, sqrt(scene.friction)),
        one("collision_slop", 0.1, 1e-6 * float(scene.radius.min())),
        tweak("collision_bias", 0.9**60, 1.0),
        tweak("collision_bias", 0.9**60, 0.0),
        one("collision_persistence", 3, 1),
    ]


def _unstated(friction: float, scene: Scene) -> list[Setting]:
    return [] if scene.friction else [one("friction", friction, 0.0)]


def _as_box2d(scene: Scene, sleep: str, edge: str, skin: str) -> list[Setting]:
    return [
        *_unstated(0.2, scene),
        one(sleep, True, False, "sleeping"),
        one(edge, skin, 0, "skin"),
        tweak("continuousPhysics", True, False, "continuous"),
        tweak("bullet", False, True, "bullet"),
        tweak("positionIterations", 3, 0, "position_iterations"),
    ]


def _box2d(scene: Scene, dt: float) -> list[Setting]:
    # What is compiled in is moved by the units in which the scene is given.
    from crosscheck2d.adapters.box2d import MATCHED, fastest

    threshold = "1 unit of length a unit of time, compiled in", "give times in units of 1000 s"
    settings = [
        *_as_box2d(scene, "SetAllowSleeping", "b2EdgeShape.radius", "0.01 units of length"),
        Setting("b2_velocityThreshold", *threshold, {"time_unit": 1000.0}),
        *_spin_cap("b2_maxRotation", pi / 2, scene, dt),
    ]
    radius, step = float(scene.radius.min()), 2 * fastest(scene) * dt
    own = MATCHED["length_unit"] * radius
    slop = "b2_linearSlop", "0.005 units of length, compiled in", own
    cap = "b2_maxTranslation", "2 units of length a step, compiled in", step
    for name, value, unit in [slop] * (own < 1.0) + [cap] * (step > 1.0):
        units = f"give lengths in units of {plain(unit)} m and times in units of {plain(unit)} s"
        in_units = {"length_unit": unit / radius, "time_unit": unit}
        settings.append(Setting(name, value, units, in_units))
    return settings


def _spin_cap(name: str, most: float, scene: Scene, dt: float) -> list[Setting]:
    # A cap on the rotation in a step that no setting lifts: only steps that it does not reach.
    steps = ceil(1.1 * float(np.abs(scene.angular_velocity).max()) * dt / most)
    shorter = f"take steps of {plain(1e3 * dt / max(steps, 1))} ms"
    value = f"{plain(most)} rad a step, compiled in"
    return [Setting(name, value, shorter, {FINER: steps})] if steps > 1 else []


def _planck(scene: Scene, _dt: float) -> list[Setting]:
    slop = 0.005 * 1e-5 * float(scene.radius.min())
    return [
        *_as_box2d(scene, "allowSleep", "Edge.m_radius", "twice the slop"),
        one("Settings.velocityThreshold", 1.0, 0.0, "velocityThreshold"),
        one("Settings.linearSlop", 0.005, slop, "linearSlop"),
        one("Settings.maxTranslation", 2.0, NO_LIMIT, "maxTranslation"),
        one("Settings.maxRotation", pi / 2, NO_LIMIT, "maxRotation"),
    ]


def _box2d_v3(scene: Scene, dt: float) -> list[Setting]:
    from crosscheck2d.adapters.box2d import fastest
    from crosscheck2d.adapters.box2d_v3 import MATCHED

    # contacts are foreseen within 0.02 units: fast disks need more
    radius, wide = float(scene.radius.min()), fastest(scene) * dt / 0.02
    unit, name = MATCHED["length_unit"] * radius, "length_units_per_meter"
    foreseen = Setting(name, 1.0, wide, {"length_unit": wide / radius}, matched=False)
    return [
        *_unstated(0.6, scene),
        one("enable_sleep", True, False, "sleeping"),
        one("restitution_threshold", 1.0, 0.0),
        one("maximum_linear_speed", 400.0, NO_LIMIT),
        Setting(name, 1.0, unit, {"length_unit": MATCHED["length_unit"]}),
        *([foreseen] if wide > 1.0 else []),
        one("set_contact_tuning: hertz", 30.0, MATCHED["hertz"], "hertz"),
        tweak("continuous_enabled", True, False, "continuous"),
        tweak("is_bullet", False, True, "bullet"),
        *_spin_cap("B2_MAX_ROTATION", pi / 4, scene, dt),
    ]


def _rapier2d(scene: Scene, dt: float) -> list[Setting]:
    from crosscheck2d.adapters.box2d import fastest

    radius, fast = float(scene.radius.min()), fastest(scene) / 200  # it cuts at 400 units a second
    units = [0.5 * radius, *([fast] if fast > 2 else [])]
    return [
        *_unstated(0.5, scene),
        one("canSleep", True, False, "sleeping"),
        *(Setting("lengthUnit", 1.0, unit, {"length_unit": unit / radius}) for unit in units),
        tweak("normalizedPredictionDistance", 0.02, 0.002, "prediction"),
        tweak("contact_natural_frequency", 30.0, 1000.0, "hertz"),
        tweak("numSolverIterations", 4, 16, "iterations"),
        tweak("ccdEnabled", False, True, "continuous"),
        tweak("maxCcdSubsteps", 1, 0, "continuous_steps"),
        *_spin_cap("the cap on rotation", pi / 4, scene, dt),
    ]


def _matter(scene: Scene, _dt: float) -> list[Setting]:
    return [
        one("frictionAir", 0.01, 0.0, "friction_air"),
        *_unstated(0.1, scene),
        tweak("frictionStatic", 0.5, 0.0, "friction_static"),
        tweak("slop", 0.05, 0.0),
        tweak("Resolver._restingThresh", 2.0, 0.0, "resting"),
        one("pixels a metre", 100.0, 1e5 / float(scene.radius.min()), "pixels"),
        one("maxSides", 25, 200, "sides"),
        tweak("positionIterations", 6, 0, "position_iterations"),
        tweak("velocityIterations", 4, 1, "velocity_iterations"),
        tweak("velocityIterations", 4, 20, "velocity_iterations"),
    ]


SETTINGS: dict[str, Callable[[Scene, float], list[Setting]]] = {
    "pymunk": _pymunk,
    "box2d": _box2d,
    "box2d_v3": _box2d_v3,
    "planck": _planck,
    "matter": _matter,
    "rapier2d": _rapier2d,
}
"""What each library ships with, in the scene at a dt in s, and what the scene needs."""
