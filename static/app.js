// The page: everything it does goes through the REST interface.

const element = (id) => document.getElementById(id);
const form = element("job");

/** The character that jobs are posted for: its check document, with its id. */
let character = null;
/** The job that is watched, and the stream of its events. */
let watched = { id: null, events: null, curve: [], look: null };

/** How often a job that runs is looked at, ms: studies and the search for a pose have no events of their own. */
const LOOK_EVERY = 1000;

/** An element with text and children; text is never taken for markup. */
function make(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

async function call(path, options) {
  const response = await fetch(path, options);
  if (response.status === 204) return null;
  const body = await response.json();
  if (response.ok) return body;
  const faults = body.errors?.map((fault) => `${fault.pointer}: ${fault.detail}`);
  throw new Error(faults?.join("\n") || body.detail || response.statusText);
}

function complain(error) {
  element("problem").textContent = error?.message ?? "";
  element("problem").hidden = !error;
}

// Character

async function check(file) {
  complain(null);
  const body = new FormData();
  body.append("character", file);
  try {
    character = await call("/v1/characters", { method: "POST", body });
  } catch (error) {
    character = null;
    complain(new Error(`${file.name}\n${error.message}`));
  }
  showCharacter(file.name);
}

function showCharacter(fileName) {
  element("check").hidden = !character;
  form.querySelector("button").disabled = !character;
  showCurl(fileName);
  if (!character) return;
  const { name, mass, links, joints, standing, notes } = character;
  const stands = standing.stable
    ? `stands ${standing.root_height.toFixed(2)} m high on ${standing.support.join(", ")}`
    : "found no pose in which it stands";
  const summary = `${mass.toFixed(2)} kg, ${links.length} links, ${joints.length} movable joints; ${stands}`;
  const list = make("ul");
  for (const note of notes) {
    const about = note.link ?? note.joint ?? note.character;
    list.append(make("li", {}, make("span", { className: "kind", textContent: note.kind }), ` ${about}: ${note.message}`));
  }
  element("check").replaceChildren(make("strong", { textContent: name }), ` — ${summary}`, list);
}

const drop = element("drop");
element("file").addEventListener("change", (event) => event.target.files[0] && check(event.target.files[0]));
drop.addEventListener("keydown", (event) => event.key === "Enter" && element("file").click());
drop.addEventListener("dragover", (event) => {
  event.preventDefault();
  drop.classList.add("over");
});
drop.addEventListener("dragleave", () => drop.classList.remove("over"));
drop.addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over");
  if (event.dataTransfer.files[0]) check(event.dataTransfer.files[0]);
});

// Job

function settings() {
  const value = (name) => form.elements[name].value;
  const number = (name) => (value(name) === "" ? undefined : Number(value(name)));
  return {
    task: { gait: value("gait") || undefined, speed: number("speed") },
    learning: { seconds: number("seconds"), generations: number("generations"), trunk: value("trunk") },
    seed: number("seed"),
  };
}

function showCurl(fileName = "robot.urdf") {
  element("curl").textContent = [
    `curl -F character=@${fileName} -F 'job=${JSON.stringify(settings())}' ${location.origin}/v1/jobs`,
    `curl -N ${location.origin}/v1/jobs/ID/events`,
    `curl -O ${location.origin}/v1/jobs/ID/recording.rrd`,
  ].join("\n");
}

form.addEventListener("input", () => showCurl(element("file").files[0]?.name));
form.addEventListener("submit", async (event) => {
  event.preventDefault();
  complain(null);
  try {
    const body = JSON.stringify({ character: { id: character.id }, ...settings() });
    const job = await call("/v1/jobs", { method: "POST", headers: { "Content-Type": "application/json" }, body });
    watch(job);
    listJobs();
  } catch (error) {
    complain(error);
  }
});

// Learning

function watch(job) {
  watched.events?.close();
  clearInterval(watched.look);
  const events = new EventSource(job.links.events);
  const look = setInterval(() => lookAt(job.links.self, look), LOOK_EVERY);
  watched = { id: job.id, events, curve: [], look };
  element("watch").hidden = false;
  element("diagram").hidden = true;
  delete element("actions").dataset.job;
  showJob(job);
  drawCurve();
  events.addEventListener("state", (event) => showJob(JSON.parse(event.data)));
  events.addEventListener("generation", (event) => {
    watched.curve.push(JSON.parse(event.data));
    requestAnimationFrame(drawCurve);
  });
  events.addEventListener("end", (event) => {
    events.close();
    clearInterval(look);
    if (watched.look === look) watched.look = null;
    showJob(JSON.parse(event.data));
    listJobs();
  });
}

