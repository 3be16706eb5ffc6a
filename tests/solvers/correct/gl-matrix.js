// Stands in for the library of this name in tests: a few of its functions in single precision, in words of our own.
// As there, the first argument takes the result, is returned, and may be one of the others.
(function (page) {
  function vectors(length) {
    const each = (out, f) => {
      const made = Array.from({ length }, (_, k) => f(k));
      for (let k = 0; k < length; k++) out[k] = made[k];
      return out;
    };
    const dot = (a, b) => Array.from({ length }, (_, k) => a[k] * b[k]).reduce((sum, term) => sum + term);
    const vec = {
      create: () => new Float32Array(length),
      fromValues: (...values) => Float32Array.from(values.slice(0, length)),
      clone: (a) => Float32Array.from(a),
      copy: (out, a) => each(out, (k) => a[k]),
      set: (out, ...values) => each(out, (k) => values[k]),
      add: (out, a, b) => each(out, (k) => a[k] + b[k]),
      subtract: (out, a, b) => each(out, (k) => a[k] - b[k]),
      scale: (out, a, s) => each(out, (k) => a[k] * s),
      scaleAndAdd: (out, a, b, s) => each(out, (k) => a[k] + b[k] * s),
      negate: (out, a) => each(out, (k) => -a[k]),
      dot,
      length: (a) => Math.sqrt(dot(a, a)),
      distance: (a, b) => vec.length(vec.subtract([], a, b)),
      normalize: (out, a) => vec.scale(out, a, dot(a, a) > 0 ? 1 / vec.length(a) : 0),
    };
    return Object.assign(vec, { sub: vec.subtract, len: vec.length, dist: vec.distance });
  }

  page.vec2 = vectors(2);
  page.vec3 = vectors(3);
  page.mat4 = { create: () => Float32Array.from({ length: 16 }, (_, k) => (k % 5 === 0 ? 1 : 0)) };
  // A matrix is kept column by column; a point has a fourth coordinate of 1.
  page.vec3.transformMat4 = (out, a, m) => {
    const [x, y, z, w] = [0, 1, 2, 3].map((row) => m[row] * a[0] + m[row + 4] * a[1] + m[row + 8] * a[2] + m[row + 12]);
    return page.vec3.set(out, x / w, y / w, z / w);
  };
})(globalThis);
