"use strict";
// Stands in V8 before an engine's file does, after the driver of own solvers: calls its create, step, read and
// collisions, looks at what they return, and answers in JSON that it writes itself.
Object.defineProperty(globalThis, "__engine", { value: (() => {
  const { parse, stringify } = JSON;
  const { isFinite, isInteger } = Number;
  const { slice } = String.prototype;
  const { apply } = Reflect;
  const COLLISION = "asked are rows [i, j] or [i, j, impulse]: disk i; disk j, or wall w as -1 - w; N s";
  let seed = 1;
  // The same random numbers in every world. (Park & Miller, CACM 31, 1192, 1988.)
  Math.random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;

  let file;  // the functions of the engine
  let turns = false;  // whether it models rotation
  let world, scene, dt, steps, log, hears;
  let inside = "";  // the function that was called last

  class Wrong {
    constructor(what, kind = "error") { this.what = what; this.kind = kind; }
  }

  function bind(engine) {
    file = engine;
    const has = (name) => typeof file[name] === "function";
    const models = typeof file.models === "string" ? stringify(file.models) : "null";
    return `{"create":${has("create")},"step":${has("step")},"read":${has("read")},"collisions":${has("collisions")},"models":${models}}`;
  }

  // What a function returned, in few characters.
  function shown(value) {
    let text;
    try {
      text = typeof value === "object" && value !== null && typeof value.then === "function" ? "a Promise (an async function)"
        : typeof value === "number" || typeof value === "undefined" ? "" + value
        : typeof value === "function" ? "a function" : stringify(value, (_, x) => (typeof x === "number" && !isFinite(x) ? "" + x : x));
    } catch (_) { text = "something that cannot be shown"; }
    text = "" + text;
    return text.length > 60 ? apply(slice, text, [0, 60]) + " ..." : text;
  }

  function load(given) {
    seed = 1;
    scene = given.scene;
    dt = given.dt;
    for (let i = 0; i < scene.n; i++) {
      if (scene.mass[i] === null) scene.mass[i] = Infinity;
      if (scene.inertia[i] === null) scene.inertia[i] = Infinity;
    }
    // Numbers that the driver needs itself are kept: the file may write into its scene.
    scene = { n: scene.n, walls: scene.walls.length, angle: [...scene.angle], given: scene };
    steps = 0;
    log = [];
    hears = given.listening && typeof file.collisions === "function";
    inside = "create";
    world = file.create(scene.given, dt);
    ran(world, "create");
    return typeof world === "string" ? stringify(world || "create returned an empty text") : "null";
  }

  // An async function, or one with a yield, has not run when it returns.
  function ran(result, name) {
    if (typeof result === "object" && result !== null && (typeof result.then === "function" || typeof result.next === "function")) {
      throw new Wrong(`${name} returned ${typeof result.then === "function" ? "a Promise" : "a generator"}; asked is a plain function, without async and yield`);
    }
  }

  function none() {
    const all = [];
    for (let i = 0; i < scene.n; i++) all[i] = [0, 0, 0];
    return all;
  }

  function step({ count, forces }) {
    let acting = forces || none();
    for (let k = 0; k < count; k++) {
      inside = "step";
      ran(file.step(world, dt, acting), "step");
      if (hears) hear();
      steps++;
      acting = none();
    }
    return "null";
  }

  function hear() {
    inside = "collisions";
    const found = file.collisions(world);
    if (typeof found !== "object" || found === null || !isInteger(found.length)) {
      throw new Wrong(`collisions returned ${shown(found)}; ${COLLISION}`);
    }
    for (let k = 0; k < found.length; k++) {
      const one = found[k];
      const fits = typeof one === "object" && one !== null && isInteger(one[0]) && isInteger(one[1])
        && one[0] >= 0 && one[0] < scene.n && one[1] < scene.n && one[1] >= -scene.walls && one[0] !== one[1]
        && (one.length === 2 || (one.length === 3 && typeof one[2] === "number" && (isFinite(one[2]) || one[2] !== one[2])));
      if (!fits) throw new Wrong(`collisions returned ${shown(one)}; ${COLLISION}`);
      log[log.length] = `[${steps},${one[0]},${one[1]},${one.length === 3 ? one[2] : NaN}]`;
    }
  }

  function array(state, name, width) {
    const asked = `asked is ${width === 2 ? "[x, y]" : "a number"} for each of ${scene.n} disks`;
    const value = state[name];
    if (value === undefined || value === null) throw new Wrong(`read returned ${shown(state)}; it has no ${name}; ${asked}`);
    if (typeof value !== "object" || value.length !== scene.n) throw new Wrong(`read returned ${shown(value)} as ${name}; ${asked}`);
    for (let i = 0; i < scene.n; i++) {
      const one = value[i];
      if (width === 2 && (typeof one !== "object" || one === null || one.length !== 2)) {
        throw new Wrong(`read returned ${shown(one)} as ${name} of disk ${i}; ${asked}`);
      }
      for (let k = 0; k < width; k++) {
        const x = width === 2 ? one[k] : one;
        if (typeof x !== "number") throw new Wrong(`read returned ${shown(one)} as ${name} of disk ${i}; ${asked}`);
        if (!isFinite(x)) throw new Wrong(`read returned ${shown(one)} as ${name} of disk ${i}; asked are finite numbers`, "diverged");
      }
    }
    return value;
  }

  function rows() {
    inside = "read";
    const state = file.read(world);
    if (typeof state !== "object" || state === null) {
      throw new Wrong(`read returned ${shown(state)}; asked is { position, velocity${turns ? ", angle, angular_velocity" : ""} }`);
    }
    const position = array(state, "position", 2), velocity = array(state, "velocity", 2);
    const angle = turns ? array(state, "angle", 1) : scene.angle;
    const spin = turns ? array(state, "angular_velocity", 1) : null;
    let text = "";
    for (let i = 0; i < scene.n; i++) {
      text += `${i ? "," : ""}[${position[i][0]},${position[i][1]},${velocity[i][0]},${velocity[i][1]},${angle[i]},${spin ? spin[i] : 0}]`;
    }
    return `[${text}]`;
  }

  // Some calls of `step`, then where everything is and the collisions from number `heard` on: one request for all.
  function play({ steps: asked, heard }) {
    for (let k = 0; k < asked.length; k++) step(asked[k]);
    const where = rows();
    let all = "";
    for (let k = heard; k < log.length; k++) all += (k > heard ? "," : "") + log[k];
    return `{"rows":${where},"collisions":[${all}]}`;
  }

  function described(error) {
    let what = "", stack = "";
    try {
      what = error && error.message !== undefined ? error.name + ": " + error.message : shown(error);
      stack = typeof error.stack === "string" ? error.stack : "";
    } catch (_) { what = what || "something that cannot be shown"; }
    return `{"what":${stringify(apply(slice, what, [0, 400]))},"stack":${stringify(apply(slice, stack, [-2000]))}}`;
  }

  const commands = { whole_load: load, whole_step: step, whole_play: play };

  return (name, argument) => {
    if (name === "bind") return bind(argument);
    if (name === "turns") { turns = argument; return null; }
    if (name === "inside") return inside;
    try { return `{"done":${commands[name](parse(argument))}}`; }
    catch (error) {
      if (error instanceof Wrong) return `{"wrong":${stringify(error.what)},"kind":${stringify(error.kind)}}`;
      return `{"error":${described(error)},"inside":${stringify(inside)}}`;
    }
  };
})() });