/** Shows how far the watched job is; what comes after the end of `look` is old. */
async function lookAt(path, look) {
  try {
    const job = await call(path);
    if (watched.look === look) showJob(job);
  } catch {
    // The events tell of the end, and the next look may succeed.
  }
}

function showJob(job) {
  if (job.id !== watched.id) return;
  const { metrics, state } = job;
  showRow(job);
  const over = ["succeeded", "failed", "cancelled"].includes(state);
  element("status").replaceChildren(
    make("strong", { textContent: job.character.name }),
    ` — ${state}${job.stage ? `, ${job.stage}` : ""}`,
    ...(job.error ? [make("div", { className: "failed", textContent: job.error })] : []),
  );
  element("progress").value = job.progress.fraction;
  const figures = {
    Speed: metrics && `${metrics.speed.toFixed(2)} m/s`,
    Gait: metrics?.gait,
    Upright: metrics && `${metrics.upright_seconds.toFixed(0)} s`,
    "Cost of transport": metrics?.cost_of_transport?.toFixed(2),
    "Cache hits": job.cache_hit_rate != null && `${(100 * job.cache_hit_rate).toFixed(0)} %`,
    Seed: job.seed,
  };
  showRepertoire(job, over);
  for (const recommended of job.recommendations ?? []) {
    figures[`Within ${recommended.tolerance} ${job.subject.unit}`] = advice(recommended);
  }
  element("figures").replaceChildren(
    ...Object.entries(figures)
      .filter(([, figure]) => figure != null && figure !== false)
      .map(([name, figure]) => make("div", {}, make("dt", { textContent: name }), make("dd", { textContent: figure }))),
  );
  // Made anew only when something changes, or a button would vanish from under the pointer.
  const key = `${job.id} ${state}`;
  if (element("actions").dataset.job !== key) showActions(job, over);
  element("actions").dataset.job = key;
}

/** The motions learned so far; once the job has ended each can be had as a file. */
function showRepertoire(job, over) {
  const motions = job.motions ?? [];
  element("repertoire").hidden = motions.length === 0;
  const rows = motions.map(({ number, name, gait, speed, cost_of_transport, natural }) => {
    const row = make("tr");
    for (const text of [name, gait ?? "", speed.toFixed(2), cost_of_transport?.toFixed(2) ?? "", natural ? "yes" : "no"]) {
      row.append(make("td", { textContent: text }));
    }
    const place = `${job.links.motions}/${number}`;
    const file = (form, text) => make("a", { href: `${place}${form}`, textContent: text, download: `${name}${form || ".json"}` });
    row.append(make("td", {}, ...(over ? [file("", "keyframes"), " ", file(".glb", "glTF"), " ", file(".bvh", "BVH")] : [])));
    return row;
  });
  element("repertoire").querySelector("tbody").replaceChildren(...rows);
}

function showActions(job, over) {
  const { metrics, links, state } = job;
  const link = (text, href, className = "button plain") => make("a", { textContent: text, href, className });
  const actions = [];
  if (state !== "queued") {
    if (links.viewer) actions.push(link("Watch", links.viewer, "button"));
    if (links.recording) actions.push(Object.assign(link("Recording", links.recording), { download: `${job.id}.rrd` }));
  }
  if (metrics) {
    actions.push(Object.assign(link("Motion", links.motion), { download: `${job.id}.json` }));
    actions.push(link("Gait", links.gait), link("Report", links.report));
    showDiagram(links.diagram, "Which foot is on the ground when");
  }
  const studied = job.kind === "accuracy" && state === "succeeded";
  if (studied) {
    actions.push(link("Table", links.table));
    showDiagram(links.front, "What accuracy costs: error against computing time for a simulated second");
  }
  element("curve").closest("figure").hidden = job.kind === "accuracy";
  element("diagram").hidden = !metrics && !studied;
  const button = (text, act) => {
    const made = make("button", { className: "plain", textContent: text });
    made.addEventListener("click", () => act(job));
    actions.push(made);
  };
  if (["failed", "cancelled"].includes(state)) button("Try again", retry);
  if (over) button("Delete", remove);
  else button("Cancel", cancel);
  element("actions").replaceChildren(...actions);
}

