// The REST interface: everything that the page does goes through it.

import { session } from "./storage.js";

/** How often a job is looked at, and how long a look may take, ms. */
const [LOOK_EVERY, LONGEST_LOOK] = [1000, 10_000];
/** So many looks in a row fail before it is told: a service that is started anew is away for a moment. */
const FAILED_LOOKS = 3;
/** How long after events were refused they are asked for again, ms. */
const FOLLOW_AGAIN = 10_000;

/** Why a call was refused: the problem document of the answer. */
export class Problem extends Error {
  constructor(status, document) {
    super(document?.detail || `the service answered ${status}`);
    this.status = status;
    this.title = document?.title;
    /** Every fault of an input: `pointer` and `detail`. */
    this.faults = document?.errors ?? [];
  }
}

async function request(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Error("The service cannot be reached.");
  }
  if (response.ok) return response;
  throw new Problem(response.status, await response.json().catch(() => null));
}

/** The JSON document at `path`; `signal` gives it up. */
export async function get(path, signal) {
  return (await request(path, { signal })).json();
}

/** The bytes at `path`. */
export async function bytes(path) {
  return (await request(path)).arrayBuffer();
}

/** The file at `path` with its media type. */
export async function file(path) {
  return (await request(path)).blob();
}

/** Sends a JSON document and gives the answer. */
export async function post(path, document) {
  const body = document === undefined ? undefined : JSON.stringify(document);
  const headers = body === undefined ? {} : { "Content-Type": "application/json" };
  return (await request(path, { method: "POST", headers, body })).json();
}

export async function remove(path) {
  await request(path, { method: "DELETE" });
}

/** Has a file checked and kept: what was understood of the character. */
export async function addCharacter(blob) {
  const body = new FormData();
  body.append("character", blob);
  return (await request("/v1/characters", { method: "POST", body })).json();
}

/**
 * The character that a job works on, kept so that it can be looked at and used again. Its digest is that of its bytes,
 * so what was found in it before still holds.
 */
export async function characterOfJob(job) {
  const known = session.get(job.character.digest);
  if (known) {
    try {
      return await get(`/v1/characters/${known}`);
    } catch (error) {
      if (error.status !== 404) throw error;
    }
  }
  const character = await addCharacter(await file(job.links.character));
  rememberCharacter(job, character.id);
  return character;
}

/** Remembers that the character of `job` is the one called `id`. */
export function rememberCharacter(job, id) {
  session.set(job.character.digest, id);
}

/** The lines of one simulation; `signal` gives it up. */
export async function simulate(scenario, signal) {
  const headers = { "Content-Type": "application/json" };
  const response = await request("/v1/simulations", { method: "POST", headers, body: JSON.stringify(scenario), signal });
  const lines = (await response.text()).trim().split("\n");
  return lines.map((line) => JSON.parse(line));
}

/**
 * Looks at the job at `path` again and again until it is over or gone. `seen` is told the job; `failed` is told why it
 * cannot be looked at, once several looks in a row have failed, and `null` when it can be again. Returns what ends it.
 */
export function watch(path, { seen, failed }) {
  let [stopped, failures, timer] = [false, 0, null];
  async function look() {
    let job;
    try {
      job = await get(path, AbortSignal.timeout(LONGEST_LOOK));
    } catch (error) {
      if (stopped) return;
      failures += 1;
      const gone = error.status === 404;
      error.title = gone ? "The job is gone" : "What is shown here is out of date";
      if (!gone) timer = setTimeout(look, LOOK_EVERY);
      if (gone || failures === FAILED_LOOKS) failed(error);
      return;
    }
    if (stopped) return;
    if (failures >= FAILED_LOOKS) failed(null);
    failures = 0;
    if (!isOver(job)) timer = setTimeout(look, LOOK_EVERY);
    seen(job);
  }
  look();
  return () => {
    stopped = true;
    clearTimeout(timer);
  };
}

/**
 * Follows a job's events: `state`, `progress`, `generation` and `end` are told to the functions of these names, and
 * `told` whether events come, whenever they are refused and whenever they come again. Returns what ends it.
 *
 * Over HTTP/1.1 a browser opens six connections to one origin, for all of its tabs together. Events therefore come only
 * while the page can be seen; when it is seen again they come anew, from the first generation on.
 */
export function follow(path, listeners, told) {
  let [events, timer, refused] = [null, null, false];
  function tell(now) {
    if (now === refused) return;
    refused = now;
    told(!refused);
  }
  function close() {
    clearTimeout(timer);
    events?.close();
  }
  function open() {
    events = new EventSource(path);
    for (const [kind, listener] of Object.entries(listeners)) {
      events.addEventListener(kind, (event) => {
        if (kind === "end") stop();
        listener(JSON.parse(event.data));
      });
    }
    events.addEventListener("open", () => tell(false));
    events.addEventListener("error", () => {
      // A connection that broke off is taken up again by the browser; what the service refused is not.
      if (events.readyState !== EventSource.CLOSED) return;
      tell(true);
      timer = setTimeout(open, FOLLOW_AGAIN);
    });
  }
  function turn() {
    close();
    if (!document.hidden) open();
  }
  function stop() {
    document.removeEventListener("visibilitychange", turn);
    close();
  }
  document.addEventListener("visibilitychange", turn);
  turn();
  return stop;
}

/** Whether nothing more happens to a job by itself. */
export function isOver(job) {
  return ["succeeded", "failed", "cancelled"].includes(job.state);
}
