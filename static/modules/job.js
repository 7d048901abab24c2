// The page of a job: how far it is, its motions as they come, and everything that can be had of them.

import * as api from "./api.js";
import { announce, button, complain, make, words } from "./dom.js";
import { Curve } from "./curve.js";
import { Downloads } from "./downloads.js";
import { describe } from "./jobs.js";
import { Player } from "./player.js";
import { priceSection, studyView } from "./price.js";
import { ProgressCard } from "./progress.js";
import { ask } from "./question.js";
import { Repertoire } from "./repertoire.js";
import { verdict } from "./verdict.js";

const LOOK_EVERY = 1000;

/** Shows the job called `id`, and follows it to its end. Returns what ends that. */
export async function showJob(main, id) {
  const job = await api.get(`/v1/jobs/${id}`);
  const page = job.kind === "learning" ? new LearningPage(main, job) : new StudyPage(main, job);
  try {
    await page.start();
  } catch (error) {
    // What can be shown of it stays, and goes on being followed.
    complain(page.problem, error);
  }
  return () => page.dispose();
}

/** What pages of jobs of every kind have: head, actions, progress, and the look at the job every second. */
class JobPage {
  constructor(main, job) {
    this.job = job;
    this.problem = make("div");
    this.actions = make("div", { class: "actions" });
    this.state = make("span", { class: `state ${job.state}` });
    this.about = make("p", { class: "quiet" });
    this.progress = new ProgressCard();
    this.body = make("div", { class: "job-body" });
    main.replaceChildren(
      make("div", { class: "page-head" }, make("div", {}, make("h1", {}, job.character.name, " ", this.state), this.about), this.actions),
      this.problem, this.progress.element, this.body);
  }

  start() {
    this.show(this.job);
    if (api.isOver(this.job)) return;
    this.look = setInterval(() => api.get(this.job.links.self).then((job) => this.look && this.show(job), () => {}), LOOK_EVERY);
  }

  show(job) {
    const before = this.acted;
    this.job = job;
    this.state.className = `state ${job.state}`;
    this.state.textContent = job.state;
    this.about.textContent = describe(job);
    this.progress.show(job, this.newest);
    // Made anew only when they change, or a button would vanish from under the pointer.
    if (before !== job.state) this.showActions(job);
    if (api.isOver(job)) {
      clearInterval(this.look);
      this.look = null;
    }
  }

  showActions(job) {
    this.acted = job.state;
    const { self } = job.links;
    const act = (work) => () => {
      complain(this.problem, null);
      return work().catch((error) => complain(this.problem, error));
    };
    const made = [];
    if (job.kind === "learning") made.push(button("Run again with changes", act(() => this.again())));
    if (["failed", "cancelled"].includes(job.state)) {
      made.push(button("Try again", act(async () => {
        await api.post(`${self}/retry`);
        window.dispatchEvent(new HashChangeEvent("hashchange"));
      })));
    }
    if (!api.isOver(job)) made.push(button("Cancel", act(async () => this.show(await api.post(`${self}/cancel`)))));
    else {
      made.push(button("Delete", act(async () => {
        if (!(await ask("Delete this job?", "Its motions, recording and report are deleted with it. This cannot be undone.", "Delete"))) return;
        await api.remove(self);
        announce("The job is deleted.");
        location.hash = "#/";
      }), "button quiet danger"));
    }
    this.actions.replaceChildren(...made);
  }

  dispose() {
    clearInterval(this.look);
    this.look = null;
  }
}

class LearningPage extends JobPage {
  constructor(main, job) {
    super(main, job);
    this.curve = new Curve();
    this.downloads = new Downloads(job);
    this.repertoire = new Repertoire(job, { choose: (entry) => this.choose(entry), compare: (entry) => this.compare(entry) });
    this.price = priceSection(job, () => this.shown);
    this.stages = make("div", { class: "stages" });
    this.judged = make("section", { class: "card", "aria-label": "Verdict" }, make("p", { class: "quiet" }, "The first motion appears here as soon as it is learned."));
    this.judgedSecond = make("section", { class: "card", "aria-label": "Verdict on the second motion" });
    this.judgedSecond.hidden = true;
    this.body.append(
      make("div", { class: "workbench" }, this.stages, this.judged, this.judgedSecond),
      this.repertoire.element,
      make("section", { class: "card", "aria-labelledby": "curve-title" }, make("h2", { id: "curve-title" }, "Learning curve"), this.curve.element),
      this.downloads.element, this.price.element);
  }

