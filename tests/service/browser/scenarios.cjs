// What people do on the page, done by a browser: `scenarios.cjs SCENARIO ADDRESS EXAMPLES FOLDER`.

const assert = require("node:assert/strict");
const { execFileSync } = require("node:child_process");
const { readFileSync, writeFileSync } = require("node:fs");
const path = require("node:path");
const { chromium } = require("playwright-core");
const { contrasts, inksOf, stillInks } = require("./seen.cjs");

const [scenario, address, examples, folder] = process.argv.slice(2);
/** Longest first load, bytes, without the viewer of recordings. */
const FIRST_LOAD = 300_000;
/** Longest time that anything may take, ms: training too, on a machine that has much else to do. */
const TRAINING = 300_000;
const JOB = { task: { gait: "trot", speed: 0.9 }, learning: { generations: 12 }, seed: 7 };

/** Starts the browser; `faults` gathers everything that a page does wrong. */
async function start() {
  const executablePath = execFileSync("which", ["chromium"]).toString().trim();
  const browser = await chromium.launch({ executablePath, args: ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
  const faults = [];
  const loaded = new Map();
  const open = async (options = {}) => {
    const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, acceptDownloads: true, ...options });
    const page = await context.newPage();
    page.setDefaultTimeout(TRAINING);
    page.on("console", (message) => message.type() === "error" && faults.push(`console: ${message.text()}`));
    page.on("pageerror", (error) => faults.push(`uncaught: ${error.stack}`));
    page.on("request", (request) => {
      const url = new URL(request.url());
      if (/^http/.test(url.protocol) && url.origin !== new URL(address).origin) faults.push(`elsewhere: ${url}`);
      if (url.pathname.includes("null") || url.pathname.includes("undefined")) faults.push(`senseless: ${url}`);
    });
    // What is wrong on purpose is answered with a problem, and the browser logs that.
    page.on("response", async (response) => {
      loaded.set(response.url(), (await response.body().catch(() => "")).length);
      if (response.status() >= 400) faults.push(`${response.status()}: ${response.url()}`);
    });
    return page;
  };
  return { browser, open, faults, loaded };
}

async function picture(page, name) {
  if (process.env.SCREENSHOTS) await page.screenshot({ path: path.join(process.env.SCREENSHOTS, `${name}.png`) });
}

/** Posts a job from the page, as others do from elsewhere, and gives its id once it has ended. */
async function trained(page, job = JOB) {
  const urdf = readFileSync(path.join(examples, "quadruped.urdf"), "utf8");
  const { id } = await page.evaluate(async (body) => {
    const headers = { "Content-Type": "application/json" };
    return (await fetch("/v1/jobs", { method: "POST", headers, body: JSON.stringify(body) })).json();
  }, { character: { urdf }, ...job });
  const look = (id) => page.evaluate(async (id) => (await (await fetch(`/v1/jobs/${id}`)).json()).state, id);
  for (const since = Date.now(); !["succeeded", "failed"].includes(await look(id)); ) {
    assert.ok(Date.now() - since < TRAINING, "the training takes too long");
    await page.waitForTimeout(200);
  }
  assert.equal(await look(id), "succeeded");
  return id;
}

const clockOf = async (page) => parseFloat(await page.locator(".clock").first().innerText());

