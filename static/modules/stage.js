// The three-dimensional view: a character on level ground, with its shadow, the ghost of its targets, the forces at its
// contacts and the direction it is to go. It is drawn when something has changed, not all the time.

import { Camera } from "../vendor/ogl/core/Camera.js";
import { Geometry } from "../vendor/ogl/core/Geometry.js";
import { Mesh } from "../vendor/ogl/core/Mesh.js";
import { Renderer } from "../vendor/ogl/core/Renderer.js";
import { Transform } from "../vendor/ogl/core/Transform.js";
import { Aim } from "./aim.js";
import { Arrows } from "./arrow.js";
import { button, make } from "./dom.js";
import { Figure, readModel } from "./model.js";
import { Orbit } from "./orbit.js";
import { groundProgram, shadowProgram, surfaceProgram } from "./shaders.js";

const FIELD = 32;
/** A contact that carries the whole character has an arrow this many times its size. */
const FORCE_LENGTH = 0.9;
/** m/s². */
const EARTH_GRAVITY = 9.81;

export class Stage {
  /** `label` says to readers of the screen what is seen; `turned` is told the angle (rad) to which the direction is dragged. */
  constructor(label, turned) {
    this.canvas = make("canvas", { class: "stage-canvas", tabIndex: 0, role: "img", "aria-label": label });
    this.element = make("div", { class: "stage" }, this.canvas, this.buttons());
    this.gravity = EARTH_GRAVITY;
    // Without WebGL the page does all else.
    const probe = document.createElement("canvas").getContext("webgl2");
    if (!probe) {
      this.element.replaceChildren(make("p", { class: "stage-missing" }, "This browser shows no 3-D view (WebGL 2 is missing)."));
      return;
    }
    probe.getExtension("WEBGL_lose_context")?.loseContext();
    this.renderer = new Renderer({ canvas: this.canvas, antialias: true, stencil: true, dpr: Math.min(devicePixelRatio, 2) });
    this.gl = this.renderer.gl;
    this.build();
    // Before the orbit: what takes hold of the arrow does not turn the view.
    if (turned) new Aim(this.canvas, this.camera, () => this.aimed, turned);
    this.orbit = new Orbit(this.canvas, () => this.redraw());
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(this.element);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.scheme.addEventListener("change", (this.recolor = () => this.paint()));
    this.paint();
  }

  buttons() {
    const control = (text, name, act) => {
      const made = button(text, act, "stage-button");
      made.setAttribute("aria-label", name);
      made.title = name;
      return made;
    };
    return make("div", { class: "stage-buttons" },
      control("+", "Come nearer", () => this.orbit?.zoom(0.8)),
      control("−", "Go farther away", () => this.orbit?.zoom(1.25)),
      control("⟲", "Look from the usual place", () => this.orbit?.home()),
    );
  }

  build() {
    const { gl } = this;
    this.camera = new Camera(gl, { fov: FIELD, near: 0.01, far: 200 });
    this.scene = new Transform();
    // The frame of the documents: z up, x forward. The view's own has y up.
    this.world = new Transform();
    this.world.quaternion.set(-0.5, -0.5, -0.5, 0.5);
    this.world.setParent(this.scene);
    this.programs = {
      ground: groundProgram(gl),
      shadow: shadowProgram(gl),
      body: surfaceProgram(gl),
      ghost: surfaceProgram(gl, { tint: [0.1, 0.5, 0.9], tinted: 0.85, opacity: 0.28, behind: 5e-5 }),
      force: surfaceProgram(gl, { tint: [0.85, 0.03, 0.05], tinted: 1 }),
      direction: surfaceProgram(gl, { tint: [0.02, 0.32, 0.2], tinted: 1 }),
    };
    const square = new Float32Array([-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1]);
    const geometry = new Geometry(gl, { position: { size: 3, data: square }, index: { data: new Uint16Array([0, 1, 2, 0, 2, 3]) } });
    this.ground = new Mesh(gl, { geometry, program: this.programs.ground, frustumCulled: false, renderOrder: -2 });
    this.ground.setParent(this.scene);
    this.forces = new Arrows(gl, this.programs.force, this.world);
    this.direction = new Arrows(gl, this.programs.direction, this.world);
  }

