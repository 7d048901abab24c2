// What is wanted of a character: the form, its presets, and the job document that it makes.

import { button, make } from "./dom.js";
import { directionDial } from "./dial.js";

const EFFECTS = {
  gravity: "Gravity", velocity_forces: "Forces of velocity", ground_contact: "Contact with the ground",
  friction: "Friction", self_collision: "Contact with itself", obstacles: "Obstacles", joint_limits: "Ends of joints",
  torque_limits: "Strength of motors", joint_damping: "Damping of joints", joint_friction: "Friction in joints",
  trunk_rotation_lock: "Trunk that cannot turn",
};
/** What a preset puts into the form; all else goes back to its default. */
const PRESETS = [
  ["Every gait", "three minutes", { seconds: 180 }],
  ["First look", "half a minute", { seconds: 30 }],
  ["Thorough", "ten minutes", { seconds: 600 }],
  ["As fast as it can", "three minutes", { seconds: 180, pace: "fastest" }],
];

/** The form for a character: `turned` is told the direction, degrees. */
export class SettingsForm {
  constructor(character, submitted, turned) {
    this.dial = directionDial(turned);
    this.fields = {};
    this.submit = make("button", { class: "button big" }, "Learn to move");
    this.problem = make("div");
    this.element = make("form", { class: "settings", onsubmit: (event) => {
      event.preventDefault();
      submitted(this.document());
    } },
      this.presets(),
      make("div", { class: "settings-main" }, this.direction(), make("div", { class: "stack" }, this.gait(character), this.pace(), this.effort())),
      this.details(),
      this.problem, this.submit);
  }

  presets() {
    const buttons = PRESETS.map(([name, about, values]) => {
      const made = button(name, () => {
        this.before = undefined;
        this.fill(values);
      }, "chip");
      made.title = about;
      return made;
    });
    return make("div", { class: "presets", role: "group", "aria-label": "Presets" }, buttons);
  }

  direction() {
    return make("div", { class: "field" }, make("span", { class: "label" }, "Direction"), this.dial.element);
  }

  gait(character) {
    const names = character.teaching?.gaits ?? [];
    const choices = [make("option", { value: "any" }, names.length ? "every one it can do" : "whatever it finds")];
    return this.field("gait", "Gait", make("select", {}, ...choices, ...names.map((name) => make("option", {}, name))));
  }

  pace() {
    const speed = this.input("speed", { type: "number", min: 0.01, step: "any", placeholder: "m/s", disabled: true, "aria-label": "Speed, m/s" });
    const pace = make("select", { onchange: () => this.ask() },
      make("option", { value: "comfortable" }, "what costs least"),
      make("option", { value: "fastest" }, "as fast as it can"),
      make("option", { value: "number" }, "m/s …"),
      make("option", { value: "froude" }, "Froude number …"));
    return make("div", { class: "numbered" }, this.field("pace", "Speed", pace), speed);
  }

  /** A number is asked for only where the choice of speed wants one. */
  ask() {
    const { pace, speed } = this.fields;
    speed.disabled = !["number", "froude"].includes(pace.value);
    speed.placeholder = pace.value === "froude" ? "v² / (g h)" : "m/s";
    speed.required = !speed.disabled;
  }

  effort() {
    return make("div", { class: "pair" },
      this.field("seconds", "Longest training, s", make("input", { type: "number", min: 1, step: "any", value: 180 })),
      this.field("seed", "Seed", make("input", { type: "number", min: 0, step: 1, value: 0 })));
  }

  details() {
    const effects = Object.entries(EFFECTS).map(([name, title]) => this.field(`effect:${name}`, title, make("select", {},
      make("option", { value: "" }, "auto"), make("option", {}, "on"), make("option", {}, "off"))));
    const accuracy = make("select", {},
      make("option", { value: "" }, "usual for its size"),
      ...[["1e-2", "error below 1 cm"], ["1e-3", "error below 1 mm"], ["1e-4", "error below 0.1 mm"]].map(([value, text]) => make("option", { value }, text)));
    return make("details", {},
      make("summary", {}, "Budget, accuracy and effects"),
      make("div", { class: "grid" },
        this.field("generations", "Generations at most", make("input", { type: "number", min: 1, step: 1, placeholder: "no limit" })),
        this.field("gait_generations", "Generations of a gait", make("input", { type: "number", min: 1, step: 1, placeholder: "usual" })),
        this.field("accuracy", "Accuracy", accuracy),
        this.field("trunk", "Trunk", make("select", {}, make("option", {}, "free"), make("option", {}, "locked"))),
        this.field("search", "Search", make("select", {}, make("option", { value: "natural" }, "gait by gait"), make("option", { value: "paper" }, "QDSEGA as published"))),
        this.field("energy", "Weight of energy", make("input", { type: "number", min: 0, step: "any", value: 1 }))),
      make("h3", {}, "Physical effects"),
      make("div", { class: "grid" }, effects));
  }

