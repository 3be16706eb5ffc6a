"use strict";
// Stands in V8 before the solver's file does: gives it spheres, calls its functions, and reads back what they did.
// It keeps the built-ins it needs, because a solver may replace them, and answers in JSON that it writes itself.
Object.defineProperty(globalThis, "__crosscheck", { value: (() => {
  const { parse, stringify } = JSON;
  const { keys, is, setPrototypeOf, getOwnPropertyDescriptor, defineProperty } = Object;
  const { captureStackTrace } = Error;
  const { apply, ownKeys } = Reflect;
  const { slice } = String.prototype;
  const { sqrt } = Math;
  const symbolText = Symbol.prototype.toString;
  const globe = globalThis;
  const empty = () => setPrototypeOf([], null);  // an array that no change of Array.prototype reaches
  const FIELDS = ["position", "velocity", "force", "alpha", "angularVelocity", "torque", "mass", "MoI", "size"];
  const BUILT_IN = { Math, Object, Array, Number, Function, String, JSON };
  const original = snapshot();
  let seed = 1;
  // The same asteroids every time. (Park & Miller, CACM 31, 1192, 1988.)
  Math.random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  original["Math.random"] = Math.random;
  for (const name of ["Date", "Temporal", "Intl", "WebAssembly", "SharedArrayBuffer", "Atomics"]) {
    Reflect.deleteProperty(globalThis, name);
  }
  globalThis.__timer_manager = undefined;  // this one and the next two cannot be deleted
  for (const name of ["setTimeout", "clearTimeout"]) {
    globalThis[name] = () => { throw new ReferenceError(name + " is not defined"); };
  }
  const quiet = () => undefined;
  globalThis.console = {};
  for (const name of ["log", "info", "warn", "error", "debug", "table", "assert", "clear", "count", "countReset", "dir",
    "dirxml", "group", "groupCollapsed", "groupEnd", "time", "timeEnd", "timeLog", "timeStamp", "trace"]) {
    globalThis.console[name] = quiet;
  }

  // A page in which nobody answers: each is closed at once.
  globalThis.alert = quiet;
  globalThis.confirm = () => false;
  globalThis.prompt = () => null;

  let file;  // the solver's functions and globals, once it is loaded
  let world;  // the scene being played
  let accesses = "";  // what the last traced call read and wrote
  let asked = empty();  // the spheres of the last question, which a call that failed may have changed
  let answers = empty();  // to the last questions that were put together

  function snapshot() {
    const found = setPrototypeOf({}, null), names = keys(BUILT_IN);
    for (let k = 0; k < names.length; k++) {
      remember(found, names[k], BUILT_IN[names[k]]);
      if (BUILT_IN[names[k]].prototype) remember(found, names[k] + ".prototype", BUILT_IN[names[k]].prototype);
    }
    return found;
  }

  function remember(found, path, holder) {
    const own = ownKeys(holder);
    for (let k = 0; k < own.length; k++) {
      const described = setPrototypeOf(getOwnPropertyDescriptor(holder, own[k]), null);
      const name = typeof own[k] === "symbol" ? apply(symbolText, own[k], []) : own[k];
      found[path + "." + name] = described.value || described.get;
    }
  }

  function bind(solver) {
    file = solver;
    const found = replaced();
    const has = (name) => (typeof file[name] === "function" ? "true" : "false");
    return `{"integrate":${has("integrate")},"collide":${has("collide")},"step":${has("step")},"wrap":${has("wrap")},`
      + `"begin":${has("begin")},"replaced":[${list(found)}]}`;
  }

  function replaced() {
    const now = snapshot(), paths = keys(now), names = keys(BUILT_IN), found = empty();
    for (let k = 0; k < names.length; k++) if (globe[names[k]] !== BUILT_IN[names[k]]) found[found.length] = names[k];
    for (let k = 0; k < paths.length; k++) {
      if (!is(now[paths[k]], original[paths[k]])) found[found.length] = paths[k];
    }
    return found;
  }

  function list(names) {
    let text = "";
    for (let k = 0; k < names.length && k < 9; k++) text += (k ? "," : "") + stringify("" + names[k]);
    return text;
  }

  function sphere(r) {
    return {
      position: { x: r[0], y: r[1] }, velocity: { x: r[2], y: r[3] }, force: { x: r[4], y: r[5] },
      alpha: r[6], angularVelocity: r[7], torque: r[8], mass: r[9], MoI: r[10], size: r[11],
    };
  }

  const text = (x) => (typeof x === "number" ? "" + x : "NaN");

  function row(s) {
    if (!s.position || !s.velocity || !s.force) {
      throw new TypeError("a sphere is left with a position, velocity or force that has no x and y");
    }
    return "[" + text(s.position.x) + "," + text(s.position.y) + "," + text(s.velocity.x) + "," + text(s.velocity.y)
      + "," + text(s.force.x) + "," + text(s.force.y) + "," + text(s.alpha) + "," + text(s.angularVelocity)
      + "," + text(s.torque) + "," + text(s.mass) + "," + text(s.MoI) + "," + text(s.size) + "]";
  }

  function rows(spheres) {
    let all = "";
    for (let i = 0; i < spheres.length; i++) all += (i ? "," : "") + row(spheres[i]);
    return "[" + all + "]";
  }

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

  function strange(spheres) {
    const found = empty();
    for (let i = 0; i < spheres.length; i++) {
      const own = keys(spheres[i]);
      for (let k = 0; k < own.length; k++) {
        let known = false;
        for (let f = 0; f < FIELDS.length; f++) known = known || FIELDS[f] === own[k];
        if (!known) found[found.length] = own[k];
      }
    }
    return found;
  }

  // The file's own globals that are numbers and what they are, as text: those that a call leaves changed are its state.
  function numbers() {
    const found = setPrototypeOf({}, null), names = keys(globe);
    for (let k = 0; k < names.length; k++) if (typeof globe[names[k]] === "number") found[names[k]] = "" + globe[names[k]];
    return found;
  }

  function changed(before) {
    const now = numbers(), names = keys(now), found = empty();
    for (let k = 0; k < names.length; k++) if (before[names[k]] !== now[names[k]]) found[found.length] = names[k];
    return found;
  }

  // Put functions that write down each call in the place of the file's own; a `const` one stays, and is not seen.
  function watch(spheres, calls) {
    const place = (s) => { for (let k = 0; k < spheres.length; k++) if (spheres[k] === s) return k; return -1; };
    const { integrate, collide, wrap } = file;
    const noted = (called, line) => (...given) => {
      calls[calls.length] = line(given[0], given[1]);
      return apply(called, undefined, given);
    };
    file.watch(noted(integrate, (s, dt) => `["integrate",${place(s)},${text(dt)}]`),
      noted(collide, (a, b) => `["collide",${place(a)},${place(b)}]`), noted(wrap, () => '["wrap"]'));
  }

  function call(what, spheres) {
    if (what[0] === "integrate") return file.integrate(spheres[what[1]], what[2]);
    if (what[0] === "collide") return file.collide(spheres[what[1]], spheres[what[2]]);
    return what[0] === "step" ? file.step(what[1]) : file.wrap();
  }

  // One question: spheres, calls -> the spheres after each call, whether anything was returned, what went wrong.
  function ask(question) {
    let states = "", returned = false, spheres = empty(), known = "", problem = "null";
    const calls = empty();
    seed = 1;
    const before = numbers();
    try {
      if (question.world) {
        spheres = everybody();
        for (let i = 0; i < spheres.length; i++) place(spheres[i], question.spheres[i]);
        if (question.watch) watch(spheres, calls);
      } else {
        for (let i = 0; i < question.spheres.length; i++) spheres[i] = sphere(question.spheres[i]);
        asked = spheres;
        known = witness();
      }
      for (let k = 0; k < question.calls.length; k++) {
        const result = call(question.calls[k], spheres);
        if (result && typeof result.next === "function") {
          throw new TypeError(`a call of ${question.calls[k][0]} runs nothing: it is a function* or has a yield`);
        }
        returned = returned || (typeof result === "object" && result !== null);
        if (question.world) spheres = everybody();  // a ufo that is set back may be a new object
        states += (k ? "," : "") + rows(spheres);
      }
    } catch (error) { problem = described(error); }
    const strayed = !question.world && witness() !== known;
    return `{"states":[${states}],"returned":${returned},"strayed":${strayed},"strange":[${list(strange(spheres))}],`
      + `"kept":[${list(changed(before))}],"calls":${reported(calls, 0)},"error":${problem}}`;
  }

  // Questions, one after the other. What comes before a call that never comes back can still be had of `answers`.
  function several(questions) {
    answers = empty();
    for (let k = 0; k < questions.length; k++) answers[k] = answer("ask", questions[k]);
    return reported(answers, 0);
  }

  // A sphere that writes down who reads or writes which of its numbers, and from where in the file.
  function traced(r, i) {
    const from = sphere(r), fields = FIELDS, seen = {};
    for (let f = 0; f < fields.length; f++) {
      const name = fields[f];
      if (f < 3) from[name] = accessors({}, from[name], ["x", "y"], i, name);
    }
    return accessors(seen, from, fields, i, "");
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
    if (count++ < 400) accesses += (accesses ? "," : "") + latest;
  }

  // The calls of a question on such spheres; `accesses` then reports what they did, even if they never came back.
  function trace(question) {
    const spheres = empty();
    accesses = latest = "";
    count = 0;
    seed = 1;
    for (let i = 0; i < question.spheres.length; i++) spheres[i] = traced(question.spheres[i], i);
    for (let k = 0; k < question.calls.length; k++) call(question.calls[k], spheres);
    return "null";
  }

  const traceOf = () => "[" + accesses + (count > 400 ? "," + latest : "") + "]";

  function described(error) {
    let what = "", stack = "";
    try {
      what = error && error.message !== undefined ? error.name + ": " + error.message : "threw " + error;
      stack = typeof error.stack === "string" ? error.stack : "";
    } catch (_) { what = what || "threw something that cannot be shown"; }
    return `{"what":${stringify(apply(slice, what, [0, 400]))},"stack":${stringify(apply(slice, stack, [-2000]))}}`;
  }

  function load(scene) {
    world = { dt: scene.dt, gravity: scene.gravity, wrap: scene.wrap, steps: 0, collisions: empty(), log: empty(),
      spheres: empty() };
    for (let i = 0; i < scene.spheres.length; i++) world.spheres[i] = sphere(scene.spheres[i]);
    return "null";
  }

  function step({ count, forces, held }) {
    const { spheres, gravity } = world;
    const n = spheres.length;
    for (let k = 0; k < count; k++) {
      for (let i = 0; i < n; i++) {
        const s = spheres[i], force = forces && (held || k === 0) ? forces[i] : null;
        s.force.x = s.mass * gravity[0] + (force ? force[0] : 0);
        s.force.y = s.mass * gravity[1] + (force ? force[1] : 0);
        s.torque = force ? force[2] : 0;
        file.integrate(s, world.dt);
      }
      for (let i = 0; i < n; i++) for (let j = i + 1; j < n; j++) pair(i, j);
      if (world.wrap) for (let i = 0; i < n; i++) wrapped(spheres[i].position);
      world.steps++;
    }
    return "null";
  }

  function pair(i, j) {
    const a = world.spheres[i], b = world.spheres[j];
    const ax = a.position.x, ay = a.position.y, au = a.velocity.x, av = a.velocity.y;
    const bx = b.position.x, by = b.position.y, bu = b.velocity.x, bv = b.velocity.y;
    const reach = a.size + b.size, overlaps = (ax - bx) * (ax - bx) + (ay - by) * (ay - by) < reach * reach;
    file.collide(a, b);
    const du = a.velocity.x - au, dv = a.velocity.y - av;
    const kicked = du !== 0 || dv !== 0 || b.velocity.x !== bu || b.velocity.y !== bv;
    const moved = a.position.x !== ax || a.position.y !== ay || b.position.x !== bx || b.position.y !== by;
    if (kicked) {
      const sign = du * (ax - bx) + dv * (ay - by) < 0 ? -1 : 1;
      world.collisions[world.collisions.length] = `[${world.steps},${i},${j},${text(sign * a.mass * sqrt(du * du + dv * dv))}]`;
    }
    if ((kicked || moved || overlaps) && world.log.length < 400) {
      world.log[world.log.length] = `[${world.steps},${i},${j},${text(ax)},${text(ay)},${text(au)},${text(av)},`
        + `${text(bx)},${text(by)},${text(bu)},${text(bv)},`
        + `${text(a.position.x)},${text(a.position.y)},${text(a.velocity.x)},${text(a.velocity.y)},`
        + `${text(b.position.x)},${text(b.position.y)},${text(b.velocity.x)},${text(b.velocity.y)}]`;
    }
  }

  // As projectObjects: beyond an edge of the box, onto the opposite one.
  function wrapped(p) {
    const left = world.wrap[0], bottom = world.wrap[1], right = world.wrap[2], top = world.wrap[3];
    p.x = p.x < left ? right : p.x > right ? left : p.x;
    p.y = p.y < bottom ? top : p.y > top ? bottom : p.y;
  }

  function reported(lines, first) {
    let all = "";
    for (let k = first; k < lines.length; k++) all += (k > first ? "," : "") + lines[k];
    return "[" + all + "]";
  }

  // Some calls of `step`, then where everything is and the collisions from number `heard` on: one request for all.
  function play({ steps, heard }) {
    for (let k = 0; k < steps.length; k++) step(steps[k]);
    return `{"rows":${rows(world.spheres)},"collisions":${reported(world.collisions, heard)}}`;
  }

  // Where everything is at the beginning and after each of `count` calls of `step`: one request for a whole scene.
  function samples({ step: steps, count }) {
    let all = rows(world.spheres);
    for (let k = 0; k < count; k++) {
      step(steps);
      all += "," + rows(world.spheres);
    }
    return "[" + all + "]";
  }

  const commands = {
    ask, several, answers: () => reported(answers, 0), left: () => rows(asked), trace, accesses: traceOf, load, step, play, samples, read: () => rows(world.spheres),
    contacts: () => reported(world.log, 0),
    begin: () => { file.begin(); return "null"; }, globals: () => witness() || "null",
  };

  function answer(name, argument) {
    try { return `{"done":${commands[name](argument)}}`; }
    catch (error) { return `{"error":${described(error)}}`; }
  }

  return (name, argument) => name === "bind" ? bind(argument)
    : answer(name, argument === undefined ? undefined : parse(argument));
})() });
