// The page: which part of it is shown follows from the address.
//
// `#/` is where it begins, `#/characters/ID` a character and what it is to learn, `#/jobs/ID` a job.

import { complain, make } from "./modules/dom.js";
import { showCharacter } from "./modules/character.js";
import { showJob } from "./modules/job.js";
import { jobsSection } from "./modules/jobs.js";
import { uploadSection } from "./modules/upload.js";

/** What the pages with a name of their own are, in their titles. */
const KINDS = { characters: "Character", jobs: "Job" };

const main = document.getElementById("main");
/** Ends what is shown. */
let leave = null;
/** Counts what was asked for, so that what comes late is not shown over what came after it. */
let turn = 0;

function showStart(place) {
  const opened = (character) => (location.hash = `#/characters/${character.id}`);
  place.replaceChildren(uploadSection(opened), jobsSection());
  return null;
}

async function show() {
  const own = ++turn;
  leave?.();
  leave = null;
  const [path, query] = location.hash.slice(1).split("?");
  const [, room, id] = path.split("/");
  document.body.dataset.room = room || "start";
  const place = make("div", { class: "room" });
  main.replaceChildren(place);
  const kind = (id && KINDS[room]) || "Characters and jobs";
  const entitle = (...name) => {
    if (own === turn) document.title = [...name, kind, "gaitwright"].join(" · ");
  };
  entitle();
  try {
    let left = null;
    if (room === "characters" && id) left = await showCharacter(place, id, new URLSearchParams(query).get("from"), entitle);
    else if (room === "jobs" && id) left = await showJob(place, id, entitle);
    else left = showStart(place);
    if (own === turn) leave = left;
    else left?.();
  } catch (error) {
    complain(place, error);
    place.append(make("p", {}, make("a", { href: "#/" }, "Back to where it begins")));
  }
}

// A file that misses its place does not take the place of the page.
for (const kind of ["dragover", "drop"]) window.addEventListener(kind, (event) => event.preventDefault());

window.addEventListener("hashchange", () => {
  show();
  main.focus({ preventScroll: true });
  scrollTo(0, 0);
});
show();
