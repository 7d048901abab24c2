// The page of a character: how it stands, what was understood of it, and what it is to learn.

import * as api from "./api.js";
import { complain, make } from "./dom.js";
import { facts, notesSection } from "./findings.js";
import { SettingsForm } from "./settings.js";
import { Stage } from "./stage.js";

/**
 * Shows the character called `id`; the form begins with what the job `from` was asked for, where there is one. `entitle`
 * is told its name. Returns what ends it.
 */
export async function showCharacter(main, id, from, entitle) {
  const character = await api.get(`/v1/characters/${id}`);
  entitle(character.name);
  const stage = new Stage(`${character.name} in its standing pose. Arrow keys turn the view, plus and minus bring it nearer or farther.`,
    (angle) => form.dial.set(Math.round((angle * 180) / Math.PI)));
  const shapes = make("div");
  const form = new SettingsForm(character, learn, (degrees) => stage.setDirection((degrees * Math.PI) / 180));
  main.replaceChildren(
    make("div", { class: "page-head" }, make("h1", {}, character.name)),
    make("div", { class: "workbench" },
      make("div", { class: "card flush" }, stage.element, shapes, facts(character)),
      make("section", { class: "card", "aria-labelledby": "wanted" }, make("h2", { id: "wanted" }, "What it is to learn"), form.element)),
    make("section", { class: "card", "aria-labelledby": "notes-title" }, make("h2", { id: "notes-title" }, "Notes on the file"), notesSection(character)),
  );

  async function learn(document) {
    complain(form.problem, null);
    form.submit.disabled = true;
    try {
      const job = await api.post("/v1/jobs", { character: { id }, ...document });
      api.rememberCharacter(job, id);
      // One who has gone elsewhere meanwhile stays there.
      if (form.element.isConnected) location.hash = `#/jobs/${job.id}`;
    } catch (error) {
      complain(form.problem, error);
    } finally {
      form.submit.disabled = false;
    }
  }

  try {
    if (from) form.take(await api.get(`/v1/jobs/${from}`));
  } catch (error) {
    complain(form.problem, error);
  }
  try {
    stage.setCharacter(await api.bytes(`/v1/characters/${id}/standing.glb`), character.mass);
    stage.setDirection(Math.atan2(...form.dial.vector().slice(0, 2).reverse()));
  } catch (error) {
    complain(shapes, error);
  }
  return () => stage.dispose();
}
