"""Everything in dictionaries: vectors, the pair, what is done by name; the heavier is moved less."""

AXES = ("x", "y")
CONSTANTS = {"restitution": 0.9}


def integrate(sphere, dt):
    for rate, state, cause in (("velocity", "position", "force"),):
        for k in AXES:
            sphere[rate][k] += sphere[cause][k] / sphere["mass"] * dt
            sphere[state][k] += sphere[rate][k] * dt
    sphere["angularVelocity"] += sphere["torque"] / sphere["MoI"] * dt
    sphere["alpha"] += sphere["angularVelocity"] * dt


def sphereSphereCollisionHandling(sphereA, sphereB):
    between = {k: sphereA["position"][k] - sphereB["position"][k] for k in AXES}
    length = sum(value**2 for value in between.values()) ** 0.5
    reach = sphereA["size"] + sphereB["size"]
    if not 0 < length < reach:
        return
    n = {k: value / length for k, value in between.items()}
    pair = {"A": {"sphere": sphereA, "sign": 1, "w": 1 / sphereA["mass"]}}
    pair["B"] = {"sphere": sphereB, "sign": -1, "w": 1 / sphereB["mass"]}
    w = sum(one["w"] for one in pair.values())
    vn = sum(one["sign"] * one["sphere"]["velocity"][k] * n[k] for one in pair.values() for k in AXES)
    J = max(0.0, -(1 + CONSTANTS["restitution"]) * vn / w)
    for one in pair.values():
        for k in AXES:
            one["sphere"]["position"][k] += one["sign"] * one["w"] / w * (reach - length) * n[k]
            one["sphere"]["velocity"][k] += one["sign"] * one["w"] * J * n[k]
