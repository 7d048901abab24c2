// A character for drawing, from its glTF file: links as a tree of nodes, each joint with its name and axis.

import { Geometry } from "../vendor/ogl/core/Geometry.js";
import { Mesh } from "../vendor/ogl/core/Mesh.js";
import { Transform } from "../vendor/ogl/core/Transform.js";
import { aboutAxis, conjugate, multiply, turn } from "./quaternion.js";

const JSON_CHUNK = 0x4e4f534a;

/** The parts of a glTF binary file. */
function parse(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint32(12, true);
  if (view.getUint32(16, true) !== JSON_CHUNK) throw new Error("the character's shapes cannot be read");
  const document = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  return { document, binary: 20 + length + 8, buffer };
}

function numbers({ document, binary, buffer }, accessor, Kind) {
  const { bufferView, byteOffset = 0, count, type } = document.accessors[accessor];
  const start = binary + (document.bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
  return new Kind(buffer, start, count * { SCALAR: 1, VEC3: 3 }[type]);
}

/** Reads the shapes once; every `Figure` of the character shares them. */
export function readModel(gl, buffer) {
  const file = parse(buffer);
  const meshes = (file.document.meshes ?? []).map(({ primitives }) =>
    primitives.map((primitive) => {
      const { baseColorFactor } = file.document.materials[primitive.material].pbrMetallicRoughness;
      const geometry = new Geometry(gl, {
        position: { size: 3, data: numbers(file, primitive.attributes.POSITION, Float32Array) },
        normal: { size: 3, data: numbers(file, primitive.attributes.NORMAL, Float32Array) },
        index: { data: numbers(file, primitive.indices, Uint32Array) },
      });
      return { geometry, color: baseColorFactor ?? [1, 1, 1, 1] };
    }),
  );
  return { document: file.document, meshes };
}

/** One drawn copy of a character that can be bent. */
export class Figure {
  /** `program` draws its shapes; a color is set for each before it is drawn. */
  constructor(gl, model, program) {
    this.transform = new Transform();
    this.joints = new Map();
    this.meshes = [];
    const { document } = model;
    this.nodes = document.nodes.map((node) => this.node(gl, node, model, program));
    document.nodes.forEach((node, at) => node.children?.forEach((child) => this.nodes[child].setParent(this.nodes[at])));
    // Travel, then the turn from z up to y up, then the root link.
    const travel = document.scenes[document.scene ?? 0].nodes[0];
    const up = document.nodes[travel].children[0];
    this.root = this.nodes[document.nodes[up].children[0]];
    this.root.setParent(this.transform);
    const { position, quaternion } = this.root;
    this.standing = { position: [...position], orientation: [quaternion.w, quaternion.x, quaternion.y, quaternion.z] };
  }

  node(gl, { translation = [0, 0, 0], rotation = [0, 0, 0, 1], mesh, extras }, model, program) {
    const made = new Transform();
    made.position.set(...translation);
    made.quaternion.set(...rotation);
    for (const { geometry, color } of mesh === undefined ? [] : model.meshes[mesh]) {
      const drawn = new Mesh(gl, { geometry, program, frustumCulled: false });
      drawn.onBeforeRender(() => (program.uniforms.color.value = color));
      drawn.setParent(made);
      this.meshes.push(drawn);
    }
    if (extras?.joint) {
      const [x, y, z, w] = rotation;
      const rest = [w, x, y, z];
      const turns = extras.kind === "revolute";
      const origin = turns ? multiply(rest, conjugate(aboutAxis(extras.axis, extras.angle))) : rest;
      this.joints.set(extras.joint, { made, ...extras, turns, origin, translation });
    }
    return made;
  }

  /** Puts the root link at `root` and every named joint at its angle, rad or m. */
  pose(root, angles) {
    this.root.position.set(...root.position);
    const [w, x, y, z] = root.orientation;
    this.root.quaternion.set(x, y, z, w);
    for (const [name, angle] of Object.entries(angles)) {
      const joint = this.joints.get(name);
      if (!joint) continue;
      if (joint.turns) {
        const [w, x, y, z] = multiply(joint.origin, aboutAxis(joint.axis, angle));
        joint.made.quaternion.set(x, y, z, w);
      } else {
        const way = turn(joint.origin, joint.axis).map((part) => part * (angle - joint.angle));
        joint.made.position.set(...joint.translation.map((part, at) => part + way[at]));
      }
    }
  }

  /** The corners of the box about it, in the frame of `transform`'s parent, m. */
  bounds() {
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (const mesh of this.meshes) {
      const { data } = mesh.geometry.attributes.position;
      const m = mesh.worldMatrix;
      for (let at = 0; at < data.length; at += 3) {
        for (let axis = 0; axis < 3; axis += 1) {
          const value = m[axis] * data[at] + m[4 + axis] * data[at + 1] + m[8 + axis] * data[at + 2] + m[12 + axis];
          low[axis] = Math.min(low[axis], value);
          high[axis] = Math.max(high[axis], value);
        }
      }
    }
    return [low, high];
  }
}
