// What a job leaves behind, as files.

import * as api from "./api.js";
import { button, make } from "./dom.js";

const FORMATS = [
  ["", "Motion", "keyframes, JSON", "json"],
  [".glb", "glTF", "Blender, Unity, Unreal, Godot", "glb"],
  [".bvh", "BVH", "motion capture", "bvh"],
  [".csv", "CSV", "tables", "csv"],
  [".yaml", "ROS 2", "JointTrajectory", "yaml"],
  [".xml", "MuJoCo", "model with keyframes", "xml"],
];

/** The section of downloads; `show` names the motion whose files are offered. */
export class Downloads {
  constructor(job) {
    this.job = job;
    this.entry = null;
    this.fps = make("input", { type: "number", min: 1, max: 1000, value: 60, oninput: () => this.show(this.entry) });
    this.inPlace = make("input", { type: "checkbox", onchange: () => this.show(this.entry) });
    this.title = make("h3", {});
    this.files = make("ul", { class: "files" });
    this.others = make("ul", { class: "files" });
    this.motion = make("div", {}, this.title,
      make("div", { class: "options" },
        make("label", { class: "inline" }, "Frames per second", this.fps),
        make("label", { class: "toggle" }, this.inPlace, "In place, without travel")),
      this.files);
    this.motion.hidden = true;
    this.recording = make("div", { class: "recording" });
    this.element = make("section", { class: "card", "aria-labelledby": "downloads-title" },
      make("h2", { id: "downloads-title" }, "Downloads"), this.motion, make("h3", {}, "The whole job"), this.others, this.recording);
    this.showJob(job);
  }

  /** Offers the files of one motion of the repertoire. */
  show(entry) {
    this.entry = entry;
    this.motion.hidden = !entry;
    if (!entry) return;
    this.title.textContent = `The motion “${entry.name}”`;
    const stem = entry.file.replace(/\.json$/, "");
    this.files.replaceChildren(...FORMATS.map(([ending, name, about, extension]) => {
      const query = new URLSearchParams({ preliminary: true });
      if (ending) query.set("fps", Number(this.fps.value) || 60);
      if (this.inPlace.checked && [".glb", ".bvh", ".csv"].includes(ending)) query.set("in_place", true);
      return file(name, about, `${this.job.links.motions}/${entry.number}${ending}?${query}`, `${stem}.${extension}`);
    }));
  }

  /** Made anew only when something is added, or a link would vanish from under the pointer and the keyboard. */
  showJob(job) {
    this.job = job;
    const { links, state } = job;
    const over = api.isOver(job);
    // A job that was cancelled while it waited has left nothing.
    const begun = state !== "queued" && job.timings.started;
    // The recording of a job that runs grows, whatever became of the one before it.
    const recorded = begun && links.recording && (state === "running" || !job.storage.recording_removed);
    const there = `${state} ${Boolean(job.metrics)} ${Boolean(recorded)} ${Object.keys(links)}`;
    if (there === this.there) return;
    this.there = there;
    const name = job.character.name;
    const items = [];
    if (recorded) items.push(file("Recording", "for the Rerun viewer", links.recording, `${name}.rrd`));
    if (over && job.metrics) {
      items.push(
        file("Report", "everything about the job, JSON", links.report, `${name}-report.json`),
        file("All gaits", "glTF with every animation", `${links.motions}.glb`, `${name}.glb`),
        file("Repertoire", "all motions in figures, JSON", links.motions, `${name}-motions.json`),
        file("Gait", "footfalls in figures, JSON", links.gait, `${name}-gait.json`),
        file("Footfall diagram", "SVG", links.diagram, `${name}-gait.svg`));
    }
    if (links.curve && begun) items.push(file("Learning curve", "JSON", links.curve, `${name}-curve.json`));
    if (links.character) items.push(file("Character", "as it was posted", links.character, name));
    if (over && links.table && state === "succeeded") {
      items.push(file("Table", "every setting, JSON", links.table, `${name}-table.json`), file("Diagram", "SVG", links.front, `${name}-front.svg`));
    }
    this.others.replaceChildren(...items);
    if (recorded) this.offerViewer(links);
    else if (job.storage.recording_removed) this.recording.replaceChildren();
  }

  /** The recording in its viewer, which is large and therefore fetched only when it is wanted. */
  offerViewer({ viewer }) {
    if (this.recording.childElementCount) return;
    const show = button("Show the recording here", () => {
      show.replaceWith(make("iframe", { src: viewer, title: "The recording in the Rerun viewer", class: "viewer" }));
    });
    this.recording.append(show, make("a", { href: viewer, target: "_blank", rel: "noopener", class: "button quiet" }, "In a window of its own"));
  }
}

function file(name, about, href, download) {
  return make("li", {}, make("a", { href, download }, make("strong", {}, name), make("span", {}, about)));
}