  input(name, properties) {
    return (this.fields[name] = make("input", properties));
  }

  field(name, title, control) {
    this.fields[name] = control;
    control.name = name;
    return make("label", { class: "field" }, make("span", { class: "label" }, title), control);
  }

  /** Puts values into the form, and the defaults everywhere else but for the direction. */
  fill(values) {
    this.element.reset();
    for (const [name, value] of Object.entries(values)) {
      if (value != null && this.fields[name]) this.fields[name].value = value;
    }
    this.ask();
  }

  /** Takes over what another job was asked for; what the form does not show of it stays as it was. */
  take({ task, learning, scene, accuracy, seed, priority, accuracy_choice: chosen }) {
    this.before = { task, learning, scene, accuracy, priority, chosen: chosen?.tolerance ?? accuracy.tolerance };
    const effects = Object.entries(scene.effects).map(([name, value]) => [`effect:${name}`, value === "auto" ? "" : value]);
    const speed = typeof task.speed === "number" ? task.speed : task.froude;
    const tolerance = this.before.chosen ? written(this.before.chosen) : "";
    this.offer("accuracy", tolerance, (text) => `error below ${Number(text)} m`);
    this.fill({
      gait: task.gait,
      pace: task.froude != null ? "froude" : task.speed === "fastest" ? "fastest" : task.speed != null ? "number" : "comfortable",
      speed,
      seconds: learning.seconds ?? "",
      generations: learning.generations,
      gait_generations: learning.gait_generations,
      trunk: learning.trunk,
      search: learning.search,
      energy: task.weights.energy,
      accuracy: tolerance,
      seed,
      ...Object.fromEntries(effects),
    });
    this.dial.setVector(task.direction);
  }

  /** Adds a choice to a list that does not have it. */
  offer(name, value, text) {
    const list = this.fields[name];
    if (![...list.options].some((option) => option.value === value)) list.append(make("option", { value }, text(value)));
  }

  /** The job document: what the job before was asked for, if it is one with changes, and only what differs from the defaults of an unknown
   * character. */
  document() {
    const value = (name) => this.fields[name].value;
    const number = (name) => (value(name) === "" ? undefined : Number(value(name)));
    const effects = Object.keys(EFFECTS).filter((name) => value(`effect:${name}`)).map((name) => [name, value(`effect:${name}`)]);
    const { before = {} } = this;
    const task = { ...before.task, direction: this.dial.vector(), gait: value("gait"), speed: undefined, froude: undefined };
    if (value("pace") === "fastest") task.speed = "fastest";
    if (value("pace") === "number") task.speed = number("speed");
    if (value("pace") === "froude") task.froude = number("speed");
    if (number("energy") !== undefined) task.weights = { ...before.task?.weights, energy: number("energy") };
    const document = {
      task,
      learning: {
        ...before.learning,
        seconds: number("seconds"), generations: number("generations"), gait_generations: number("gait_generations"),
        trunk: value("trunk"), search: value("search"),
      },
      seed: number("seed"),
      priority: before.priority,
    };
    if (effects.length || before.scene) {
      const hidden = Object.entries(before.scene?.effects ?? {}).filter(([name]) => !(name in EFFECTS));
      document.scene = { ...before.scene, effects: Object.fromEntries([...hidden, ...effects]) };
    }
    if (value("accuracy")) document.accuracy = { tolerance: number("accuracy") };
    else if (!before.chosen) document.accuracy = before.accuracy;
    return document;
  }
}

/** A number as the lists have it: "1e-3". */
function written(number) {
  return number.toExponential().replace("+", "");
}
