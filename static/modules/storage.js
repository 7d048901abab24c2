// What the page remembers by itself, in the browser's storage.

/** Texts by name in the storage called `kind`; where the browser refuses it, or has no room, for as long as the page is open. */
function storage(kind) {
  const memory = new Map();
  return {
    get(name) {
      if (memory.has(name)) return memory.get(name);
      try {
        return window[kind].getItem(name);
      } catch {
        return null;
      }
    },
    set(name, text) {
      try {
        window[kind].setItem(name, text);
        memory.delete(name);
      } catch {
        memory.set(name, text);
      }
    },
    remove(name) {
      memory.delete(name);
      try {
        window[kind].removeItem(name);
      } catch {
        // Nothing is kept there.
      }
    },
  };
}

/** What is remembered until the tab is closed. */
export const session = storage("sessionStorage");
/** What is remembered from one visit to the next. */
export const lasting = storage("localStorage");
