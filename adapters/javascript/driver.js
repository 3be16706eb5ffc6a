"use strict";
// Plays a JavaScript engine for adapters/javascript/v8.py: many steps and many readings in a call, whose numbers are
// handed back in one Float64Array. An engine's file gives `play({ shipped, matched, world })`; its `world(scene, chosen, hear)` builds a world and returns
//   step()                       one step of scene.dt
//   force(i, x, y, torque)       N, N m, on disk i during the next step
//   read(i)                      [x, y, u, v, angle, spin] of disk i, SI
//   place(i, x, y)               sets its centre
//   settings()                   [name, asked for or null, resolved] rows
// and calls hear(i, j, impulse) for every collision: disks from 0, wall w as -1 - w, N s or NaN.
globalThis.window = globalThis.self = globalThis;
// The package's file, which is evaluated next, exports to it, and the engine's own file takes it from there.
globalThis.module = { exports: {} };
globalThis.exports = module.exports;
if (typeof console === "undefined") {
  globalThis.console = Object.fromEntries(["log", "info", "warn", "error", "debug"].map((name) => [name, () => {}]));
}
// Rapier asks for the time of its own counters.
if (typeof performance === "undefined") globalThis.performance = { now: () => 0 };
// What Rapier needs to read the WebAssembly in its own text.
if (typeof TextDecoder === "undefined") {
  globalThis.TextDecoder = class {
    decode(bytes) {
      let text = "";
      for (const byte of bytes || []) text += String.fromCharCode(byte);
      return decodeURIComponent(escape(text));
    }
  };
  globalThis.TextEncoder = class {
    encode(text) { return Uint8Array.from(unescape(encodeURIComponent(text)), (c) => c.charCodeAt(0)); }
    encodeInto(text, into) { const bytes = this.encode(text); into.set(bytes); return { read: text.length, written: bytes.length }; }
  };
}
if (typeof atob === "undefined") {
  const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const value = new Uint8Array(128);
  for (let k = 0; k < 64; k++) value[digits.charCodeAt(k)] = k;
  globalThis.atob = (text) => {
    const parts = [];
    let bits = 0, held = 0, part = "";
    for (let k = 0; k < text.length && text[k] !== "="; k++) {
      bits = (bits << 6) | value[text.charCodeAt(k)];
      held += 6;
      if (held >= 8) { held -= 8; part += String.fromCharCode((bits >> held) & 255); }
      if (part.length > 8191) { parts.push(part); part = ""; }
    }
    return parts.join("") + part;
  };
}

// What a world throws that cannot play the scene as it is.
class Refused extends Error {}

const crosscheck = (() => {
  const WIDTH = 6;  // numbers of a disk in a reading
  const LONGEST = 200;  // ms after which a call that plays ahead hands back what it has
  let engine, world, scene, steps, log, numbers;

  function load(given) {
    if (world && world.free) world.free();
    scene = given.scene;
    steps = 0;
    log = [];
    const chosen = { ...engine[given.profile], ...given.changed };
    const hear = given.listening ? (i, j, impulse) => { log.push(steps, i, j, impulse); } : null;
    world = engine.world(scene, chosen, hear);
    return { settings: world.settings(), ...look() };
  }

  function step({ count, forces }) {
    for (const [i, x, y, torque] of forces) world.force(i, x, y, torque);
    for (let k = 0; k < count; k++) {
      world.step();
      steps++;
      if (scene.wrap) wrap();
    }
    return null;
  }

  // `times` readings, each after `count` steps, or those before something is thrown, which is reported; fewer if they take
  // too long.
  function ahead({ count, times, thrusts }) {
    const readings = [], began = Date.now(), acting = Map.groupBy(thrusts, ([when]) => when);
    let thrown = {};
    try {
      while (readings.length < times && Date.now() - began < LONGEST) {
        for (let k = 0; k < count; k++) step({ count: 1, forces: (acting.get(steps) || []).map(inWorld) });
        readings.push(reading());
      }
    }
    catch (error) { thrown = reportOf(error); }
    return { thrown, ...handed(readings) };
  }

  // A thrust of this step; that of a body's frame is turned by the angle of the disk.
  function inWorld([, disk, [x, y], torque, frame]) {
    if (frame === "world") return [disk, x, y, torque];
    const angle = world.read(disk)[4], c = Math.cos(angle), s = Math.sin(angle);
    return [disk, c * x - s * y, s * x + c * y, torque];
  }

  // Where everything is.
  function look() {
    return handed([reading()]);
  }

  function reading() {
    const rows = new Float64Array(WIDTH * scene.n);
    for (let i = 0; i < scene.n; i++) rows.set(world.read(i), WIDTH * i);
    return rows;
  }

  // Puts the readings and the collisions since the last time into `numbers`, and says how many readings there are.
  function handed(readings) {
    const each = WIDTH * scene.n;
    numbers = new Float64Array(each * readings.length + log.length);
    readings.forEach((rows, k) => numbers.set(rows, each * k));
    numbers.set(log, each * readings.length);
    log = [];
    return { readings: readings.length };
  }

  // A coordinate that has left the box goes on from the opposite edge.
  const ontoTorus = (x, low, high) => x >= low && x <= high ? x : x - Math.floor((x - low) / (high - low)) * (high - low);

  function wrap() {
    const [[left, bottom], [right, top]] = scene.wrap;
    for (let i = 0; i < scene.n; i++) {
      const [x, y] = world.read(i);
      if (x >= left && x <= right && y >= bottom && y <= top) continue;
      world.place(i, ontoTorus(x, left, right), ontoTorus(y, bottom, top));
    }
  }

  function reportOf(error) {
    if (error instanceof Refused) return { refused: error.message };
    return { failed: `${error && error.message !== undefined ? `${error.name}: ${error.message}` : error}` };
  }

  const commands = { load, step, look, ahead };
  return {
    play: (given) => { engine = given; },
    do: (name, argument) => {
      try { return JSON.stringify({ done: commands[name](argument) }); }
      catch (error) { return JSON.stringify(reportOf(error)); }
    },
    numbers: () => numbers,
    ready: () => engine !== undefined,
  };
})();
const play = crosscheck.play;
