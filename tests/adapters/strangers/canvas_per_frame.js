// Bouncing balls on a canvas: pixels, y down, speeds per frame, a list of the page.
const canvas = document.getElementById("game");
const ctx = canvas.getContext("2d");
canvas.width = 800;
canvas.height = 600;
const balls = [];

function makeBall(x, y, dx, dy, radius) {
  return { x, y, dx, dy, radius, mass: radius * radius, color: "hsl(" + Math.random() * 360 + ", 80%, 50%)" };
}

function moveBall(ball) {
  ball.x += ball.dx;
  ball.y += ball.dy;
  if (ball.x - ball.radius < 0) { ball.x = ball.radius; ball.dx = Math.abs(ball.dx); }
  if (ball.x + ball.radius > canvas.width) { ball.x = canvas.width - ball.radius; ball.dx = -Math.abs(ball.dx); }
  if (ball.y - ball.radius < 0) { ball.y = ball.radius; ball.dy = Math.abs(ball.dy); }
  if (ball.y + ball.radius > canvas.height) { ball.y = canvas.height - ball.radius; ball.dy = -Math.abs(ball.dy); }
}

function resolveCollision(a, b) {
  const nx = b.x - a.x, ny = b.y - a.y, d = Math.sqrt(nx * nx + ny * ny);
  if (d >= a.radius + b.radius) return;
  const vn = ((a.dx - b.dx) * nx + (a.dy - b.dy) * ny) / d;
  if (vn <= 0) return;
  const p = 2 * vn / (a.mass + b.mass);
  a.dx -= p * b.mass * nx / d;
  a.dy -= p * b.mass * ny / d;
  b.dx += p * a.mass * nx / d;
  b.dy += p * a.mass * ny / d;
}

function draw() {
  ctx.clearRect(0, 0, canvas.width, canvas.height);
  for (const ball of balls) {
    ctx.beginPath();
    ctx.arc(ball.x, ball.y, ball.radius, 0, 2 * Math.PI);
    ctx.fillStyle = ball.color;
    ctx.fill();
  }
}

function loop() {
  for (const ball of balls) moveBall(ball);
  for (let i = 0; i < balls.length; i++) for (let j = i + 1; j < balls.length; j++) resolveCollision(balls[i], balls[j]);
  draw();
  requestAnimationFrame(loop);
}

for (let i = 0; i < 20; i++) balls.push(makeBall(Math.random() * 800, Math.random() * 600, 4 * Math.random() - 2, 4 * Math.random() - 2, 10));
window.addEventListener("click", (e) => balls.push(makeBall(e.clientX, e.clientY, 1, 1, 15)));
loop();
