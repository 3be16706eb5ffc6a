"use strict";
// Stands in V8 before a guest's file does: hands it scenes, spheres and forces, calls its functions, and reads back what
// they did. It keeps the built-ins it needs, because a guest may replace them, and answers in JSON that it writes itself;
// the numbers of disks are handed back in a Float64Array.
globalThis.window = globalThis.self = globalThis;
globalThis.module = { exports: {} };
globalThis.exports = module.exports;
// What an engine throws that cannot play the scene as it is.
globalThis.Refused = class extends Error {};
Object.defineProperty(globalThis, "__host", { value: (() => {
  const { parse, stringify } = JSON;
  const { keys, is, setPrototypeOf, getOwnPropertyDescriptor, defineProperty } = Object;
  const { captureStackTrace } = Error;
  const { apply, ownKeys } = Reflect;
  const { slice } = String.prototype;
  const { sqrt, cos, sin, floor } = Math;
  const { isFinite, isInteger } = Number;
  const { now } = Date;
  const Numbers = Float64Array, Refusal = Refused;
  const symbolText = Symbol.prototype.toString;
  const globe = globalThis;
  const empty = () => setPrototypeOf([], null);  // an array that no change of Array.prototype reaches
  const FIELDS = ["position", "velocity", "force", "alpha", "angularVelocity", "torque", "mass", "MoI", "size"];
  const BUILT_IN = { Math, Object, Array, Number, Function, String, JSON };
  const COLLISION = "expected are rows [i, j] or [i, j, impulse]: disk i; disk j, or wall w as -1 - w; N s";
  const AHEAD = 200;  // ms after which a call that plays ahead hands back what it has
  const WIDTH = 6;  // numbers of a disk in a reading
  const MOST = 400;  // contacts and accesses kept for the check
  let original = snapshot();
  let seed = 1;
  let file;  // the guest's functions and globals, once it is loaded
  let turns = null;  // whether an engine models rotation; null for a solver of the exercise
  let loads = 0;  // scenes so far
  let inside = "";  // the function of an engine that was called last
  let world, steps, log, numbers;  // the world being played, its steps, its new collisions; what is handed back
  let accesses = "";  // what the last traced call read and wrote
  let spheres = empty();  // of the last question, which a call that failed may have changed
  let known = "";  // the globals after the last question; "" if they may have changed since
  let answers = empty();  // to the last questions that were put together

  // What a package for browsers asks for.
  const quiet = () => undefined;
  globe.console = new Proxy({}, { get: () => quiet });
  if (typeof performance === "undefined") globe.performance = { now: () => 0 };
  if (typeof TextDecoder === "undefined") {
    globe.TextDecoder = class {
      decode(bytes) {
        let text = "";
        for (const byte of bytes || []) text += String.fromCharCode(byte);
        return decodeURIComponent(escape(text));
      }
    };
    globe.TextEncoder = class {
      encode(text) { return Uint8Array.from(unescape(encodeURIComponent(text)), (c) => c.charCodeAt(0)); }
      encodeInto(text, into) { const bytes = this.encode(text); into.set(bytes); return { read: text.length, written: bytes.length }; }
    };
  }
  if (typeof atob === "undefined") {
    globe.atob = (text) => {
      const bytes = Uint8Array.fromBase64(text);
      let all = "";
      for (let k = 0; k < bytes.length; k += 8192) all += String.fromCharCode(...bytes.subarray(k, k + 8192));
      return all;
    };
  }

  // For a file that is no package: no clock, no timers, a page that holds nothing, the same random numbers every time.
  function confine() {
    // (Park & Miller, CACM 31, 1192, 1988.)
    Math.random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
    for (const name of ["Temporal", "Intl", "WebAssembly", "SharedArrayBuffer", "Atomics"]) Reflect.deleteProperty(globe, name);
    globe.__timer_manager = undefined;  // this one and the next two cannot be deleted
    for (const name of ["setTimeout", "clearTimeout"]) {
      globe[name] = () => { throw new ReferenceError(name + " is not defined"); };
    }
    globe.Date = class { static now() { return 0; } getTime() { return 0; } valueOf() { return 0; } };
    globe.performance = { now: () => 0 };
    const remembered = new Map();  // a canvas has the size that it is given
    const nothing = new Proxy(function () {}, {
      get: (_, name) => (name === Symbol.toPrimitive ? () => 0 : remembered.has(name) ? remembered.get(name) : nothing),
      set: (_, name, value) => remembered.set(name, value), apply: () => nothing, construct: () => nothing,
    });
    globe.document = nothing;
    globe.addEventListener = globe.requestAnimationFrame = globe.alert = quiet;
    globe.confirm = () => false;
    globe.prompt = () => null;
    original = snapshot();
  }

  // The built-ins, and what each has.
  function snapshot() {
    const values = setPrototypeOf({}, null), names = keys(BUILT_IN);
    const remember = (path, holder) => {
      const own = holder ? ownKeys(holder) : [];
      for (let k = 0; k < own.length; k++) {
        const described = setPrototypeOf(getOwnPropertyDescriptor(holder, own[k]), null);
        const name = typeof own[k] === "symbol" ? apply(symbolText, own[k], []) : own[k];
        values[path + "." + name] = described.value || described.get;
      }
    };
    for (let k = 0; k < names.length; k++) {
      values[names[k]] = globe[names[k]];
      remember(names[k], BUILT_IN[names[k]]);
      remember(names[k] + ".prototype", BUILT_IN[names[k]].prototype);
    }
    return values;
  }

  function differences(before, after) {
    const names = keys(after), changes = empty();
    for (let k = 0; k < names.length; k++) if (!is(before[names[k]], after[names[k]])) changes[changes.length] = names[k];
    return changes;
  }

  // `guest`: every name that may be a function of the exercise or of an engine, as it is found after the file.
  function bind(guest) {
    file = guest;
    let found = "";
    const names = keys(file);
    for (let k = 0; k < names.length; k++) found += `${stringify(names[k])}:${typeof file[names[k]] === "function"},`;
    const models = typeof file.models === "string" ? stringify(file.models) : "null";
    return `{${found}"models":${models},"replaced":${list(differences(original, snapshot()), word, 9)}}`;
  }

  // JSON of an array, of which each value is written by a function.
  function list(values, write, most = values.length) {
    let all = "";
    for (let k = 0; k < values.length && k < most; k++) all += (k ? "," : "") + write(values[k]);
    return "[" + all + "]";
  }

  const joined = (lines) => list(lines, (line) => line);
  const word = (name) => stringify("" + name);
  const text = (x) => (typeof x === "number" ? "" + x : "NaN");
  const number = (x) => (typeof x === "number" ? x : NaN);

  // ---- the exercise: functions on spheres -------------------------------------------------------------------------

  function sphere(r) {
    return {
      position: { x: r[0], y: r[1] }, velocity: { x: r[2], y: r[3] }, force: { x: r[4], y: r[5] },
      alpha: r[6], angularVelocity: r[7], torque: r[8], mass: r[9], MoI: r[10], size: r[11],
    };
  }

  function row(s) {
    if (!s.position || !s.velocity || !s.force) {
      throw new TypeError("a sphere is left with a position, velocity or force that has no x and y");
    }
    return [s.position.x, s.position.y, s.velocity.x, s.velocity.y, s.force.x, s.force.y,
      s.alpha, s.angularVelocity, s.torque, s.mass, s.MoI, s.size];
  }

  const rows = (all) => list(all, (s) => list(row(s), text));

  function everybody() {
    const all = empty(), others = file.asteroids();
    all[0] = file.ufo();
    for (let i = 0; i < others.length; i++) all[all.length] = others[i];
    return all;
  }

  // The globals as they are, or "" where the file has none.
  function witness() {
    try { return rows(everybody()); } catch (_) { return ""; }
  }

  function place(into, r) {
    const from = sphere(r);
    for (let k = 0; k < 3; k++) {
      into[FIELDS[k]].x = from[FIELDS[k]].x;
      into[FIELDS[k]].y = from[FIELDS[k]].y;
    }
    for (let k = 3; k < FIELDS.length; k++) into[FIELDS[k]] = from[FIELDS[k]];
  }

  function strange(all) {
    const names = empty(), known = setPrototypeOf(sphere(empty()), null);
    for (let i = 0; i < all.length; i++) {
      const own = keys(all[i]);
      for (let k = 0; k < own.length; k++) if (!(own[k] in known)) names[names.length] = own[k];
    }
    return names;
  }

  // The file's own globals that are numbers and what they are, as text: those that a call leaves changed are its state.
  function globals() {
    const values = setPrototypeOf({}, null), names = keys(globe);
    for (let k = 0; k < names.length; k++) if (typeof globe[names[k]] === "number") values[names[k]] = "" + globe[names[k]];
    return values;
  }

  // Put functions that write down each call in the place of the file's own; a `const` one stays, and is not seen.
  function watch(calls) {
    const index = (s) => { for (let k = 0; k < spheres.length; k++) if (spheres[k] === s) return k; return -1; };
    const noted = (called, line) => (...given) => {
      calls[calls.length] = line(given[0], given[1]);
      return apply(called, undefined, given);
    };
    file.watch({
      integrate: noted(file.integrate, (s, dt) => `["integrate",${index(s)},${text(dt)}]`),
      collide: noted(file.collide, (a, b) => `["collide",${index(a)},${index(b)}]`),
      wrap: noted(file.wrap, () => '["wrap"]'),
    });
  }

  function call(what, on) {
    if (what[0] === "integrate") return file.integrate(on[what[1]], what[2]);
    if (what[0] === "collide") return file.collide(on[what[1]], on[what[2]]);
    return what[0] === "step" ? file.simulate(what[1]) : file.wrap();
  }

  // One question: spheres, calls -> the spheres after each call, whether anything was returned, what went wrong.
  function ask(question) {
    let returned = false, was = "", problem = "null";
    const calls = empty(), states = empty();
    seed = 1;
    spheres = empty();
    const before = globals();
    try {
      if (question.world) {
        spheres = everybody();
        for (let i = 0; i < spheres.length; i++) place(spheres[i], question.spheres[i]);
        if (question.watch) watch(calls);
      } else {
        for (let i = 0; i < question.spheres.length; i++) spheres[i] = sphere(question.spheres[i]);
        was = known || witness();
      }
      known = "";  // should a call not come back
      for (let k = 0; k < question.calls.length; k++) {
        const result = call(question.calls[k], spheres);
        if (result && typeof result.next === "function") {
          throw new TypeError(`a call of ${question.calls[k][0]} runs nothing: it is a function* or has a yield`);
        }
        returned = returned || (typeof result === "object" && result !== null);
        if (question.world) spheres = everybody();  // a ufo that is set back may be a new object
        states[k] = rows(spheres);
      }
    } catch (error) { problem = described(error); }
    known = question.world ? "" : witness();
    return `{"states":${joined(states)},"returned":${returned},"strayed":${known !== was},"strange":${list(strange(spheres), word, 9)},`
      + `"kept":${list(differences(before, globals()), word, 9)},"calls":${joined(calls)},"error":${problem}}`;
  }

  // Questions, one after the other. What comes before a call that never comes back can still be had of `answers`.
  function several(questions) {
    answers = empty();
    for (let k = 0; k < questions.length; k++) answers[k] = answer("ask", questions[k]);
    return joined(answers);
  }

  // A sphere that writes down who reads or writes which of its numbers, and from where in the file.
  function traced(r, i) {
    const from = sphere(r);
    for (let f = 0; f < 3; f++) from[FIELDS[f]] = accessors({}, from[FIELDS[f]], ["x", "y"], i, FIELDS[f]);
    return accessors({}, from, FIELDS, i, "");
  }

  function accessors(target, values, names, i, within) {
    for (let k = 0; k < names.length; k++) {
      const name = names[k], field = within || name, noted = within || typeof values[name] === "number";
      defineProperty(target, name, {
        enumerable: true, configurable: true,
        get() { if (noted) access("r", i, field); return values[name]; },
        set(value) { access("w", i, field); values[name] = value; },
      });
    }
    return target;
  }

  let count = 0, latest = "";
  function access(kind, i, field) {
    const at = {};
    captureStackTrace(at, access);
    latest = `["${kind}",${i},"${field}",${stringify(apply(slice, "" + at.stack, [0, 2000]))}]`;
    if (count++ < MOST) accesses += (accesses ? "," : "") + latest;
  }

  // The calls of a question on such spheres; `accesses` then reports what they did, even if they never came back.
  function trace(question) {
    const on = empty();
    accesses = latest = "";
    count = 0;
    seed = 1;
    for (let i = 0; i < question.spheres.length; i++) on[i] = traced(question.spheres[i], i);
    for (let k = 0; k < question.calls.length; k++) call(question.calls[k], on);
    return "null";
  }

  const traceOf = () => "[" + accesses + (count > MOST ? "," + latest : "") + "]";

  // A scene by the exercise's functions: integrate all, collide every pair i < j, wrap.
  function makeExercise(scene) {
    const all = empty(), contacts = empty(), { n, dt, gravity, wrap } = scene;
    for (let i = 0; i < n; i++) {
      all[i] = sphere([scene.position[i][0], scene.position[i][1], scene.velocity[i][0], scene.velocity[i][1], 0, 0,
        scene.angle[i], scene.angular_velocity[i], 0, scene.mass[i], scene.inertia[i], scene.radius[i]]);
    }

    function pair(i, j) {
      const a = all[i], b = all[j];
      const ax = a.position.x, ay = a.position.y, au = a.velocity.x, av = a.velocity.y;
      const bx = b.position.x, by = b.position.y, bu = b.velocity.x, bv = b.velocity.y;
      const reach = a.size + b.size, overlaps = (ax - bx) * (ax - bx) + (ay - by) * (ay - by) < reach * reach;
      file.collide(a, b);
      const du = a.velocity.x - au, dv = a.velocity.y - av;
      const kicked = du !== 0 || dv !== 0 || b.velocity.x !== bu || b.velocity.y !== bv;
      const moved = a.position.x !== ax || a.position.y !== ay || b.position.x !== bx || b.position.y !== by;
      if (kicked) {
        const sign = du * (ax - bx) + dv * (ay - by) < 0 ? -1 : 1;
        note(i, j, sign * a.mass * sqrt(du * du + dv * dv));
      }
      if ((kicked || moved || overlaps) && contacts.length < MOST) {
        contacts[contacts.length] = list([steps, i, j, ax, ay, au, av, bx, by, bu, bv,
          a.position.x, a.position.y, a.velocity.x, a.velocity.y,
          b.position.x, b.position.y, b.velocity.x, b.velocity.y], text);
      }
    }

    // As projectObjects: beyond an edge of the box, onto the opposite one.
    function wrapped(p) {
      p.x = p.x < wrap[0][0] ? wrap[1][0] : p.x > wrap[1][0] ? wrap[0][0] : p.x;
      p.y = p.y < wrap[0][1] ? wrap[1][1] : p.y > wrap[1][1] ? wrap[0][1] : p.y;
    }

    return {
      n, contacts: () => joined(contacts),
      step(forces) {
        for (let i = 0; i < n; i++) {
          const s = all[i], force = forces ? forces[i] : null;
          s.force.x = s.mass * gravity[0] + (force ? force[0] : 0);
          s.force.y = s.mass * gravity[1] + (force ? force[1] : 0);
          s.torque = force ? force[2] : 0;
          file.integrate(s, dt);
        }
        for (let i = 0; i < n; i++) for (let j = i + 1; j < n; j++) pair(i, j);
        if (wrap) for (let i = 0; i < n; i++) wrapped(all[i].position);
      },
      read(into, at) {
        for (let i = 0; i < n; i++, at += WIDTH) {
          const r = row(all[i]);
          for (let k = 0; k < WIDTH; k++) into[at + k] = number(r[k < 4 ? k : k + 2]);
        }
      },
    };
  }

  // ---- an engine: create, step, read, perhaps collisions, settings, place, free ------------------------------------

  class Wrong {
    constructor(what, kind = "error") { this.what = what; this.kind = kind; }
  }

  // What a function returned, in few characters.
  function display(value) {
    let words;
    try {
      words = typeof value === "object" && value !== null && typeof value.then === "function" ? "a Promise (an async function)"
        : typeof value === "number" || typeof value === "undefined" ? "" + value
        : typeof value === "function" ? "a function" : stringify(value, (_, x) => (typeof x === "number" && !isFinite(x) ? "" + x : x));
    } catch (_) { words = "something that cannot be shown"; }
    words = "" + words;
    return words.length > 60 ? apply(slice, words, [0, 60]) + " ..." : words;
  }

  // An async function, or one with a yield, has not run when it returns.
  function ran(result, name) {
    if (typeof result === "object" && result !== null && (typeof result.then === "function" || typeof result.next === "function")) {
      throw new Wrong(`${name} returned ${typeof result.then === "function" ? "a Promise" : "a generator"}; expected is a plain function, without async and yield`);
    }
    return result;
  }

  function makeEngine(scene) {
    const { n, dt, wrap } = scene, walls = scene.walls.length, angles = [...scene.angle];  // the file may write into its scene
    const hears = scene.listening && typeof file.collisions === "function";
    if (typeof file.free === "function" && world) file.free(world.made);
    inside = "create";
    let made = ran(file.create(scene, dt), "create");
    if (typeof made === "string") throw new Refusal(made || "create returned an empty text");
    let first = null, renews = null;  // the first reading; whether a step returns a new world

    function none() {
      const all = [];
      for (let i = 0; i < n; i++) all[i] = [0, 0, 0];
      return all;
    }

    function hear() {
      inside = "collisions";
      const rows = file.collisions(made);
      if (typeof rows !== "object" || rows === null || !isInteger(rows.length)) {
        throw new Wrong(`collisions returned ${display(rows)}; ${COLLISION}`);
      }
      for (let k = 0; k < rows.length; k++) {
        const r = rows[k];
        const fits = typeof r === "object" && r !== null && isInteger(r[0]) && isInteger(r[1])
          && (r[0] >= 0 || r[1] >= 0) && r[0] < n && r[1] < n && r[0] >= -walls && r[1] >= -walls && r[0] !== r[1]
          && (r.length === 2 || (r.length === 3 && typeof r[2] === "number" && (isFinite(r[2]) || r[2] !== r[2])));
        if (!fits) throw new Wrong(`collisions returned ${display(r)}; ${COLLISION}`);
        note(r[0], r[1], r.length === 3 ? r[2] : NaN);
      }
    }

    function array(state, name, width) {
      const wanted = `expected is ${width === 2 ? "[x, y]" : "a number"} for each of ${n} disks`;
      const value = state[name];
      if (value === undefined || value === null) throw new Wrong(`read returned ${display(state)}; it has no ${name}; ${wanted}`);
      if (typeof value !== "object" || value.length !== n) {
        const kept = value.length > n && loads > 1 ? "; create keeps disks of the scene before" : "";
        throw new Wrong(`read returned ${display(value)} as ${name}; ${wanted}${kept}`);
      }
      for (let i = 0; i < n; i++) {
        const disk = value[i];
        if (width === 2 && (typeof disk !== "object" || disk === null || disk.length !== 2)) {
          throw new Wrong(`read returned ${display(disk)} as ${name} of disk ${i}; ${wanted}`);
        }
        for (let k = 0; k < width; k++) {
          const x = width === 2 ? disk[k] : disk;
          if (typeof x !== "number") throw new Wrong(`read returned ${display(disk)} as ${name} of disk ${i}; ${wanted}`);
          if (!isFinite(x)) throw new Wrong(`read returned ${display(disk)} as ${name} of disk ${i}; expected are finite numbers`, "diverged");
        }
      }
      return value;
    }

    function read(into, at, from = made) {
      inside = "read";
      const begin = at, state = file.read(from);
      if (typeof state !== "object" || state === null) {
        throw new Wrong(`read returned ${display(state)}; expected is { position, velocity${turns ? ", angle, angular_velocity" : ""} }`);
      }
      const position = array(state, "position", 2), velocity = array(state, "velocity", 2);
      const angle = turns ? array(state, "angle", 1) : angles;
      const spin = turns ? array(state, "angular_velocity", 1) : null;
      for (let i = 0; i < n; i++, at += WIDTH) {
        into[at] = position[i][0]; into[at + 1] = position[i][1];
        into[at + 2] = velocity[i][0]; into[at + 3] = velocity[i][1];
        into[at + 4] = angle[i]; into[at + 5] = spin ? spin[i] : 0;
      }
      first ??= into.slice(begin, at);
    }

    // A step may return a new world, which is what read can read. If it is none, the step has to have moved the disks.
    function isWorld(result) {
      const rows = new Numbers(WIDTH * n);
      try { read(rows, 0, result); return true; } catch (_) { read(rows, 0); }
      let moves = false, still = true;
      for (let k = 0; first !== null && k < rows.length; k++) {
        if (k % WIDTH < 2) still = still && rows[k] === first[k];
        else if (k % WIDTH < 4) moves = moves || rows[k] !== 0;
      }
      if (first !== null && still && moves) {
        throw new Wrong(`step returned ${display(result)} and moved no disk; expected is that it changes its world, or returns a new one that read can read`);
      }
      return false;
    }

    // A coordinate that has left the box goes on from the opposite edge.
    const ontoTorus = (x, low, high) => (x >= low && x <= high ? x : x - floor((x - low) / (high - low)) * (high - low));

    function wrapAll() {
      const [[left, bottom], [right, top]] = wrap, where = file.read(made).position;
      for (let i = 0; i < n; i++) {
        const [x, y] = where[i];
        if (x >= left && x <= right && y >= bottom && y <= top) continue;
        file.place(made, i, ontoTorus(x, left, right), ontoTorus(y, bottom, top));
      }
    }

    return {
      n, made, read,
      step(forces) {
        inside = "step";
        const result = ran(file.step(made, dt, forces || none()), "step");
        if (typeof result === "object" && result !== null && result !== made && renews !== false) {
          if (renews === null) renews = isWorld(result);
          if (renews) made = this.made = result;
        }
        if (hears) hear();
        if (wrap && typeof file.place === "function") wrapAll();
      },
      settings: () => (typeof file.settings === "function"
        ? stringify(file.settings(made), (_, x) => (x === undefined ? "no such setting" : x)) : "[]"),
    };
  }

  // ---- any guest --------------------------------------------------------------------------------------------------

  function note(i, j, impulse) {
    const k = log.length;
    log[k] = steps; log[k + 1] = i; log[k + 2] = j; log[k + 3] = impulse;
  }

  function load(scene) {
    seed = 1;
    steps = 0;
    loads++;
    log = empty();
    for (let i = 0; i < scene.n; i++) {
      if (scene.mass[i] === null) scene.mass[i] = Infinity;
      if (scene.inertia[i] === null) scene.inertia[i] = Infinity;
    }
    world = turns !== null ? makeEngine(scene) : makeExercise(scene);
    return world.settings ? world.settings() : "[]";
  }

  // Forces act in the first step, or in all if they are held.
  function step({ count: times, forces, held }) {
    for (let k = 0; k < times; k++) {
      world.step(held || k === 0 ? forces : null);
      steps++;
    }
    return "null";
  }

  function reading() {
    const rows = new Numbers(WIDTH * world.n);
    world.read(rows, 0);
    return rows;
  }

  // Puts the readings and the new collisions into `numbers`, and says how many readings there are.
  function handed(readings, thrown = "null") {
    const width = WIDTH * world.n;
    numbers = new Numbers(width * readings.length + log.length);
    let at = 0;
    for (let k = 0; k < readings.length; k++) for (let i = 0; i < width; i++) numbers[at++] = readings[k][i];
    for (let k = 0; k < log.length; k++) numbers[at++] = log[k];
    log = empty();
    return `{"readings":${readings.length},"thrown":${thrown}}`;
  }

  // Some calls of `step`, then where everything is: one request for all.
  function play(calls) {
    for (let k = 0; k < calls.length; k++) step(calls[k]);
    return handed([reading()]);
  }

  // `times` readings, each after `count` steps, or those before something is thrown, which is reported; fewer if they take
  // too long. thrusts: rows of step, disk, [x, y], torque, frame.
  function ahead({ count: between, times, thrusts }) {
    const readings = empty(), began = now();
    let thrown = "null", next = 0;
    while (next < thrusts.length && thrusts[next][0] < steps) next++;
    try {
      while (readings.length < times && now() - began < AHEAD) {
        for (let k = 0; k < between; k++) {
          let forces = null;
          for (; next < thrusts.length && thrusts[next][0] === steps; next++) forces = pushed(forces, thrusts[next]);
          step({ count: 1, forces });
        }
        readings[readings.length] = reading();
      }
    } catch (error) { thrown = reportOf(error); }
    return handed(readings, thrown);
  }

  // The forces of a step with a thrust; that of a body's frame is turned by the angle of the disk.
  function pushed(forces, [, disk, [x, y], torque, frame]) {
    if (!forces) {
      forces = [];
      for (let i = 0; i < world.n; i++) forces[i] = [0, 0, 0];
    }
    let u = x, v = y;
    if (frame !== "world") {
      const angle = reading()[WIDTH * disk + 4], c = cos(angle), s = sin(angle);
      u = c * x - s * y;
      v = s * x + c * y;
    }
    forces[disk][0] += u;
    forces[disk][1] += v;
    forces[disk][2] += torque;
    return forces;
  }

  // Where everything is at the beginning and after each of `times` calls of `step`: one request for a whole scene.
  function samples({ step: steps, times }) {
    const readings = [reading()];
    for (let k = 0; k < times; k++) {
      step(steps);
      readings[k + 1] = reading();
    }
    return handed(readings);
  }

  function described(error) {
    let what = "", stack = "";
    try {
      what = error && error.message !== undefined ? error.name + ": " + error.message : "threw " + error;
      stack = typeof error.stack === "string" ? error.stack : "";
    } catch (_) { what = what || "threw something that cannot be shown"; }
    return `{"what":${stringify(apply(slice, what, [0, 400]))},"stack":${stringify(apply(slice, stack, [-2000]))},`
      + `"kind":"error","inside":${stringify(inside)}}`;
  }

  function reportOf(error) {
    if (error instanceof Wrong) return `{"what":${stringify(error.what)},"kind":${stringify(error.kind)},"stack":"","inside":""}`;
    if (error instanceof Refusal) return `{"what":${stringify("" + error.message)},"kind":"refused","stack":"","inside":""}`;
    return described(error);
  }

  const commands = {
    ask, several, answers: () => joined(answers), left: () => rows(spheres), trace, accesses: traceOf, load, step, play, ahead,
    samples, contacts: () => world.contacts(), begin: () => { file.begin(); return "null"; }, globals: () => witness() || "null",
  };

  function answer(name, argument) {
    if (name !== "ask" && name !== "several") known = "";
    try { return `{"done":${commands[name](argument)}}`; }
    catch (error) { return `{"failed":${reportOf(error)}}`; }
  }

  return (name, argument) => {
    if (name === "confine") return confine();
    if (name === "bind") return bind(argument);
    if (name === "turns") { turns = argument; return null; }
    if (name === "inside") return inside;
    if (name === "numbers") return numbers;
    if (name === "ready") return typeof file.ready !== "function" || !!file.ready();
    return answer(name, argument === undefined ? undefined : parse(argument));
  };
})() });
