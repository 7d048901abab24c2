// An arrow along z: a shaft and a head, to be turned and stretched.

import { Geometry } from "../vendor/ogl/core/Geometry.js";
import { Mesh } from "../vendor/ogl/core/Mesh.js";

const SIDES = 20;

/** Rings of an outline (radius, height) turned about z; each stretch of it has a normal of its own. */
function turned(gl, outline) {
  const [positions, normals, indices] = [[], [], []];
  for (let at = 0; at + 1 < outline.length; at += 1) {
    const [[r0, z0], [r1, z1]] = [outline[at], outline[at + 1]];
    const length = Math.hypot(r1 - r0, z1 - z0);
    const [out, up] = [(z1 - z0) / length, (r0 - r1) / length];
    const base = positions.length / 3;
    for (let side = 0; side <= SIDES; side += 1) {
      const [c, s] = [Math.cos((2 * Math.PI * side) / SIDES), Math.sin((2 * Math.PI * side) / SIDES)];
      positions.push(r0 * c, r0 * s, z0, r1 * c, r1 * s, z1);
      normals.push(out * c, out * s, up, out * c, out * s, up);
      if (side === SIDES) continue;
      const first = base + 2 * side;
      indices.push(first, first + 2, first + 1, first + 1, first + 2, first + 3);
    }
  }
  return new Geometry(gl, {
    position: { size: 3, data: new Float32Array(positions) },
    normal: { size: 3, data: new Float32Array(normals) },
    index: { data: new Uint16Array(indices) },
  });
}

/** Arrows that share their shape: of length 1 from the origin along z. */
export class Arrows {
  constructor(gl, program, parent) {
    Object.assign(this, { gl, program, parent, drawn: [] });
    this.geometry = turned(gl, [[0, 0], [0.035, 0], [0.035, 0.72], [0.1, 0.72], [0, 1]]);
  }

  /** Shows one arrow for each of `wanted`: where it starts, where it points, how long and how thick it is. */
  show(wanted) {
    while (this.drawn.length < wanted.length) {
      const mesh = new Mesh(this.gl, { geometry: this.geometry, program: this.program, frustumCulled: false });
      mesh.setParent(this.parent);
      this.drawn.push(mesh);
    }
    this.drawn.forEach((mesh, at) => {
      mesh.visible = at < wanted.length;
      if (mesh.visible) lay(mesh, wanted[at]);
    });
  }
}

function lay(mesh, { from, along, length, thickness }) {
  mesh.position.set(...from);
  mesh.scale.set(thickness, thickness, length);
  // The rotation that takes z to `along` on the shortest way.
  const [x, y, z] = along;
  const q = z < -0.9999 ? [1, 0, 0, 0] : [-y, x, 0, 1 + z];
  const size = Math.hypot(...q);
  mesh.quaternion.set(...q.map((part) => part / size));
}
