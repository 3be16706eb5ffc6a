"""An engine for crosscheck: symplectic Euler; overlaps are corrected, and each collision is one
impulse. Units: m, s, kg, rad; y up. To judge it:

    crosscheck run bouncing_ball_e09 --engine THIS_FILE --engine pymunk
"""

from math import hypot
from types import SimpleNamespace

# What a scene may have; a scene with more is refused.
# Words: disks walls gravity static forces rotation friction wrap
models = "disks walls gravity static forces rotation wrap"


def create(scene, dt):
    """A new world for a scene, in steps of dt. A text instead of a world says why it cannot play
    the scene."""
    disks = []
    for i, (x, y) in enumerate(scene.position):
        u, v = scene.velocity[i]
        light, easy = 1 / scene.mass[i], 1 / scene.inertia[i]  # 0 for a disk that cannot move
        d = SimpleNamespace(i=i, x=x, y=y, u=u, v=v, light=light, easy=easy, radius=scene.radius[i])
        d.angle, d.spin = scene.angle[i], scene.angular_velocity[i]
        disks.append(d)
    return SimpleNamespace(disks=disks, scene=scene, heard=[])


def step(world, dt, forces):
    """One step. forces[i] is [x, y, torque], what acts on disk i during this step."""
    disks, scene = world.disks, world.scene
    world.heard = []
    for d in disks:
        if d.light == 0:
            continue
        d.u += (scene.gravity[0] + forces[d.i][0] * d.light) * dt
        d.v += (scene.gravity[1] + forces[d.i][1] * d.light) * dt
        d.spin += forces[d.i][2] * d.easy * dt
        d.x += d.u * dt
        d.y += d.v * dt
        d.angle += d.spin * dt
    for i, a in enumerate(disks):
        for b in disks[i + 1 :]:
            collide(world, a, b, b.i)
    for a in disks:
        for w, wall in enumerate(scene.walls):
            collide(world, a, nearest(wall, a), -1 - w)
    if scene.wrap:
        for d in disks:
            wrap(d, *scene.wrap)


def wrap(d, low, high):
    """Beyond an edge: on from the opposite one."""
    width, height = high[0] - low[0], high[1] - low[1]
    d.x += width if d.x < low[0] else -width if d.x > high[0] else 0
    d.y += height if d.y < low[1] else -height if d.y > high[1] else 0


def nearest(wall, d):
    """The point of a wall that is nearest to a disk, as a disk without radius that cannot move."""
    (ax, ay), (bx, by) = wall
    ux, uy = bx - ax, by - ay
    along = ((d.x - ax) * ux + (d.y - ay) * uy) / (ux * ux + uy * uy)
    along = min(max(along, 0), 1)
    return SimpleNamespace(x=ax + along * ux, y=ay + along * uy, u=0, v=0, radius=0, light=0)


def collide(world, a, b, j):
    """Correct the overlap of two disks, and exchange an impulse if they approach."""
    dx, dy, light = a.x - b.x, a.y - b.y, a.light + b.light
    distance = hypot(dx, dy)
    overlap = a.radius + b.radius - distance
    if overlap <= 0 or light == 0:
        return
    nx, ny = (dx / distance, dy / distance) if distance else (1, 0)
    closing = (a.u - b.u) * nx + (a.v - b.v) * ny
    for d, sign in ((a, 1), (b, -1)):
        d.x += sign * nx * overlap * d.light / light
        d.y += sign * ny * overlap * d.light / light
    if closing >= 0:
        return
    impulse = -(1 + world.scene.restitution) * closing / light
    for d, sign in ((a, 1), (b, -1)):
        d.u += sign * nx * impulse * d.light
        d.v += sign * ny * impulse * d.light
    world.heard.append([a.i, j, impulse])


def read(world):
    """Where everything is, in the scene's order. Without the word rotation, position and velocity
    are enough."""
    return {
        "position": [[d.x, d.y] for d in world.disks],
        "velocity": [[d.u, d.v] for d in world.disks],
        "angle": [d.angle for d in world.disks],
        "angular_velocity": [d.spin for d in world.disks],
    }


def collisions(world):
    """Optional. The collisions of the last step: [disk i, disk j or wall w as -1 - w, impulse in
    N s]."""
    return world.heard