function showDiagram(source, caption) {
  const image = element("diagram").querySelector("img");
  image.src = source;
  image.alt = caption;
  element("diagram").querySelector("figcaption").textContent = caption;
}

/** What a study recommends for a tolerance, in a few words. */
function advice({ accuracy, because }) {
  return accuracy ? `${accuracy.integrator.replaceAll("_", " ")}, ${1000 * accuracy.step} ms` : because;
}

async function cancel(job) {
  try {
    showJob(await call(`${job.links.self}/cancel`, { method: "POST" }));
  } catch (error) {
    complain(error);
  }
  listJobs();
}

async function retry(job) {
  try {
    watch(await call(`${job.links.self}/retry`, { method: "POST" }));
  } catch (error) {
    complain(error);
  }
  listJobs();
}

async function remove(job) {
  try {
    await call(job.links.self, { method: "DELETE" });
    element("watch").hidden = true;
  } catch (error) {
    complain(error);
  }
  listJobs();
}

/** Draws best and mean fitness over generations. */
function drawCurve() {
  const svg = element("curve");
  const [width, height, margin] = [640, 240, 36];
  const points = watched.curve;
  const draw = (tag, attributes, text = "") => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.textContent = text;
    return made;
  };
  const values = points.flatMap((point) => [point.best, point.mean]).filter((value) => value > -10);
  const [low, high] = [Math.min(0, ...values), Math.max(0.1, ...values)];
  const last = Math.max(1, points.at(-1)?.generation ?? 1);
  const x = (generation) => margin + ((width - 2 * margin) * generation) / last;
  const y = (value) => height - margin - ((height - 2 * margin) * (Math.max(low, value) - low)) / (high - low);
  const line = (key) =>
    draw("polyline", { class: key, points: points.map((point) => `${x(point.generation)},${y(point[key])}`).join(" ") });
  svg.replaceChildren(
    draw("line", { class: "axis", x1: margin, x2: width - margin, y1: y(0), y2: y(0) }),
    draw("line", { class: "axis", x1: margin, x2: margin, y1: margin, y2: height - margin }),
    draw("text", { x: 4, y: y(high) + 4 }, high.toFixed(2)),
    draw("text", { x: 4, y: y(0) + 4 }, "0"),
    draw("text", { x: width - margin, y: height - 12, "text-anchor": "end" }, `generation ${last}`),
    line("mean"),
    line("best"),
  );
  const newest = points.at(-1);
  if (newest) element("curve").setAttribute("aria-label", `Learning curve, ${newest.gait ?? "best"} ${newest.best.toFixed(2)}`);
}

// Jobs

/** The cells of a job in the list. */
function cells(job) {
  const made = [
    job.character.name,
    job.kind,
    job.state,
    job.kind === "learning" ? job.progress.generations : "",
    job.best_fitness?.toFixed(2) ?? "",
    new Date(job.timings.created).toLocaleString(),
  ].map((text) => make("td", { textContent: text }));
  made[2].className = job.state;
  return made;
}

/** Brings a job's row in the list up to date, where it has one. */
function showRow(job) {
  element("jobs").querySelector(`tr[data-job="${job.id}"]`)?.replaceChildren(...cells(job));
}

async function listJobs(path = "/v1/jobs?limit=10") {
  const page = await call(path);
  const rows = page.jobs.map((job) => {
    const row = make("tr", { tabIndex: 0 }, ...cells(job));
    row.dataset.job = job.id;
    row.addEventListener("click", () => watch(job));
    row.addEventListener("keydown", (event) => event.key === "Enter" && watch(job));
    return row;
  });
  if (path.includes("after=")) element("jobs").append(...rows);
  else element("jobs").replaceChildren(...rows);
  element("more").hidden = !page.next;
  element("more").onclick = () => listJobs(page.next).catch(complain);
}

showCurl();
listJobs().catch(complain);
