// How the three-dimensional view is drawn: programs for the GPU, made once for each view.

import { Program } from "../vendor/ogl/core/Program.js";

const SURFACE_VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
uniform mat4 modelMatrix;
uniform mat4 viewMatrix;
uniform mat4 projectionMatrix;
uniform float behind;
out vec3 vNormal;
out vec3 vPlace;
void main() {
  vec4 place = modelMatrix * vec4(position, 1.0);
  vNormal = mat3(modelMatrix) * normal;
  vPlace = place.xyz;
  gl_Position = projectionMatrix * viewMatrix * place;
  gl_Position.z += behind * gl_Position.w;
}`;

// Light from the sky and back from the ground, a lamp, and a rim where a surface turns away.
const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 color;
uniform vec3 tint;
uniform float tinted;
uniform float opacity;
uniform vec3 cameraPosition;
in vec3 vNormal;
in vec3 vPlace;
out vec4 result;
void main() {
  vec3 normal = normalize(vNormal);
  vec3 toEye = normalize(cameraPosition - vPlace);
  vec3 lamp = normalize(vec3(0.45, 0.9, 0.5));
  vec3 base = mix(color.rgb, tint, tinted);
  float sky = 0.5 + 0.5 * normal.y;
  vec3 light = mix(vec3(0.26, 0.25, 0.25), vec3(0.52, 0.54, 0.58), sky);
  light += vec3(0.62, 0.6, 0.56) * max(dot(normal, lamp), 0.0);
  float shine = pow(max(dot(normal, normalize(lamp + toEye)), 0.0), 40.0);
  float rim = pow(1.0 - max(dot(normal, toEye), 0.0), 3.0);
  vec3 linear = base * light + vec3(0.18 * shine + 0.07 * rim);
  result = vec4(pow(linear, vec3(1.0 / 2.2)), opacity);
}`;

const FLAT_VERTEX = `#version 300 es
in vec3 position;
uniform mat4 modelMatrix;
uniform mat4 viewMatrix;
uniform mat4 projectionMatrix;
uniform float height;
void main() {
  vec4 place = modelMatrix * vec4(position, 1.0);
  vec3 lamp = vec3(0.45, 0.9, 0.5);
  float above = max(place.y - height, 0.0);
  vec3 shadow = vec3(place.x - above * lamp.x / lamp.y, height + 0.0005, place.z - above * lamp.z / lamp.y);
  gl_Position = projectionMatrix * viewMatrix * vec4(shadow, 1.0);
}`;

const FLAT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 shade;
out vec4 result;
void main() { result = shade; }`;

const GROUND_VERTEX = `#version 300 es
in vec3 position;
uniform mat4 modelMatrix;
uniform mat4 viewMatrix;
uniform mat4 projectionMatrix;
out vec3 vPlace;
void main() {
  vec4 place = modelMatrix * vec4(position, 1.0);
  vPlace = place.xyz;
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

// A grid that stays where it is while the view travels, and fades into the background with the distance.
const GROUND_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 ground;
uniform vec3 line;
uniform vec3 background;
uniform vec3 middle;
uniform float cell;
uniform float reach;
in vec3 vPlace;
out vec4 result;
float grid(vec2 place) {
  vec2 width = fwidth(place);
  vec2 near = abs(fract(place - 0.5) - 0.5) / max(width, vec2(1e-6));
  float drawn = 1.0 - min(min(near.x, near.y), 1.0);
  return drawn * clamp(0.6 / max(width.x, width.y) - 0.5, 0.0, 1.0);
}
void main() {
  float fine = grid(vPlace.xz / cell);
  float coarse = grid(vPlace.xz / (cell * 5.0));
  vec3 shown = mix(ground, line, clamp(0.35 * fine + 0.65 * coarse, 0.0, 1.0));
  float far = smoothstep(0.25, 1.0, length(vPlace.xz - middle.xz) / reach);
  result = vec4(mix(shown, background, far), 1.0);
}`;

/**
 * Draws solid shapes in their colors, or in a tint of their own (contact forces, direction). What is drawn a little
 * `behind` does not flicker through others at the same place.
 */
export function surfaceProgram(gl, { tint = [0, 0, 0], tinted = 0, opacity = 1, behind = 0 } = {}) {
  return new Program(gl, {
    vertex: SURFACE_VERTEX,
    fragment: SURFACE_FRAGMENT,
    transparent: opacity < 1,
    depthWrite: true,
    uniforms: {
      color: { value: [1, 1, 1, 1] }, tint: { value: tint }, tinted: { value: tinted }, opacity: { value: opacity },
      behind: { value: behind },
    },
  });
}

/** Draws the shadow that shapes throw on level ground: each place of it once, however many shapes lie over it. */
export function shadowProgram(gl) {
  const program = new Program(gl, {
    vertex: FLAT_VERTEX,
    fragment: FLAT_FRAGMENT,
    transparent: true,
    cullFace: false,
    depthWrite: false,
    uniforms: { color: { value: [0, 0, 0, 1] }, shade: { value: [0, 0, 0, 0.2] }, height: { value: 0 } },
  });
  program.setStencilFunc(gl.EQUAL, 0, 0xff);
  program.setStencilOp(gl.KEEP, gl.KEEP, gl.INCR);
  return program;
}

/** Draws the ground, before all else and under it: its square is so large that its depths are not exact enough to compare. */
export function groundProgram(gl) {
  return new Program(gl, {
    vertex: GROUND_VERTEX,
    fragment: GROUND_FRAGMENT,
    cullFace: false,
    depthWrite: false,
    uniforms: {
      ground: { value: [1, 1, 1] }, line: { value: [0, 0, 0] }, background: { value: [1, 1, 1] },
      middle: { value: [0, 0, 0] }, cell: { value: 0.1 }, reach: { value: 5 },
    },
  });
}
