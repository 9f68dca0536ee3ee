// Vectors and 3x3 matrices (rows one after another) in double. Camera frame: x right, y down, z forward.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scaled(a, 1 / (norm(a) || 1));

const row = (m, i) => [m[3 * i], m[3 * i + 1], m[3 * i + 2]];
const column = (m, i) => [m[i], m[3 + i], m[6 + i]];
const timesVector = (m, v) => [dot(row(m, 0), v), dot(row(m, 1), v), dot(row(m, 2), v)];
const transposed = (m) => [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];
const times = (a, b) => {
  const c = new Array(9);
  for (let i = 0; i < 3; ++i)
    for (let j = 0; j < 3; ++j) c[3 * i + j] = dot(row(a, i), column(b, j));
  return c;
};
const determinant = (m) => dot(row(m, 0), cross(row(m, 1), row(m, 2)));
const inverse = (m) => {
  const d = 1 / determinant(m);
  const c0 = cross(row(m, 1), row(m, 2)), c1 = cross(row(m, 2), row(m, 0)), c2 = cross(row(m, 0), row(m, 1));
  return [c0[0] * d, c1[0] * d, c2[0] * d, c0[1] * d, c1[1] * d, c2[1] * d, c0[2] * d, c1[2] * d, c2[2] * d];
};

// About a unit axis.
const turned = (v, axis, angle) => {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scaled(v, c), scaled(cross(axis, v), s)), scaled(axis, dot(axis, v) * (1 - c)));
};

// cam_from_world's rotation that looks forward with `up` up; where the two coincide, any.
const lookingAlong = (forward, up) => {
  const z = unit(forward);
  let x = cross(z, up);
  if (norm(x) < 1e-9) x = cross(z, Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]);
  x = unit(x);
  const y = cross(z, x);
  return [...x, ...y, ...z];
};

// The rotation nearest to M's rows (K R up to scale): Gram-Schmidt from the optical axis.
const rotationOf = (m) => {
  const z = unit(row(m, 2));
  const x = unit(sub(row(m, 0), scaled(z, dot(row(m, 0), z))));
  return [...x, ...cross(z, x), ...z];
};

// Between two rotations, s in [0, 1], along the shortest turn.
const slerpRotation = (a, b, s) => {
  const d = times(b, transposed(a));
  const c = Math.min(1, Math.max(-1, (d[0] + d[4] + d[8] - 1) / 2)), angle = Math.acos(c);
  if (angle < 1e-9) return b;
  let axis = [d[7] - d[5], d[2] - d[6], d[3] - d[1]];
  if (norm(axis) < 1e-9) axis = [1, 0, 0];
  axis = unit(axis);
  const result = [];
  for (let i = 0; i < 3; ++i) result.push(turned(column(a, i), axis, angle * s));
  return transposed(result.flat());
};
