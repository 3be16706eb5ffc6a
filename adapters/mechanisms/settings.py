"""The public settings of each library: what it ships with, and what a scene needs instead; and the
search for the few of them that a failure is due to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from math import ceil, inf, isfinite, isnan, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from adapters.engines import row_of
from scenarios.model import Scene

MOST = 3  # settings that are changed one after the other
GONE = 0.5  # of the error: a change that leaves more of it does not remove its cause
NO_LIMIT = 1e9
FINER = "finer"  # among the parameters of a setting: the steps in place of one


class Setting(NamedTuple):
    """A setting by its public name: its value in the profile, the value to set, and the parameters
    of `EngineRow.make` that set it."""

    name: str
    shipped: Any
    value: Any
    parameters: Mapping[str, Any]

    @property
    def advice(self) -> str:
        """What to set."""
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
        """What to set, or that nothing helps; "" if the engine has no settings."""
        if self.settings:
            sets = "; ".join(each.advice for each in self.settings)
            return f"{engine.partition(':')[0]}: {sets}"
        names = ", ".join(f"`{name}`" for name in self.tried)
        return f"no setting removes it (tried: {names})" if names else ""


def plain(value: Any) -> str:
    """A number with three digits; anything else as it is."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value:.3g}" if number else str(value)


def settings_of(name: str, scene: Scene, dt: float) -> list[Setting]:
    """The settings of the engine `name` in which it differs from what the scene needs; none for an
    engine that has none."""
    library, _, profile = name.partition(":")
    row, settings = row_of(name), list[Setting]()
    if profile == "shipped" and library in SETTINGS:
        settings = [each for each in SETTINGS[library](scene, dt) if each.shipped != each.value]
    if row.work is not None:
        most = row.work.values[-1]
        key = row.work.setting
        settings.append(Setting(key, "as the manual has it", most, {key: most}))
    return settings


