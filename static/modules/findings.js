// What was understood of a character, and the notes on what had to be done to it.

import { count, digits, make } from "./dom.js";

/** Kinds of notes, those that matter most first. */
const WEIGHTS = [
  ["kept", "Doubtful, kept as given", "This may change how it moves. Look at these first.", "high"],
  ["repaired", "Repaired", "A fault was mended; see whether it was meant so.", "middle"],
  ["approximated", "Made simpler", "Something was replaced by something simpler.", "low"],
  ["ignored", "Left out", "This has no bearing on the physics.", "low"],
];

/** Facts that take a whole line. */
const WIDE = ["Stands", "Learns"];

/** The facts about a character in a few lines. */
export function facts(character) {
  const { mass, links, joints, shapes, standing, teaching } = character;
  const driven = joints.filter((joint) => joint.driven).length;
  const rows = {
    Mass: `${digits(mass)} kg`,
    Links: links.length,
    Joints: driven === joints.length ? `${joints.length}, all driven` : `${joints.length}, of these ${driven} driven`,
    Shapes: shapes.length,
    Stands: standing.stable ? `${digits(standing.root_height)} m high, on ${supports(standing.support)}` : "in no pose that was found",
  };
  if (teaching) rows.Learns = learns(teaching);
  return make("dl", { class: "facts" }, Object.entries(rows).map(([name, value]) => make("div", { class: WIDE.includes(name) ? "wide" : "" }, make("dt", {}, name), make("dd", {}, value))));
}

/** What it will be taught. */
function learns({ gaits, because }) {
  return because ? `one motion without a name: ${because}` : gaits.join(", ");
}

function supports(links) {
  return links.length > 4 ? count(links.length, "link") : links.join(", ");
}

/** The notes, grouped by how much they matter; `null` without any. */
export function notesSection({ notes }) {
  if (notes.length === 0) {
    return make("p", { class: "all-clear" }, "Nothing had to be repaired, simplified or left out.");
  }
  const groups = WEIGHTS.map(([kind, title, meaning, weight], at) => {
    const own = notes.filter((note) => note.kind === kind);
    if (own.length === 0) return null;
    const items = own.map((note) =>
      make("li", {}, make("code", {}, note.link ?? note.joint ?? note.character), " ", note.message));
    return make("details", { class: `notes ${weight}`, open: at === 0 },
      make("summary", {}, title, make("span", { class: "tally" }, String(own.length))),
      make("p", {}, meaning),
      make("ul", {}, items));
  });
  return make("div", { "aria-label": "Notes" }, groups);
}
