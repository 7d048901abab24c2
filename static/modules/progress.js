// How far a job is: its stage, what it has tried, how many other jobs there are, and the time it will take.

import * as api from "./api.js";
import { announce, count, digits, duration, make } from "./dom.js";

const STAGES = {
  standing: "finding how it stands", learning: "learning", studying: "trying settings", checking: "checking what was learned",
};

/** How often the other jobs are counted, ms, and how many of a state at most: lists have whole jobs. */
const [COUNT_EVERY, MOST_COUNTED] = [10_000, 50];

export class ProgressCard {
  constructor() {
    this.bar = make("progress", { max: 1, value: 0, "aria-label": "Progress of the job" });
    this.headline = make("p", { class: "progress-head" });
    this.figures = make("dl", { class: "facts tight" });
    this.error = make("p", { class: "failed" });
    this.element = make("section", { class: "card progress-card", "aria-label": "Progress" }, this.headline, this.bar, this.figures, this.error);
  }

  show(job, newest) {
    const { state, stage, progress, timings } = job;
    const over = api.isOver(job);
    this.element.hidden = state === "succeeded";
    this.bar.value = progress.fraction;
    this.bar.hidden = over;
    this.error.textContent = job.error ?? "";
    const passed = timings.started ? ((over ? Date.parse(timings.ended) : Date.now()) - Date.parse(timings.started)) / 1000 : 0;
    this.headline.textContent = state === "running" ? this.doing(stage, newest) : { queued: "waiting for its turn", failed: "failed", cancelled: "cancelled", succeeded: "" }[state];
    announce(over ? `The job has ${state === "succeeded" ? "succeeded" : state}.` : `The job is ${this.headline.textContent}.`);
    const rows = {};
    this.tried = progress.evaluations;
    // Whose turn it is follows from more than the order of posting, and only the service knows.
    if (state === "queued") rows["Other jobs, waiting or running"] = this.others ?? "–";
    if (job.kind === "learning" && state !== "queued") {
      const simulated = newest?.simulated_seconds ?? progress.simulated_seconds;
      rows["Candidates tried"] = this.counted = make("span", {}, String(this.tried));
      rows.Generations = progress.generations;
      rows["Simulated so far"] = duration(simulated);
      if (passed > 1 && simulated > 0) rows["Faster than life"] = `${digits(simulated / passed, 0)}×`;
      if (newest) rows["Best fitness"] = digits(newest.best, 3);
    }
    if (state === "running") {
      rows["Time passed"] = duration(passed);
      rows["Time left"] = left(job, passed);
    }
    this.figures.replaceChildren(...Object.entries(rows).map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
    if (state === "queued") this.countOthers(job);
  }

  /** Takes note that so many candidates have been tried, between two looks at the job. */
  count(tried) {
    this.tried = Math.max(this.tried ?? 0, tried);
    if (this.counted) this.counted.textContent = String(this.tried);
  }

  doing(stage, newest) {
    if (stage === "learning" && !newest) return "trying the first generation";
    if (stage === "learning" && newest?.gait) return `learning: ${newest.gait}`;
    return STAGES[stage] ?? "starting";
  }

  async countOthers(job) {
    if (Date.now() < this.countAgain) return;
    this.countAgain = Date.now() + COUNT_EVERY;
    try {
      const lists = await Promise.all(["queued", "running"].map((state) => api.get(`/v1/jobs?state=${state}&limit=${MOST_COUNTED}`)));
      const others = lists.flatMap(({ jobs }) => jobs).filter((other) => other.id !== job.id);
      const more = lists.some(({ next }) => next !== null);
      this.others = `${more ? "at least " : ""}${count(others.length, "job")}`;
    } catch {
      this.others = null;
    }
  }
}

/** The time that is left: at most that of the budget, and as much as the pace so far makes likely. */
function left(job, passed) {
  const { fraction } = job.progress;
  if (job.stage === "checking") return "a moment";
  const budget = job.kind === "learning" ? job.learning.seconds : null;
  const { learning_seconds: learning, checking_seconds: checking } = job.timings;
  const spent = learning === null ? passed : learning + (checking ?? 0);
  const likely = fraction > 0.02 ? (passed * (1 - fraction)) / fraction : Infinity;
  const most = budget ? Math.max(budget - spent, 0) : Infinity;
  const time = Math.min(likely, most);
  return Number.isFinite(time) ? `${budget && !job.learning.generations ? "at most " : "about "}${duration(time)}` : "not known yet";
}