async function train({ open, faults, loaded }) {
  const page = await open();
  await page.goto(address);
  await page.getByRole("heading", { name: "Draw a creature, get its gaits." }).waitFor();
  await page.waitForLoadState("networkidle");
  const bytes = [...loaded].filter(([url]) => !url.includes("/v1/")).reduce((sum, [, size]) => sum + size, 0);
  assert.ok(bytes > 50_000 && bytes < FIRST_LOAD, `the first load has ${bytes} bytes`);
  await page.getByText("None so far.").waitFor();
  assert.equal(await page.title(), "Characters and jobs · gaitwright");
  assert.equal(await page.getByRole("button", { name: "Older jobs" }).count(), 0, "there are no older jobs");

  // A file that cannot be used is named where it was dropped.
  const broken = path.join(folder, "broken.urdf");
  writeFileSync(broken, '<robot name="x"><link name="a"/><joint name="j" type="screw"/></robot>');
  await page.locator("#file").setInputFiles(broken);
  const alert = page.locator(".upload").getByRole("alert");
  await alert.waitFor();
  assert.match(await alert.innerText(), /broken\.urdf cannot be used[\s\S]*joint "j"/);
  assert.ok(faults.every((fault) => fault.includes("422")), faults.join("\n"));
  faults.length = 0;

  // At once it stands there, with what was understood.
  await page.locator("#file").setInputFiles(path.join(examples, "quadruped.urdf"));
  await page.waitForURL(/#\/characters\//);
  await page.getByText("12.00 kg").waitFor();
  assert.equal(await page.title(), "quadruped · Character · gaitwright");
  await page.waitForLoadState("networkidle");
  const canvas = page.locator("canvas").first();
  const standing = await inksOf(page, canvas);
  assert.ok(standing.colors > 200, `the view has ${standing.colors} colors`);

  // What it is to learn: the arrow is dragged to the left.
  const dial = page.getByRole("slider", { name: "Direction of travel" });
  const box = await dial.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + 15);
  await page.mouse.down();
  await page.mouse.move(box.x + 10, box.y + box.height / 2, { steps: 5 });
  await page.mouse.up();
  assert.equal(await dial.getAttribute("aria-valuenow"), "90");
  const turned = await inksOf(page, canvas);
  assert.notEqual(turned.digest, standing.digest, "the arrow on the ground follows the dial");

  // The arrow itself is dragged as well, and the view stays as it is.
  const place = await canvas.boundingBox();
  const taken = { x: place.x + turned.green.x, y: place.y + turned.green.y };
  assert.ok(turned.green.count > 200, `the arrow has ${turned.green.count} pixels`);
  await page.mouse.move(taken.x, taken.y);
  await page.mouse.down();
  await page.mouse.move(taken.x - 60, taken.y + 40, { steps: 5 });
  await page.mouse.up();
  const dragged = Number(await dial.getAttribute("aria-valuenow"));
  assert.ok(Math.abs(dragged - 90) > 10, `the dial follows the arrow: ${dragged}`);
  const aimed = (await inksOf(page, canvas)).green;
  assert.ok(Math.hypot(aimed.x - turned.green.x + 60, aimed.y - turned.green.y - 40) < 60, `the arrow is at ${aimed.x}, ${aimed.y}`);
  await dial.focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowLeft");
  await page.getByRole("combobox", { name: "Gait", exact: true }).selectOption("trot");
  await page.getByRole("combobox", { name: "Speed", exact: true }).selectOption("number");
  await page.getByLabel("Speed, m/s").fill("0.9");
  await page.getByLabel("Seed").fill("7");
  await page.getByText("Budget, accuracy and effects").click();
  await page.getByLabel("Generations at most").fill("12");
  await page.getByRole("combobox", { name: "Friction in joints" }).selectOption("off");
  await picture(page, "character");
  await page.getByRole("button", { name: "Learn to move" }).click();
  await page.waitForURL(/#\/jobs\//);

  // Watched from the first second to the end.
  await page.getByText("Candidates tried", { exact: true }).waitFor();
  await page.getByText("Generations", { exact: true }).waitFor();
  await page.locator(".curve .line.best").waitFor({ state: "attached" });
  await page.locator(".state.succeeded").waitFor();
  await page.locator(".motion.chosen").waitFor();
  const id = page.url().split("/").at(-1);
  const job = await page.evaluate(async (id) => (await fetch(`/v1/jobs/${id}`)).json(), id);
  assert.deepEqual([job.task.gait, job.task.speed, job.seed], ["trot", 0.9, 7]);
  assert.ok(Math.abs(Math.atan2(job.task.direction[1], job.task.direction[0]) - (5 * Math.PI) / 180) < 1e-6, "5° to the left");
  assert.equal(job.scene.effects.joint_friction, "off");
  assert.equal((await page.locator(".curve .line.best").getAttribute("points")).split(" ").length, 12);

  // Played, paused, gone through by hand.
  await page.getByRole("button", { name: "Pause" }).waitFor();
  const playing = await inksOf(page, canvas);
  await page.waitForTimeout(300);
  assert.notEqual((await inksOf(page, canvas)).digest, playing.digest, "it moves");
  await page.getByRole("button", { name: "Pause" }).click();
  const paused = await stillInks(page, canvas);
  const scrub = page.getByRole("slider", { name: "Time in the motion" });
  await scrub.fill("0.1");
  assert.equal(await clockOf(page), 0.1);
  await page.waitForTimeout(200);
  const at = await inksOf(page, canvas);
  assert.notEqual(at.digest, paused.digest);
  await page.getByLabel("Ghost of the targets").check();
  await page.waitForTimeout(200);
  assert.notEqual((await inksOf(page, canvas)).digest, at.digest, "the ghost is seen");
  await page.getByLabel("Simulate from standing, with contact forces").check();
  await page.waitForFunction(() => Number(document.querySelector(".scrub").max) > 3);
  // A trot that is not natural yet may be in the air at one time or another, but not for the whole of a stride.
  const forces = [];
  for (const time of ["0", "2", "2.04", "2.08", "2.12", "2.16", "2.2"]) {
    await scrub.fill(time);
    await page.waitForTimeout(200);
    forces.push((await inksOf(page, canvas)).red);
  }
  const [before, ...stride] = forces;
  assert.ok(before < 10 && Math.max(...stride) > 200, `red pixels before the first step and in the trot: ${forces}`);
  await picture(page, "forces");
  await page.getByLabel("Simulate from standing, with contact forces").uncheck();

  // Everything can be had as a file.
  const links = await page.locator(".files a").evaluateAll((all) => all.map((link) => [link.querySelector("strong").textContent, link.href]));
  const starts = { Motion: "{", glTF: "glTF", BVH: "HIERARCHY", CSV: "", "ROS 2": "", MuJoCo: "<", Recording: "RRF", "All gaits": "glTF", Report: "{", Repertoire: "{",
    Gait: "{", "Footfall diagram": "<svg", "Learning curve": "{", Character: "<?xml" };
  assert.deepEqual(links.map(([name]) => name).sort(), Object.keys(starts).sort());
  for (const [name, href] of links) {
    const found = await page.evaluate(async (href) => {
      const answer = await fetch(href);
      return [answer.status, new TextDecoder("latin1").decode(new Uint8Array(await answer.arrayBuffer()).slice(0, 200))];
    }, href);
    assert.equal(found[0], 200, name);
    assert.ok(found[1].length > 20 && found[1].trimStart().startsWith(starts[name]), `${name}: ${found[1]}`);
  }
  await page.getByLabel("Frames per second").fill("30");
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /^glTF/ }).click()]);
  assert.equal(download.suggestedFilename(), "1-trot.glb");
  assert.match(download.url(), /fps=30/);

  // Two side by side.
  await page.getByRole("button", { name: "Compare" }).click();
  await page.locator("canvas").nth(1).waitFor();
  await page.waitForFunction(() => [...document.querySelectorAll(".player-title")].map((title) => title.textContent).join() === "trot,trot");
  await page.getByRole("button", { name: "Close" }).click();
  assert.equal(await page.locator("canvas").count(), 1);
  // Whoever asks twice has one more, not two.
  await page.getByRole("button", { name: "Compare" }).dblclick();
  await page.waitForFunction(() => [...document.querySelectorAll(".player-title")].map((title) => title.textContent).join() === "trot,trot");
  assert.equal(await page.locator("canvas").count(), 2);
  await page.getByRole("button", { name: "Close" }).click();
  assert.equal(await page.locator("canvas").count(), 1);

  // A browser that lets no page keep anything shows it all the same.
  const shy = await open();
  await shy.addInitScript(() => {
    for (const name of ["localStorage", "sessionStorage"]) {
      Object.defineProperty(window, name, { get: () => { throw new DOMException("refused", "SecurityError"); } });
    }
  });
  await shy.goto(page.url());
  await shy.locator(".motion.chosen").waitFor();
  assert.equal(await shy.title(), "quadruped · Job · gaitwright");
  await shy.close();

  // Its link leads to it again; it is run again with changes; it is deleted once the question is answered.
  await page.reload();
  await page.locator(".motion.chosen").waitFor();
  await page.getByRole("button", { name: "Run again with changes" }).click();
  await page.waitForURL(/characters\/.*from=/);
  await page.waitForFunction(() => document.querySelector("select[name=gait]")?.value === "trot");
  assert.equal(await page.getByLabel("Speed, m/s").inputValue(), "0.9");
  assert.equal(await page.getByRole("slider", { name: "Direction of travel" }).getAttribute("aria-valuenow"), "5");
  await page.getByText("Budget, accuracy and effects").click();
  assert.equal(await page.getByRole("combobox", { name: "Friction in joints" }).inputValue(), "off");

  // It waits behind another, and both are cancelled.
  const post = async () => (await (await fetch("/v1/jobs", { method: "POST", headers: { "Content-Type": "application/xml" },
    body: await (await fetch("/characters/quadruped.urdf")).text() })).json()).links.self;
  const other = await page.evaluate(post);
  await page.getByRole("button", { name: "Learn to move" }).click();
  await page.waitForURL(/#\/jobs\//);
  await page.locator(".state.queued").waitFor();
  await page.getByText("1 job", { exact: true }).waitFor();

  // A service that does not answer is told, and when it does again that is gone.
  assert.deepEqual(faults, []);
  await page.route("**/v1/jobs/*", (route) => route.abort());
  await page.getByText("What is shown here is out of date").waitFor();
  await page.unroute("**/v1/jobs/*");
  await page.getByText("What is shown here is out of date").waitFor({ state: "detached" });
  faults.length = 0;
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByRole("button", { name: "Try again" }).waitFor();
  const waited = page.url().split("/").at(-1);
  await page.evaluate((path) => fetch(`${path}/cancel`, { method: "POST" }), other);
  await page.goto(`${address}#${other.replace("/v1", "")}`);
  await page.locator(".state.cancelled").waitFor();
  await page.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Delete" }).click();
  await page.locator(".job").first().waitFor();
  assert.equal(await page.evaluate(async (id) => (await fetch(`/v1/jobs/${id}`, { method: "DELETE" })).status, waited), 204);

  await page.goto(`${address}#/jobs/${id}`);
  await page.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("button", { name: "Keep it" }).click();
  await page.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Delete" }).click();
  await page.getByText("None so far.").waitFor();
  assert.deepEqual(faults, []);
  assert.equal(await page.evaluate(async (id) => (await fetch(`/v1/jobs/${id}`)).status, id), 404);
  faults.length = 0;
}

