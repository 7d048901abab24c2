// Plays motions of one character: the view, and the controls of a player below it.

import * as api from "./api.js";
import { announce, button, complain, digits, make } from "./dom.js";
import { loopOf, simulationOf } from "./motion.js";
import { Stage } from "./stage.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
/** How long a simulation goes on after the motion has entered its loop, s. */
const SIMULATED = 4;
/** How long before its end a motion is shown at its end, s: the end itself is the start of the next turn. */
const END = 1e-6;

export class Player {
  /** `character` is the check document; `label` names the view. */
  constructor(character, label) {
    this.character = character;
    this.stage = new Stage(label);
    this.shown = { ghost: false, forces: false };
    /** Gives up the simulation that is being computed. */
    this.simulation = new AbortController();
    // Whole turns of the loop, and the time in the present one, s.
    Object.assign(this, { turns: 0, within: 0, playing: false, speed: 1, loops: true, track: null, motion: null });
    this.title = make("p", { class: "player-title" });
    this.problem = make("div");
    this.element = make("div", { class: "player" }, this.stage.element, this.title, this.controls(), this.problem);
    this.enable(false);
  }

  controls() {
    this.playButton = button("Play", () => this.toggle(), "button round");
    this.slider = make("input", {
      type: "range", min: 0, max: 1, step: 0.01, value: 0, class: "scrub", "aria-label": "Time in the motion",
      oninput: () => this.seek(Number(this.slider.value)),
    });
    this.clock = make("output", { class: "clock" }, "0.00 s");
    this.speedChoice = make("select", { "aria-label": "Speed of play", onchange: () => (this.speed = Number(this.speedChoice.value)) },
      SPEEDS.map((speed) => make("option", { value: speed, selected: speed === 1 }, `${speed}×`)));
    const check = (text, checked, change) => {
      const box = make("input", { type: "checkbox", checked, onchange: () => change(box.checked) });
      return make("label", { class: "toggle" }, box, text);
    };
    this.loopCheck = check("Loop", true, (on) => (this.loops = on));
    this.ghostCheck = check("Ghost of the targets", false, (on) => this.setGhost(on));
    this.forceCheck = check("Simulate from standing, with contact forces", false, (on) => this.setForces(on));
    return make("div", { class: "transport", role: "group", "aria-label": "Player" },
      make("div", { class: "transport-line" }, this.playButton, this.slider, this.clock, this.speedChoice),
      make("div", { class: "transport-line wrap" }, this.loopCheck, this.ghostCheck, this.forceCheck));
  }

  enable(on) {
    this.element.querySelectorAll(".transport button, .transport input, .transport select").forEach((control) => (control.disabled = !on));
  }

  /** Fetches the character's shapes; until then nothing is seen. */
  async load() {
    const { id, mass } = this.character;
    this.stage.setCharacter(await api.bytes(`/v1/characters/${id}/standing.glb`), mass);
    this.show();
  }

  /** Takes up a motion document, called `name`, and plays it. */
  setMotion(motion, name) {
    if (this.disposed) return;
    this.motion = motion;
    this.title.textContent = name;
    this.stage.setGravity(motion.scene.gravity);
    this.enable(true);
    this.use(loopOf(motion));
    if (this.shown.forces) this.simulate();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  use(track) {
    this.track = track;
    [this.turns, this.within] = [0, 0];
    this.slider.max = track.duration;
    this.show();
  }

  setGhost(on) {
    this.shown.ghost = on;
    this.show();
  }

  setForces(on) {
    this.shown.forces = on;
    if (on) return this.simulate();
    this.simulation.abort();
    this.use(loopOf(this.motion));
  }

  /** Plays what the simulator makes of the motion, with the forces that it finds. */
  async simulate() {
    complain(this.problem, null);
    this.simulation.abort();
    this.simulation = new AbortController();
    const { motion, simulation: { signal } } = this;
    try {
      const { preliminary, ...document } = motion;
      const entry = motion.entry.at(-1)?.time ?? 0;
      const lines = await api.simulate({
        character: { id: this.character.id },
        scene: motion.scene,
        accuracy: motion.provenance.accuracy,
        drive: { kind: "track", motion: document },
        duration: Math.ceil((entry + SIMULATED) * 50) / 50,
        sample_every: 0.02,
      }, signal);
      this.use(simulationOf(motion, lines.filter((line) => line.time !== undefined)));
      announce("The simulation from standing is shown, with contact forces.");
    } catch (error) {
      if (signal.aborted) return;
      this.shown.forces = this.forceCheck.control.checked = false;
      complain(this.problem, error);
    }
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (!this.track || this.playing) return;
    if (this.within >= this.track.duration - END) this.within = 0;
    this.playing = true;
    this.playButton.textContent = "Pause";
    let last = null;
    const step = (now) => {
      if (!this.playing) return;
      // A page that was away goes on where it was.
      const passed = last === null ? 0 : Math.min((now - last) / 1000, 0.1);
      last = now;
      this.advance(passed * this.speed);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.playing = false;
    this.playButton.textContent = "Play";
  }

  advance(seconds) {
    const { duration, repeats } = this.track;
    this.within += seconds;
    if (this.within >= duration && !this.loops) {
      this.within = duration - END;
      this.pause();
    } else if (this.within >= duration) {
      if (repeats) this.turns += Math.floor(this.within / duration);
      this.within %= duration;
    }
    this.show();
  }

  /** Goes to a time in the turn that is played. */
  seek(within) {
    this.within = Math.min(within, this.track.duration - END);
    this.show();
  }

  show() {
    if (!this.track) return;
    this.slider.value = this.within;
    this.clock.textContent = `${digits(this.within)} s`;
    this.stage.pose(this.track.at(this.turns * this.track.duration + this.within), this.shown);
  }

  /** Lets go of the view; a motion that comes for it later is not played. */
  dispose() {
    this.disposed = true;
    this.pause();
    this.simulation.abort();
    this.stage.dispose();
  }
}
