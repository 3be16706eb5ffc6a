"""The exercise: two functions. To check them: crosscheck check THIS_FILE

A sphere has position, velocity, force (.x and .y in m, m/s, N), alpha, angularVelocity, torque
(rad, rad/s, N m), mass, MoI, size (kg, kg m2, m).
"""


def integrate(sphere, dt):
    """Task 1. Advance one sphere by dt seconds: its velocity and position by force and mass,
    angularVelocity and alpha by torque and MoI."""


def sphereSphereCollisionHandling(sphereA, sphereB):
    """Task 2. Do two spheres overlap (a)? Then move them apart (b), and if they approach, compute
    the impulse for a restitution of 0.9 (c) and change both velocities by it (d)."""