/** Presses Tab until `found` is true of the element with the focus. */
async function tabTo(page, what, found) {
  for (let presses = 0; presses < 80; presses += 1) {
    await page.keyboard.press("Tab");
    if (await page.evaluate(found)) return;
  }
  assert.fail(`Tab never reaches ${what}`);
}

async function keyboard({ open, faults }) {
  const page = await open();
  await page.goto(address);
  await page.getByRole("button", { name: /Quadruped/ }).waitFor();
  await tabTo(page, "the file", () => document.activeElement.id === "file");
  await tabTo(page, "the quadruped", () => document.activeElement.textContent.startsWith("Quadruped"));
  await page.keyboard.press("Enter");
  await page.waitForURL(/#\/characters\//);
  await page.getByText("12.00 kg").waitFor();
  await page.waitForLoadState("networkidle");
  await tabTo(page, "the view", () => document.activeElement.tagName === "CANVAS");
  const before = await inksOf(page, page.locator("canvas"));
  let seen = before;
  for (let turns = 0; turns < 8; turns += 1) {
    await page.keyboard.press("ArrowLeft");
    await page.waitForTimeout(200);
    const now = await inksOf(page, page.locator("canvas"));
    assert.notEqual(now.digest, seen.digest, "keys turn the view");
    assert.ok(now.shade > 1500, `the shadow has ${now.shade} pixels after ${turns + 1} turns`);
    seen = now;
  }
  await tabTo(page, "the direction", () => document.activeElement.getAttribute("aria-label") === "Direction of travel");
  await page.keyboard.press("ArrowRight");
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute("aria-valuetext")), "5° to the right");
  await page.keyboard.press("Home");
  await tabTo(page, "the gait", () => document.activeElement.name === "gait");
  await page.keyboard.type("trot");
  await tabTo(page, "the details", () => document.activeElement.tagName === "SUMMARY");
  await page.keyboard.press("Enter");
  await tabTo(page, "the generations", () => document.activeElement.name === "generations");
  await page.keyboard.type("12");
  await tabTo(page, "the button", () => document.activeElement.textContent === "Learn to move");
  await page.keyboard.press("Enter");
  await page.waitForURL(/#\/jobs\//);
  await page.locator(".state.succeeded").waitFor();
  assert.match(await page.locator("#announcer").textContent(), /succeeded/);
  await page.getByRole("button", { name: "Pause" }).waitFor();
  await tabTo(page, "the player", () => document.activeElement.textContent === "Pause");
  await page.keyboard.press("Space");
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "Play");
  await tabTo(page, "the time", () => document.activeElement.className === "scrub");
  await page.keyboard.press("Home");
  assert.equal(await clockOf(page), 0);
  await page.keyboard.press("ArrowRight");
  assert.ok((await clockOf(page)) > 0);
  await page.locator("#skip").focus();
  await tabTo(page, "the deletion", () => document.activeElement.textContent === "Delete");
  await page.keyboard.press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "Keep it");
  await page.keyboard.press("Escape");
  assert.equal(await page.getByRole("dialog").count(), 0);
  await tabTo(page, "the deletion", () => document.activeElement.textContent === "Delete");
  await page.keyboard.press("Enter");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await page.getByText("None so far.").waitFor();
  assert.deepEqual(faults, []);
}

