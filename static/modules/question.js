// A question that has to be answered before something is done that cannot be undone.

import { make } from "./dom.js";

/** Asks, and gives whether the answer was `yes`. */
export function ask(title, text, yes) {
  return new Promise((resolve) => {
    const dialog = make("dialog", { "aria-labelledby": "question-title" },
      make("form", { method: "dialog" },
        make("h2", { id: "question-title" }, title),
        make("p", {}, text),
        make("div", { class: "actions" },
          make("button", { class: "button quiet", value: "no", autofocus: true }, "Keep it"),
          make("button", { class: "button danger", value: "yes" }, yes))));
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
    // Who goes elsewhere by the browser's own buttons has not said yes.
    window.addEventListener("hashchange", () => dialog.close(), { once: true });
    document.body.append(dialog);
    dialog.showModal();
  });
}
