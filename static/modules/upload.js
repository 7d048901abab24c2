// Where a page begins: a character is dropped, chosen, or taken from those that come with the program.

import * as api from "./api.js";
import { complain, make, svg } from "./dom.js";

/** The characters that come with the program: file, name, what they are, and their outline in a box of 64 by 40. */
const BUNDLED = [
  ["quadruped.urdf", "Quadruped", "four legs, 12 joints", "M14 14h34v6H14zM17 20l-3 8 4 8M24 20l-3 8 4 8M40 20l-3 8 4 8M46 20l-3 8 4 8M48 15l6-4"],
  ["biped.urdf", "Biped", "two legs, 8 joints", "M26 5h12v12H26zM28 17l-3 9 4 9h5M36 17l3 9-4 9h5"],
  ["runner.urdf", "Runner", "two light legs", "M21 4h22v14H21zM30 18l-9 6-4 9h5M34 18l6 8 8 5v-5"],
  ["hexapod.json", "Hexapod", "six legs, 18 joints", "M18 16h28v6H18zM20 22l-8-4-4 14M30 22l-3 6-4 6M42 22l8-4 4 14M26 16l-8-6-4 6M34 22l3 6 4 6M38 16l8-6 4 6"],
  ["spider.json", "Spider", "eight legs, 24 joints", "M22 16h20v7H22zM16 13a6 6 0 1 0 .1 0M24 23l-8-5-5 13M29 23l-6-2-4 12M36 23l6-2 4 12M40 23l8-5 5 13M24 16l-7-7-6 5M29 16l-4-8-6 4M36 16l4-8 6 4M40 16l7-7 6 5"],
  ["snake.json", "Snake", "no legs, 11 joints", "M6 28c6-16 12-16 17-4s11 12 16 0 10-12 15-2l4 2"],
  ["pantograph.json", "Pantograph", "legs with closed loops", "M16 10h32v6H16zM20 16l-6 8 5 10M20 16l6 8-7 10M42 16l-6 8 5 10M42 16l6 8-7 10"],
];

/** The section with drop zone and bundled characters; `opened` is called with the check document of what was taken. */
export function uploadSection(opened) {
  const problem = make("div");
  const input = make("input", { id: "file", type: "file", accept: ".urdf,.xml,.json,.zip", onchange: () => input.files[0] && take(input.files[0], input.files[0].name) });
  const hint = make("span", { class: "drop-hint" }, "URDF, character JSON, or a zip of a URDF with its meshes");
  const drop = make("label", { class: "drop", for: "file" },
    svg("svg", { viewBox: "0 0 24 24", class: "drop-icon", "aria-hidden": "true" }, svg("path", { d: "M12 16V4m0 0L7 9m5-5 5 5M4 16v4h16v-4" })),
    make("strong", {}, "Drop a character here"),
    make("span", {}, "or ", make("span", { class: "link" }, "choose a file")),
    hint, input);
  drop.addEventListener("dragover", (event) => {
    event.preventDefault();
    drop.classList.add("over");
  });
  drop.addEventListener("dragleave", () => drop.classList.remove("over"));
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    const [file] = event.dataTransfer.files;
    if (file) take(file, file.name);
  });

  /** Counts what was taken, so that only the last of it is opened. */
  let turn = 0;

  /** Takes a file, or one that has yet to come. */
  async function take(file, name) {
    const own = ++turn;
    complain(problem, null);
    drop.classList.add("busy");
    hint.textContent = `Reading ${name}, and looking how it stands…`;
    try {
      const character = await api.addCharacter(await file);
      // One who has gone elsewhere meanwhile stays there.
      if (own === turn && section.isConnected) opened(character);
    } catch (error) {
      error.title = `${name} cannot be used`;
      if (own === turn) complain(problem, error);
    } finally {
      if (own === turn) {
        drop.classList.remove("busy");
        hint.textContent = "URDF, character JSON, or a zip of a URDF with its meshes";
        input.value = "";
      }
    }
  }

  const cards = BUNDLED.map(([file, name, about, outline]) =>
    make("button", { type: "button", class: "specimen", onclick: () => take(api.file(`/characters/${file}`), name) },
      svg("svg", { viewBox: "0 0 64 40", "aria-hidden": "true" }, svg("path", { d: outline })),
      make("strong", {}, name), make("span", {}, about)));
  const section = make("section", { class: "upload", "aria-labelledby": "upload-title" },
    make("h1", { id: "upload-title" }, "Draw a creature, get its gaits."),
    make("p", { class: "lead" }, "Physically valid motion for any articulated character, learned from its shape alone."),
    drop, problem,
    make("h2", { class: "minor" }, "Or begin with one of these"),
    make("div", { class: "specimens" }, cards));
  return section;
}
