// Rotations as the documents have them: unit quaternions [w, x, y, z].

export function multiply([a, b, c, d], [w, x, y, z]) {
  return [
    a * w - b * x - c * y - d * z,
    a * x + b * w + c * z - d * y,
    a * y - b * z + c * w + d * x,
    a * z + b * y - c * x + d * w,
  ];
}

export function conjugate([w, x, y, z]) {
  return [w, -x, -y, -z];
}

/** The rotation about a unit axis by an angle, rad. */
export function aboutAxis([x, y, z], angle) {
  const sine = Math.sin(angle / 2);
  return [Math.cos(angle / 2), sine * x, sine * y, sine * z];
}

/** A vector as a rotation turns it. */
export function turn(q, [x, y, z]) {
  return multiply(multiply(q, [0, x, y, z]), conjugate(q)).slice(1);
}

/** The rotation a share of the way from one to the other, on the shorter side. */
export function between(from, to, share) {
  const near = from.reduce((sum, part, at) => sum + part * to[at], 0) < 0 ? -1 : 1;
  const mixed = from.map((part, at) => part + (near * to[at] - part) * share);
  const length = Math.hypot(...mixed);
  return mixed.map((part) => part / length);
}

/** The angle about z of the x axis seen from above, rad. */
export function heading(q) {
  const [x, y] = turn(q, [1, 0, 0]);
  return Math.atan2(y, x);
}