  /** Shows a character in its standing pose: the bytes of its glTF file, and its mass, kg. */
  setCharacter(buffer, mass) {
    this.mass = mass;
    if (!this.gl) return;
    const model = readModel(this.gl, buffer);
    const figure = (program, order) => {
      const made = new Figure(this.gl, model, program);
      made.meshes.forEach((mesh) => (mesh.renderOrder = order));
      made.transform.setParent(this.world);
      return made;
    };
    this.body = figure(this.programs.body, 0);
    this.shadow = figure(this.programs.shadow, -1);
    this.ghost = figure(this.programs.ghost, 1);
    this.ghost.transform.visible = false;
    this.scene.updateMatrixWorld(true);
    const [low, high] = this.body.bounds();
    this.size = Math.max(Math.hypot(...high.map((part, at) => part - low[at])), 0.05);
    this.middle = low.map((part, at) => (part + high[at]) / 2 - this.body.root.worldMatrix[12 + at]);
    this.middle[1] = 0.48 * (low[1] + high[1]);
    this.reach = 0.6 * Math.hypot(high[0] - low[0], high[2] - low[2]);
    this.programs.ground.uniforms.cell.value = 10 ** Math.round(Math.log10(this.size / 5));
    this.ground.scale.set(this.size * 40);
    this.resize();
    this.look(this.body.standing.position);
  }

  /** Forces are drawn in shares of the weight under this gravity, m/s²; under the Earth's where there is none. */
  setGravity(gravity) {
    this.gravity = Math.hypot(...gravity) || EARTH_GRAVITY;
  }

  /** Puts the character where `moment` of a motion has it; `shown` tells whether with ghost and forces. */
  pose(moment, shown = {}) {
    if (!this.body) return;
    this.body.pose(moment.root, moment.angles);
    this.shadow.pose(moment.root, moment.angles);
    this.ghost.transform.visible = Boolean(shown.ghost);
    if (shown.ghost) this.ghost.pose(moment.root, moment.targets);
    this.forces.show(shown.forces && moment.contacts ? moment.contacts.map((contact) => this.arrow(contact)).filter(Boolean) : []);
    this.look(moment.root.position);
  }

  arrow({ position, force }) {
    const size = Math.hypot(...force);
    const length = (FORCE_LENGTH * this.size * size) / (this.mass * this.gravity);
    if (length < 0.01 * this.size) return null;
    return { from: position, along: force.map((part) => part / size), length, thickness: Math.min(this.size * 0.35, 2 * length) };
  }

  /** Shows where the character is to go: an angle to the left of where it looks, rad; `null` shows nothing. */
  setDirection(angle) {
    if (!this.body) return;
    const along = [Math.cos(angle), Math.sin(angle), 0];
    const [x, y] = this.body.standing.position;
    const from = [x + along[0] * this.reach, y + along[1] * this.reach, 0.012 * this.size];
    const length = this.size * 0.35;
    this.direction.show(angle === null ? [] : [{ from, along, length, thickness: this.size * 0.4 }]);
    const seen = ([x, y, z]) => [y, z, x];
    const to = from.map((part, at) => part + length * along[at]);
    this.aimed = angle === null ? null : { about: seen([x, y, 0]), from: seen(from), to: seen(to) };
    this.redraw();
  }

  look([x, y]) {
    // From z up to y up: x goes to z, y to x.
    this.orbit.target = [y + this.middle[0], this.middle[1], x + this.middle[2]];
    this.redraw();
  }

  paint() {
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name).trim().split(/\s+/).map((part) => Number(part) / 255);
    const { ground, shadow } = this.programs;
    this.background = color("--stage-background");
    ground.uniforms.background.value = this.background;
    ground.uniforms.ground.value = color("--stage-ground");
    ground.uniforms.line.value = color("--stage-line");
    shadow.uniforms.shade.value = [0, 0, 0, this.scheme.matches ? 0.45 : 0.22];
    this.redraw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.perspective({ aspect: width / height });
    this.redraw();
  }

  redraw() {
    if (!this.gl || this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = null;
      this.draw();
    });
  }

  draw() {
    const { gl, camera, orbit, ground } = this;
    const narrow = Math.min(1, this.renderer.width / this.renderer.height);
    const far = this.direction.drawn[0]?.visible ? 2.5 : 2.1;
    orbit.place(camera, ((this.size ?? 1) * far) / narrow ** 0.8);
    ground.position.set(orbit.target[0], 0, orbit.target[2]);
    ground.program.uniforms.middle.value = orbit.target;
    ground.program.uniforms.reach.value = (this.size ?? 1) * 9;
    gl.clearColor(...this.background, 1);
    this.renderer.render({ scene: this.scene, camera });
  }

  /** Lets go of the view; what comes for it later is not drawn. */
  dispose() {
    if (!this.gl) return;
    cancelAnimationFrame(this.waiting);
    this.sizes.disconnect();
    this.scheme.removeEventListener("change", this.recolor);
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    this.gl = null;
  }
}
