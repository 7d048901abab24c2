// Starts the Rerun viewer on the recording named by `?url=`.

const message = document.getElementById("message");
const canvas = document.getElementById("viewer");
const recording = new URLSearchParams(location.search).get("url");

// The viewer's analytics are off: what it would send elsewhere is answered here, and never sent.
const send = window.fetch.bind(window);
window.fetch = (request, options) => {
  const url = new URL(request.url ?? request, location.href);
  return url.origin === location.origin ? send(request, options) : Promise.resolve(new Response(null, { status: 204 }));
};

async function show() {
  if (!recording) throw new Error("no recording is named: /viewer/?url=/v1/jobs/ID/recording.rrd");
  const url = new URL(recording, location.origin);
  if (url.origin !== location.origin) throw new Error("only recordings of this service are shown");
  await wasm_bindgen({ module_or_path: "re_viewer_bg.wasm" });
  const viewer = new wasm_bindgen.WebHandle({ url: [url.href], hide_welcome_screen: true, persist: false });
  canvas.hidden = false;
  await viewer.start(canvas);
  message.remove();
}

show().catch((error) => {
  canvas.hidden = true;
  message.textContent = `The viewer cannot be started: ${error.message ?? error}`;
});