  async start() {
    super.start();
    this.stop = api.follow(this.job.links.events, {
      state: (job) => this.show(job),
      progress: ({ evaluations }) => this.progress.count(evaluations),
      generation: (figures) => {
        this.newest = figures;
        this.curve.add(figures);
      },
      end: (job) => this.show(job),
    });
    this.character = await api.characterOfJob(this.job);
    this.player = await this.addPlayer();
    await this.refresh();
  }

  async addPlayer() {
    const player = new Player(this.character, `${this.job.character.name}. Arrow keys turn the view, plus and minus bring it nearer or farther.`);
    this.stages.append(make("div", { class: "card flush" }, player.element));
    await player.load();
    return player;
  }

  show(job) {
    super.show(job);
    this.downloads.showJob(job);
    const learned = job.motions.length;
    if (learned !== this.learned || api.isOver(job) !== this.over) {
      [this.learned, this.over] = [learned, api.isOver(job)];
      this.refresh();
    }
    if (this.over && learned === 0) this.judged.hidden = true;
  }

  /** Fetches the repertoire when it has grown, and plays the best of it until somebody has chosen. */
  async refresh() {
    if (!this.player || !this.learned) return;
    try {
      const best = await this.repertoire.refresh();
      if (best && !this.chosen && best.number !== this.playing) await this.play(best);
    } catch (error) {
      // The job knows of a motion a moment before its file is there.
      if (error.status !== 409) complain(this.problem, error);
    }
  }

  choose(entry) {
    this.chosen = true;
    return this.play(entry).catch((error) => complain(this.problem, error));
  }

  async play(entry) {
    if (this.playing === entry.number) return this.player.play();
    this.playing = entry.number;
    const motion = await api.get(`${this.job.links.motions}/${entry.number}?preliminary=true`);
    this.shown = { name: words(entry.name), motion };
    this.player.setMotion(motion, words(entry.name));
    this.repertoire.mark(entry.number);
    this.judged.replaceChildren(verdict(entry.metrics));
    this.downloads.show(entry);
    this.price.offer();
  }

  /** A second view beside the first. */
  async compare(entry) {
    try {
      this.closeSecond();
      this.second = await this.addPlayer();
      this.second.element.append(button("Close", () => this.closeSecond(), "button quiet small close"));
      this.judgedSecond.replaceChildren(verdict(entry.metrics));
      this.judgedSecond.hidden = false;
      this.second.setMotion(await api.get(`${this.job.links.motions}/${entry.number}?preliminary=true`), words(entry.name));
      this.stages.scrollIntoView({ block: "start", behavior: "smooth" });
    } catch (error) {
      complain(this.problem, error);
    }
  }

  closeSecond() {
    this.second?.dispose();
    this.second = null;
    this.stages.children[1]?.remove();
    this.judgedSecond.hidden = true;
  }

  async again() {
    this.character ??= await api.characterOfJob(this.job);
    location.hash = `#/characters/${this.character.id}?from=${this.job.id}`;
  }

  dispose() {
    super.dispose();
    this.stop?.();
    this.player?.dispose();
    this.closeSecond();
  }
}

class StudyPage extends JobPage {
  constructor(main, job) {
    super(main, job);
    this.result = make("section", { class: "card", "aria-label": "Result" });
    this.downloads = new Downloads(job);
    this.body.append(this.result, this.downloads.element);
  }

  show(job) {
    super.show(job);
    this.result.replaceChildren(studyView(job));
    this.downloads.showJob(job);
  }
}
