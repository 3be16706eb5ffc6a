"""Balls as in a pygame tutorial, without the drawing: pixels, y down, speeds per frame."""

WIDTH, HEIGHT = 800, 600


class Ball:
    def __init__(self, x, y, radius):
        self.x = x
        self.y = y
        self.radius = radius
        self.mass = radius**2
        self.vx = 0
        self.vy = 0

    def move(self):
        self.x += self.vx
        self.y += self.vy
        if self.x < self.radius:
            self.x = self.radius
            self.vx = -self.vx
        if self.x > WIDTH - self.radius:
            self.x = WIDTH - self.radius
            self.vx = -self.vx
        if self.y < self.radius:
            self.y = self.radius
            self.vy = -self.vy
        if self.y > HEIGHT - self.radius:
            self.y = HEIGHT - self.radius
            self.vy = -self.vy


def collide(p1, p2):
    dx = p1.x - p2.x
    dy = p1.y - p2.y
    dist = (dx * dx + dy * dy) ** 0.5
    if dist > p1.radius + p2.radius:
        return
    vn = ((p1.vx - p2.vx) * dx + (p1.vy - p2.vy) * dy) / dist
    if vn > 0:
        return
    total = p1.mass + p2.mass
    p1.vx -= 2 * p2.mass / total * vn * dx / dist
    p1.vy -= 2 * p2.mass / total * vn * dy / dist
    p2.vx += 2 * p1.mass / total * vn * dx / dist
    p2.vy += 2 * p1.mass / total * vn * dy / dist


if __name__ == "__main__":
    balls = [Ball(100 * i, 50 * i, 20) for i in range(1, 6)]
    for _ in range(1000):
        for ball in balls:
            ball.move()
        for i in range(len(balls)):
            for j in range(i + 1, len(balls)):
                collide(balls[i], balls[j])
