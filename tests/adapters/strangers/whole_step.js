// One function for all: a list of the page, its own names, metres and seconds.
var particles = [], xmax = 10, ymax = 10, g = 0;

function step(h) {
  for (var i = 0; i < particles.length; i++) {
    var p = particles[i];
    p.speedY -= g * h;
    p.posX += p.speedX * h;
    p.posY += p.speedY * h;
    if (p.posX < p.size && p.speedX < 0 || p.posX > xmax - p.size && p.speedX > 0) p.speedX = -p.speedX;
    if (p.posY < p.size && p.speedY < 0 || p.posY > ymax - p.size && p.speedY > 0) p.speedY = -p.speedY;
  }
  for (var i = 0; i < particles.length; i++) for (var j = 0; j < i; j++) {
    var a = particles[i], b = particles[j], dx = a.posX - b.posX, dy = a.posY - b.posY;
    var dist = Math.sqrt(dx * dx + dy * dy);
    if (dist > a.size + b.size) continue;
    var vn = ((a.speedX - b.speedX) * dx + (a.speedY - b.speedY) * dy) / dist;
    if (vn > 0) continue;
    var imp = 2 * vn / (1 / a.weight + 1 / b.weight);
    a.speedX -= imp / a.weight * dx / dist; a.speedY -= imp / a.weight * dy / dist;
    b.speedX += imp / b.weight * dx / dist; b.speedY += imp / b.weight * dy / dist;
  }
}

function read() { return particles.map(function (p) { return [p.posX, p.posY]; }); }

if (typeof module !== "undefined") module.exports = { step: step, read: read, particles: particles };
