// The price of accuracy: what a smaller error costs for this character's motion, as a study of its own.

import * as api from "./api.js";
import { button, complain, digits, make, short, words } from "./dom.js";
import { lasting } from "./storage.js";

/** Length of what is studied, s: the way from standing into the first steps. */
const STUDIED = 1;

/** The section for the motion of `job` that `shown()` gives, as `{ name, motion }`. `offer` when there is one, `dispose` ends it. */
export function priceSection(job, shown) {
  const problem = make("div");
  const result = make("div");
  /** Where this page keeps which study was made last, and of which motion. */
  const kept = `price:${job.id}`;
  let stop = null;
  const start = button("Measure it for this motion", measure);
  start.hidden = true;
  const section = make("section", { class: "card", "aria-labelledby": "price-title" },
    make("h2", { id: "price-title" }, "The price of accuracy"),
    make("p", { class: "quiet" }, "One second of the motion, simulated with many settings: how large is the error, and what does it cost in computing time?"),
    start, result, problem);

  async function measure() {
    complain(problem, null);
    start.disabled = true;
    try {
      const { name, motion } = shown();
      const { id } = await api.characterOfJob(job);
      const { preliminary, ...document } = motion;
      const scenario = { character: { id }, scene: document.scene, drive: { kind: "track", motion: document }, duration: STUDIED };
      const path = (await api.post("/v1/accuracy", { scenario })).links.self;
      lasting.set(kept, JSON.stringify({ path, name }));
      if (section.isConnected) watch(path, name);
    } catch (error) {
      start.disabled = false;
      complain(problem, error);
    }
  }

  /** Shows a study until it is over. */
  function watch(path, name) {
    start.disabled = true;
    stop = api.watch(path, {
      seen(study) {
        result.replaceChildren(make("h3", {}, `Of the motion “${name}”`), studyView(study));
        start.disabled = !api.isOver(study);
      },
      failed(error) {
        complain(problem, error);
        if (error?.status !== 404) return;
        // It has been deleted.
        lasting.remove(kept);
        start.disabled = false;
      },
    });
  }

  const last = JSON.parse(lasting.get(kept) ?? "null");
  if (last) watch(last.path, last.name);
  return { element: section, offer: () => (start.hidden = !shown()), dispose: () => stop?.() };
}

/** How far a study is, and what came of it. */
export function studyView(study) {
  const { state, progress, links, error } = study;
  if (!api.isOver(study)) {
    return make("div", {}, make("p", {}, state === "queued" ? "The study waits for its turn." : `Trying settings: ${digits(100 * progress.fraction, 0)} %`),
      make("progress", { max: 1, value: progress.fraction, "aria-label": "Progress of the study" }));
  }
  if (state !== "succeeded") return make("p", { class: "failed" }, error ?? `The study was ${state}.`);
  const { unit } = study.subject;
  const rows = study.recommendations.map(({ tolerance, accuracy, error: found, seconds, because }) =>
    make("tr", {}, make("th", { scope: "row" }, `${tolerance} ${unit}`), ...(accuracy
      ? [`${words(accuracy.integrator)}, step ${short(1000 * accuracy.step)} ms`, `${short(found)} ${unit}`, `${short(1000 * seconds)} ms`].map((text) => make("td", {}, text))
      : [make("td", { colSpan: 3 }, because)])));
  return make("div", {},
    make("figure", { class: "paper" }, make("img", { src: links.front, alt: "Error against computing time for each setting; the text below names the best ones" })),
    make("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Recommendations" }, make("table", {},
      make("thead", {}, make("tr", {}, ["Error below", "Cheapest setting", "Its error", "Computing a second takes"].map((title) => make("th", { scope: "col" }, title)))),
      make("tbody", {}, rows))));
}