def find_remedy(
    settings: Sequence[Setting], error: Callable[[Mapping[str, Any]], float], bound: float
) -> Remedy:
    """The fewest settings with which `error` of the engine's parameters is at most `bound`, or at
    least `GONE` of it goes; none if no change of a setting does that.

    Each step changes the one that leaves least. Where none helps alone, two are changed at once.
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
    return Remedy(tuple(chosen), before, left, tuple(dict.fromkeys(one.name for one in settings)))


def without_finer(parameters: Mapping[str, Any]) -> tuple[dict[str, Any], int]:
    """The parameters of `EngineRow.make`, and the steps in place of one."""
    return {name: it for name, it in parameters.items() if name != FINER}, parameters.get(FINER, 1)


def off(error: float) -> float:
    """The error; inf if there is none, because the run failed."""
    return inf if isnan(error) else error


def merged(settings: Sequence[Setting]) -> dict[str, Any]:
    """The parameters of several settings; units of time are multiplied."""
    parameters = dict[str, Any]()
    for each in settings:
        for name, value in each.parameters.items():
            before = parameters.get(name, 1.0)
            parameters[name] = before * value if name == "time_unit" else value
    return parameters


def _friction(default: float, scene: Scene, name: str = "friction") -> list[Setting]:
    """The friction that a library has where nobody states one."""
    stated = scene.friction > 0
    return [] if stated else [Setting(name, default, 0.0, {"friction": 0.0})]


def _pymunk(scene: Scene, _dt: float) -> list[Setting]:
    e, mu, slop = scene.restitution, scene.friction, 1e-6 * float(scene.radius.min())
    return [
        Setting("elasticity", e, sqrt(e), {"elasticity": sqrt(e)}),
        Setting("friction", mu, sqrt(mu), {"friction": sqrt(mu)}),
        Setting("collision_slop", 0.1, slop, {"collision_slop": slop}),
        Setting("collision_bias", 0.9**60, 1.0, {"collision_bias": 1.0}),
        Setting("collision_bias", 0.9**60, 0.0, {"collision_bias": 0.0}),
        Setting("collision_persistence", 3, 1, {"collision_persistence": 1}),
    ]


def _box2d(scene: Scene, dt: float) -> list[Setting]:
    """What is compiled in is moved by the units in which the scene is given."""
    from adapters.box2d import fastest

    radius = float(scene.radius.min())
    small, step = 0.25 * radius, 2 * fastest(scene) * dt
    return [
        *_friction(0.2, scene),
        Setting("SetAllowSleeping", True, False, {"sleeping": False}),
        Setting(
            "b2_velocityThreshold",
            "1 unit of length a unit of time, compiled in",
            "give times in units of 1000 s",
            {"time_unit": 1000.0},
        ),
        *(
            Setting(
                name,
                f"{value} units of length{by}, compiled in",
                f"give lengths in units of {plain(unit)} m and times in units of {plain(unit)} s",
                {"length_unit": unit / radius, "time_unit": unit},
            )
            for name, value, by, unit, bites in (
                ("b2_linearSlop", 0.005, "", small, small < 1.0),
                ("b2_maxTranslation", 2, " a step", step, step > 1.0),
            )
            if bites
        ),
        Setting("b2EdgeShape.radius", "0.01 units of length", 0, {"skin": False}),
        *_swept("continuousPhysics", "bullet"),
        Setting("positionIterations", 3, 0, dict.fromkeys(CORRECTIONS, 0)),
        *_spin_cap("b2_maxRotation", pi / 2, scene, dt),
    ]


CORRECTIONS = ("position_iterations", "elastic_position_iterations")


def _swept(world: str, body: str) -> list[Setting]:
    """Continuous collision of Box2D 2.3 and of planck: with walls, and between disks."""
    return [
        Setting(world, True, False, {"continuous": False, "elastic_continuous": False}),
        Setting(body, False, True, {"bullet": True, "elastic_bullet": True}),
    ]


def _spin_cap(name: str, most: float, scene: Scene, dt: float) -> list[Setting]:
    """A cap on the rotation in a step that no setting lifts: only steps that it does not reach."""
    steps = ceil(1.1 * float(np.abs(scene.angular_velocity).max()) * dt / most)
    shorter = f"take steps of {plain(1e3 * dt / max(steps, 1))} ms"
    value = f"{plain(most)} rad a step, compiled in"
    return [Setting(name, value, shorter, {FINER: steps})] if steps > 1 else []


def _planck(scene: Scene, _dt: float) -> list[Setting]:
    slop = 0.005 * 0.25 * float(scene.radius.min())
    shipped = {"velocityThreshold": 1.0, "linearSlop": 0.005, "maxTranslation": 2.0}
    shipped["maxRotation"] = pi / 2
    needed = dict.fromkeys(shipped, NO_LIMIT) | {"velocityThreshold": 0.0, "linearSlop": slop}
    return [
        *_friction(0.2, scene),
        Setting("allowSleep", True, False, {"sleeping": False}),
        *(
            Setting(f"Settings.{name}", value, needed[name], {name: needed[name]})
            for name, value in shipped.items()
        ),
        Setting("Edge.m_radius", "twice the slop", 0, {"skin": False}),
        *_swept("continuousPhysics", "bullet"),
        Setting("positionIterations", 3, 0, dict.fromkeys(CORRECTIONS, 0)),
    ]


def _box2d_v3(scene: Scene, dt: float) -> list[Setting]:
    unit = 0.5 * float(scene.radius.min())
    return [
        *_friction(0.6, scene),
        Setting("enable_sleep", True, False, {"sleeping": False}),
        Setting("restitution_threshold", 1.0, 0.0, {"restitution_threshold": 0.0}),
        Setting("maximum_linear_speed", 400.0, NO_LIMIT, {"maximum_linear_speed": NO_LIMIT}),
        Setting("length_units_per_meter", 1.0, unit, {"length_unit": 0.5}),
        Setting("set_contact_tuning: hertz", 30.0, NO_LIMIT, {"hertz": NO_LIMIT}),
        Setting("continuous_enabled", True, False, {"continuous": False}),
        Setting("is_bullet", False, True, {"bullet": True}),
        *_spin_cap("B2_MAX_ROTATION", pi / 4, scene, dt),
    ]


def _rapier2d(scene: Scene, dt: float) -> list[Setting]:
    from adapters.box2d import fastest

    radius, fast = float(scene.radius.min()), fastest(scene) / 200  # it cuts at 400 units a second
    units = [0.5 * radius, *([fast] if fast > 2 else [])]
    return [
        *_friction(0.5, scene),
        Setting("canSleep", True, False, {"sleeping": False}),
        *(Setting("lengthUnit", 1.0, unit, {"length_unit": unit / radius}) for unit in units),
        Setting("normalizedPredictionDistance", 0.02, 0.002, {"prediction": 0.002}),
        Setting("contact_natural_frequency", 30.0, 1000.0, {"hertz": 1000.0}),
        Setting("numSolverIterations", 4, 16, {"iterations": 16}),
        Setting("ccdEnabled", False, True, {"continuous": True}),
        Setting("maxCcdSubsteps", 1, 0, {"continuous_steps": 0}),
        *_spin_cap("the cap on rotation", pi / 4, scene, dt),
    ]


def _matter(scene: Scene, _dt: float) -> list[Setting]:
    pixels = 1e5 / float(scene.radius.min())
    return [
        Setting("frictionAir", 0.01, 0.0, {"friction_air": 0.0}),
        *_friction(0.1, scene),
        Setting("frictionStatic", 0.5, 0.0, {"friction_static": 0.0}),
        Setting("slop", 0.05, 0.0, {"slop": 0.0}),
        Setting("Resolver._restingThresh", 2.0, 0.0, {"resting": 0.0}),
        Setting("pixels a metre", 100.0, pixels, {"pixels": pixels}),
        Setting("maxSides", 25, 200, {"sides": 200}),
        Setting("positionIterations", 6, 0, {"position_iterations": 0}),
        Setting("velocityIterations", 4, 1, {"velocity_iterations": 1}),
        Setting("velocityIterations", 4, 20, {"velocity_iterations": 20}),
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
