// The list of jobs.

import * as api from "./api.js";
import { button, complain, digits, make } from "./dom.js";

const PAGE = 10;

/** A section with the newest jobs, and a way to the older ones. */
export function jobsSection() {
  const list = make("ul", { class: "jobs" });
  const problem = make("div");
  const none = make("p", { class: "quiet" }, "None so far.");
  const more = button("Older jobs", () => load(more.dataset.next));
  none.hidden = more.hidden = true;
  const section = make("section", { class: "card", "aria-labelledby": "jobs-title" }, make("h2", { id: "jobs-title" }, "Jobs"), list, none, problem, more);
  let loading = false;

  async function load(path) {
    // The same page is not appended twice.
    if (loading) return;
    loading = true;
    complain(problem, null);
    try {
      const { jobs, unreadable, next } = await api.get(path);
      // Ids fall from the newest to the oldest.
      const all = [...jobs, ...unreadable].sort((a, b) => (a.id < b.id ? 1 : -1));
      list.append(...all.map((job) => (job.state ? row(job) : unreadableRow(job))));
      more.hidden = next === null;
      more.dataset.next = next ?? "";
      none.hidden = list.childElementCount > 0;
    } catch (error) {
      complain(problem, error);
    } finally {
      loading = false;
    }
  }
  load(`/v1/jobs?limit=${PAGE}`);
  return section;
}

function row(job) {
  return make("li", {}, make("a", { class: "job", href: `#/jobs/${job.id}` },
    make("span", { class: "job-name" }, job.character.name, make("small", {}, describe(job))),
    make("span", { class: `state ${job.state}` }, job.state),
    make("time", { dateTime: job.timings.created }, new Date(job.timings.created).toLocaleString())));
}

/** A job of which nothing can be shown but why not. */
function unreadableRow({ id, reason }) {
  return make("li", {}, make("div", { class: "job" },
    make("span", { class: "job-name" }, id, make("small", {}, reason)),
    make("span", { class: "state" }, "unreadable")));
}

/** What a job is about in a few words. */
export function describe(job) {
  if (job.kind === "accuracy") return "price of accuracy";
  const { task, motions } = job;
  const learned = motions.length ? motions.map((motion) => `${motion.name} ${digits(motion.speed, 1)} m/s`).join(", ") : null;
  return learned ?? (task.gait === "any" ? "every gait" : task.gait);
}