async function looks({ open, faults }) {
  const first = await open();
  await first.goto(address);
  const id = await trained(first);
  const grounds = new Set();
  for (const colorScheme of ["light", "dark"]) {
    for (const [width, height] of [[1280, 900], [375, 812]]) {
      const page = await open({ colorScheme, viewport: { width, height } });
      for (const [room, ready] of [["", ".job"], ["character", ".dial"], [`jobs/${id}`, ".motion.chosen .footfalls"]]) {
        if (room === "character") await page.getByRole("button", { name: /Hexapod/ }).click();
        else await page.goto(`${address}#/${room}`);
        await page.locator(ready).first().waitFor();
        await page.waitForLoadState("networkidle");
        await page.locator("details").evaluateAll((all) => all.forEach((one) => (one.open = true)));
        const where = `${colorScheme}, ${width} px, ${room || "start"}`;
        assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), width, `${where} is wider than the screen`);
        const beyond = await page.evaluate(() => [...document.querySelectorAll("main :is(button, input, select, a)")]
          .filter((one) => one.checkVisibility() && one.getBoundingClientRect().right > innerWidth + 0.5).map((one) => one.outerHTML));
        assert.deepEqual(beyond, [], where);
        const poor = await contrasts(page);
        assert.deepEqual(poor, [], `${where}: too little contrast`);
        grounds.add(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
        await page.locator("details").evaluateAll((all) => all.forEach((one) => (one.open = false)));
        await picture(page, `${room.split("/")[0] || "start"}-${colorScheme}-${width}`);
      }
      await page.context().close();
    }
  }
  assert.equal(grounds.size, 2, "dark and light differ");
  assert.deepEqual(faults, []);
}

