// The motions that a job has learned: a card each, with footfalls, speed, cost, and whether it is natural.

import * as api from "./api.js";
import { button, digits, make, words } from "./dom.js";
import { footfalls } from "./footfalls.js";
import { failing } from "./verdict.js";

/** The cards of a job's motions. `choose` and `compare` are called with an entry of the repertoire. */
export class Repertoire {
  constructor(job, { choose, compare }) {
    this.place = job.links.motions;
    this.choose = choose;
    this.compare = compare;
    this.entries = [];
    this.cards = new Map();
    this.list = make("ul", { class: "motions" });
    this.element = make("section", { class: "card", "aria-labelledby": "repertoire-title" },
      make("h2", { id: "repertoire-title" }, "Repertoire"), this.list);
    this.element.hidden = true;
  }

  /** Fetches what there is by now; gives the entries, and the one that is the job's motion. */
  async refresh() {
    const { motions, motion } = await api.get(`${this.place}?preliminary=true`);
    this.entries = motions;
    this.best = motions.find((entry) => entry.number === motion) ?? motions[0];
    for (const entry of motions) {
      if (!this.cards.has(entry.number)) this.add(entry);
    }
    for (const [number, card] of this.cards) card.classList.toggle("best", number === motion && motions.length > 1);
    this.element.hidden = motions.length === 0;
    return this.best;
  }

  add(entry) {
    const { number, name, metrics } = entry;
    const reasons = failing(metrics.naturalness);
    const play = make("button", { type: "button", class: "motion-play", "aria-pressed": "false", onclick: () => this.choose(entry) },
      make("strong", {}, words(name)),
      make("span", { class: `verdict ${metrics.natural ? "good" : "bad"}` }, metrics.natural ? "natural" : "not natural"));
    const numbers = make("dl", { class: "motion-figures" },
      figure("Speed", `${digits(metrics.speed)} m/s`),
      figure("Cost of transport", digits(metrics.cost_of_transport)),
      figure("Stride", metrics.stride_period ? `${digits(metrics.stride_period)} s` : "–"));
    const why = metrics.natural || reasons.length === 0 ? null
      : make("p", { class: "why" }, "because of ", reasons.map(({ name }) => words(name)).join(", "));
    const diagram = make("div", { class: "diagram-slot" });
    const gait = metrics.gait && metrics.gait !== name ? make("p", { class: "measured" }, `measured as: ${words(metrics.gait)}`) : null;
    const card = make("li", { class: "motion", "data-number": number }, play, numbers, diagram, gait, why,
      button("Compare", () => this.compare(entry), "button quiet small"));
    card.play = play;
    this.cards.set(number, card);
    this.list.append(card);
    this.draw(number, diagram);
  }

  async draw(number, slot) {
    try {
      const diagram = footfalls(await api.get(`${this.place}/${number}/gait?preliminary=true`));
      if (diagram) slot.append(diagram);
    } catch {
      // The card says enough without the diagram.
    }
  }

  /** Marks which of the motions is played. */
  mark(number) {
    for (const [own, card] of this.cards) {
      card.classList.toggle("chosen", own === number);
      card.play.setAttribute("aria-pressed", String(own === number));
    }
  }
}

function figure(name, value) {
  return make("div", {}, make("dt", {}, name), make("dd", {}, value));
}
