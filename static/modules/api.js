// The REST interface: everything that the page does goes through it.

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

/** The JSON document at `path`. */
export async function get(path) {
  return (await request(path)).json();
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
  const known = sessionStorage.getItem(job.character.digest);
  if (known) {
    try {
      return await get(`/v1/characters/${known}`);
    } catch (error) {
      if (error.status !== 404) throw error;
    }
  }
  const character = await addCharacter(await file(job.links.character));
  sessionStorage.setItem(job.character.digest, character.id);
  return character;
}

/** The lines of one simulation. */
export async function simulate(scenario) {
  const headers = { "Content-Type": "application/json" };
  const response = await request("/v1/simulations", { method: "POST", headers, body: JSON.stringify(scenario) });
  const lines = (await response.text()).trim().split("\n");
  return lines.map((line) => JSON.parse(line));
}

/** Follows a job's events: `state`, `progress`, `generation` and `end` are told to the functions of these names. Returns what ends it. */
export function follow(path, listeners) {
  const events = new EventSource(path);
  for (const [kind, listener] of Object.entries(listeners)) {
    events.addEventListener(kind, (event) => {
      if (kind === "end") events.close();
      listener(JSON.parse(event.data));
    });
  }
  return () => events.close();
}

/** Whether nothing more happens to a job by itself. */
export function isOver(job) {
  return ["succeeded", "failed", "cancelled"].includes(job.state);
}