/** A zip of the quadruped with a mesh for its trunk: bytes. */
function zipped() {
  const zip = path.join(folder, "dog.zip");
  const program = `
import struct, sys, zipfile
urdf = open(sys.argv[1]).read()
visual = urdf.index("<geometry>", urdf.index("<visual"))
urdf = urdf[:visual] + '<geometry><mesh filename="package://dog/meshes/trunk.stl"/>' + urdf[urdf.index("</geometry>", visual):]
tip, ring = (0.3, 0, 0), [(-0.2, 0.1, 0.1), (-0.2, -0.1, 0.1), (-0.2, -0.1, -0.1), (-0.2, 0.1, -0.1)]
faces = [(tip, ring[k], ring[(k + 1) % 4]) for k in range(4)] + [(ring[0], ring[2], ring[1]), (ring[0], ring[3], ring[2])]
mesh = bytes(80) + struct.pack("<I", len(faces))
mesh += b"".join(struct.pack("<12fH", 0, 0, 0, *a, *b, *c, 0) for a, b, c in faces)
with zipfile.ZipFile(sys.argv[2], "w") as packed:
    packed.writestr("dog/urdf/dog.urdf", urdf)
    packed.writestr("dog/meshes/trunk.stl", mesh)
`;
  execFileSync("python3", ["-c", program, path.join(examples, "quadruped.urdf"), zip]);
  return readFileSync(zip);
}

