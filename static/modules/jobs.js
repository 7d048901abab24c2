// The list of jobs.

import * as api from "./api.js";
import { button, complain, digits, make } from "./dom.js";

const PAGE = 10;

/** A section with the newest jobs, and a way to the older ones. */
export function jobsSection() {
  const list = make("ul", { class: "jobs" });
  const problem = make("div");
  const more = button("Older jobs", () => load(more.dataset.next));
  more.hidden = true;
  const section = make("section", { class: "card", "aria-labelledby": "jobs-title" }, make("h2", { id: "jobs-title" }, "Jobs"), list, problem, more);

  async function load(path) {
    try {
      const { jobs, next } = await api.get(path);
      list.append(...jobs.map(row));
      more.hidden = next === null;
      more.dataset.next = next ?? "";
      if (list.childElementCount === 0) list.replaceWith(make("p", { class: "quiet" }, "None so far."));
    } catch (error) {
      complain(problem, error);
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

/** What a job is about in a few words. */
export function describe(job) {
  if (job.kind === "accuracy") return "price of accuracy";
  const { task, motions } = job;
  const learned = motions.length ? motions.map((motion) => `${motion.name} ${digits(motion.speed, 1)} m/s`).join(", ") : null;
  return learned ?? (task.gait === "any" ? "every gait" : task.gait);
}
