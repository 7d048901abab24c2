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

/** Shows the job called `id`, and follows it to its end; `entitle` is told its name. Returns what ends that. */
export async function showJob(main, id, entitle) {
  const job = await api.get(`/v1/jobs/${id}`);
  entitle(job.character.name);
  const page = job.kind === "learning" ? new LearningPage(main, job) : new StudyPage(main, job);
  // What can be shown of it stays, and goes on being followed.
  page.start().catch((error) => complain(page.problem, error));
  return () => page.dispose();
}

/** What pages of jobs of every kind have: head, actions, progress, and the look at the job every second. */
class JobPage {
  constructor(main, job) {
    this.job = job;
    this.outage = make("div");
    this.problem = make("div");
    this.actions = make("div", { class: "actions" });
    this.state = make("span", { class: `state ${job.state}` });
    this.about = make("p", { class: "quiet" });
    this.progress = new ProgressCard();
    this.body = make("div", { class: "job-body" });
    main.replaceChildren(
      make("div", { class: "page-head" }, make("div", {}, make("h1", {}, job.character.name, " ", this.state), this.about), this.actions),
      this.outage, this.problem, this.progress.element, this.body);
  }

  async start() {
    this.show(this.job);
    if (api.isOver(this.job)) return;
    this.unwatch = api.watch(this.job.links.self, { seen: (job) => this.show(job), failed: (error) => this.miss(error) });
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
    if (api.isOver(job)) this.unwatch?.();
  }

  /** Says why the job cannot be looked at; with `null`, that it can be again. */
  miss(error) {
    complain(this.outage, error);
    if (error?.status !== 404) return;
    this.stop();
    this.actions.replaceChildren();
    this.state.hidden = this.progress.element.hidden = true;
  }

  showActions(job) {
    this.acted = job.state;
    const { self } = job.links;
    // `work` gives what follows it; one who has gone elsewhere meanwhile stays there.
    const act = (work) => async () => {
      complain(this.problem, null);
      try {
        const then = await work();
        if (this.body.isConnected) then?.();
      } catch (error) {
        complain(this.problem, error);
      }
    };
    const made = [];
    if (job.kind === "learning") made.push(button("Run again with changes", act(() => this.again())));
    if (["failed", "cancelled"].includes(job.state)) {
      made.push(button("Try again", act(async () => {
        await api.post(`${self}/retry`);
        return () => window.dispatchEvent(new HashChangeEvent("hashchange"));
      })));
    }
    if (!api.isOver(job)) {
      made.push(button("Cancel", act(async () => {
        const cancelled = await api.post(`${self}/cancel`);
        return () => this.show(cancelled);
      })));
    } else {
      made.push(button("Delete", act(async () => {
        if (!(await ask("Delete this job?", "Its motions, recording and report are deleted with it. This cannot be undone.", "Delete"))) return null;
        await api.remove(self);
        announce("The job is deleted.");
        return () => (location.hash = "#/");
      }), "button quiet danger"));
    }
    this.actions.replaceChildren(...made);
  }

  /** Follows the job no longer. */
  stop() {
    this.unwatch?.();
    this.unfollow?.();
  }

  dispose() {
    this.disposed = true;
    this.stop();
  }
}

class LearningPage extends JobPage {
  constructor(main, job) {
    super(main, job);
    this.curve = new Curve();
    this.following = make("p", { class: "quiet", role: "status" });
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
      make("section", { class: "card", "aria-labelledby": "curve-title" }, make("h2", { id: "curve-title" }, "Learning curve"), this.following, this.curve.element),
      this.downloads.element, this.price.element);
  }

  async start() {
    await super.start();
    this.unfollow = api.follow(this.job.links.events, {
      state: (job) => this.show(job),
      progress: ({ evaluations }) => this.progress.count(evaluations),
      generation: (figures) => {
        this.curve.add(figures);
        this.newest = this.curve.newest;
      },
      end: (job) => this.show(job),
    }, (comes) => (this.following.textContent = comes ? "" : "The service does not send the curve at present. It is asked again every ten seconds."));
    this.character = await api.characterOfJob(this.job);
    if (this.disposed) return;
    this.player = this.addPlayer();
    await this.player.load().finally(() => this.refresh());
  }

  addPlayer() {
    const player = new Player(this.character, `${this.job.character.name}. Arrow keys turn the view, plus and minus bring it nearer or farther.`);
    this.stages.append(make("div", { class: "card flush" }, player.element));
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
    this.wanted = entry.number;
    if (this.playing === entry.number) return this.player.play();
    const motion = await this.motionOf(entry);
    // Another may have been chosen meanwhile.
    if (this.wanted !== entry.number) return;
    this.playing = entry.number;
    this.shown = { name: words(entry.name), motion };
    this.player.setMotion(motion, words(entry.name));
    this.repertoire.mark(entry.number);
    this.judged.replaceChildren(verdict(entry.metrics));
    this.downloads.show(entry);
    this.price.offer();
  }

  motionOf({ number }) {
    return api.get(`${this.job.links.motions}/${number}?preliminary=true`);
  }

  /** A second view beside the first. */
  async compare(entry) {
    this.closeSecond();
    const second = this.addPlayer();
    this.second = second;
    second.element.append(button("Close", () => this.closeSecond(), "button quiet small close"));
    this.judgedSecond.replaceChildren(verdict(entry.metrics));
    this.judgedSecond.hidden = false;
    try {
      const [motion] = await Promise.all([this.motionOf(entry), second.load()]);
      if (second !== this.second) return;
      second.setMotion(motion, words(entry.name));
      this.stages.scrollIntoView({ block: "start", behavior: "smooth" });
    } catch (error) {
      if (second !== this.second) return;
      this.closeSecond();
      complain(this.problem, error);
    }
  }

  closeSecond() {
    this.second?.dispose();
    this.second?.element.parentElement.remove();
    this.second = null;
    this.judgedSecond.hidden = true;
  }

  async again() {
    this.character ??= await api.characterOfJob(this.job);
    return () => (location.hash = `#/characters/${this.character.id}?from=${this.job.id}`);
  }

  dispose() {
    super.dispose();
    this.price.dispose();
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