/** Files that are dropped: beside the place for them, and on it. */
async function drop({ open, faults }) {
  const page = await open({ colorScheme: "dark" });
  await page.goto(address);
  const transfer = await page.evaluateHandle((bytes) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([new Uint8Array(bytes)], "dog.zip", { type: "application/zip" }));
    return transfer;
  }, [...zipped()]);
  const kept = await page.evaluate((dataTransfer) => ["dragover", "drop"].every((kind) =>
    !document.querySelector("h1").dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }))), transfer);
  assert.ok(kept, "a file that misses its place would be opened by the browser");
  const place = page.locator(".drop");
  await place.dispatchEvent("dragover", { dataTransfer: transfer });
  assert.equal(await page.locator(".drop.over").count(), 1);
  await place.dispatchEvent("drop", { dataTransfer: transfer });
  await page.waitForURL(/#\/characters\//);
  await page.getByText("12.00 kg").waitFor();
  await page.waitForLoadState("networkidle");
  const { colors } = await inksOf(page, page.locator("canvas"));
  assert.ok(colors > 100, `the view has ${colors} colors`);
  // The mesh is what is shown, and not the box that was there before.
  const meshes = await page.evaluate(async () => {
    const id = location.hash.split("/").pop();
    const glb = await (await fetch(`/v1/characters/${id}/standing.glb`)).arrayBuffer();
    const length = new DataView(glb).getUint32(12, true);
    const document = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, length)));
    return document.meshes.flatMap((mesh) => mesh.primitives.map(({ attributes }) => document.accessors[attributes.POSITION].count));
  });
  assert.ok(meshes.includes(18), `a mesh of six triangles is among ${meshes}`);
  await picture(page, "dropped");
  assert.deepEqual(faults, []);
}

async function study({ open, faults }) {
  const page = await open();
  await page.goto(address);
  const urdf = readFileSync(path.join(examples, "quadruped.urdf"), "utf8");
  const id = await page.evaluate(async (urdf) => {
    const scenario = { character: { urdf }, scene: { ground: null, gravity: [0, 0, 0] }, drive: { kind: "hold", joints: { LF_knee: 0.1 } }, duration: 0.02 };
    const body = JSON.stringify({ scenario, tolerances: [1e-2] });
    const answer = await fetch("/v1/accuracy", { method: "POST", headers: { "Content-Type": "application/json" }, body });
    return (await answer.json()).id;
  }, urdf);
  await page.goto(`${address}#/jobs/${id}`);
  await page.locator(".paper img").waitFor();
  await page.waitForFunction(() => document.querySelector(".paper img").naturalWidth > 100);
  await page.getByRole("row", { name: /^0.01 m/ }).waitFor();

  // The viewer shows the recording, and its analytics stay where they are: whatever asks elsewhere is a fault.
  const job = await trained(page, { ...JOB, learning: { generations: 1 } }).catch(() => null) ?? (await trained(page));
  await page.goto(`${address}#/jobs/${job}`);
  await page.getByRole("button", { name: "Show the recording here" }).click();
  const viewer = page.frameLocator("iframe");
  await viewer.locator("canvas").waitFor();
  await viewer.locator("#message").waitFor({ state: "detached" });
  await page.waitForTimeout(3000);
  assert.deepEqual(faults, []);
}

(async () => {
  const session = await start();
  try {
    await { train, keyboard, looks, drop, study }[scenario](session);
    console.log("done");
  } finally {
    if (session.faults.length) console.log(session.faults.join("\n"));
    await session.browser.close();
  }
})().catch((error) => {
  console.error(error);
  process.exitCode = 1;
});
