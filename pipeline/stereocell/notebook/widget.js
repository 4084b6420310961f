// The widget's view: shows the viewer's page in a frame, and passes messages between the frame and the kernel.
// The frame is a sandbox without an origin, so that a bundle can reach neither the notebook nor its server.

/** The page's files by version, shared by all widgets. */
const pages = new Map();
/** Recent files of bundles, for a view that is opened again. */
const cached = new Map();
/** Bytes of all cached files of bundles, at most. */
const MAX_CACHED = 64 * 2 ** 20;
let cachedBytes = 0;
/** Traits that both the kernel and the page may change. */
const SHARED = ["link", "channels", "view", "picked"];

/** Sends requests to the kernel, and resolves each with its own answer. */
function kernelOf(model) {
  const waiting = new Map();
  const mine = crypto.randomUUID();
  let last = 0;
  const receive = (content, buffers) => {
    const answer = waiting.get(content.id);
    if (answer === undefined) return; // the answer is for another view of the same widget
    waiting.delete(content.id);
    answer({ ...content, buffers: buffers.map(bytesOf) });
  };
  model.on("msg:custom", receive);
  return {
    ask: (question) =>
      new Promise((resolve) => {
        const id = `${mine}/${++last}`;
        waiting.set(id, resolve);
        model.send({ ...question, id });
      }),
    leave: () => model.off("msg:custom", receive),
  };
}

/** Returns a copy of a buffer. The notebook's own memory, of which buffers are views, can't be transferred. */
function bytesOf(buffer) {
  const isView = ArrayBuffer.isView(buffer);
  return isView
    ? new Uint8Array(buffer.buffer, buffer.byteOffset, buffer.byteLength).slice()
    : new Uint8Array(buffer).slice();
}

async function pageOf(kernel, model) {
  const key = model.get("_page");
  if (!pages.has(key)) pages.set(key, await kernel.ask({ ask: "page" }));
  const { html, names, buffers } = pages.get(key);
  return { html, files: new Map(names.map((name, i) => [name, buffers[i]])) };
}

async function fileOf(kernel, model, { path, range }) {
  const key = `${model.get("_bundle")} ${range} ${path}`;
  const found = cached.get(key);
  if (found !== undefined) return found;
  const { status, buffers } = await kernel.ask({ ask: "file", path, range });
  const answer = { status, bytes: buffers[0] ?? new Uint8Array() };
  cache(key, answer);
  return answer;
}

/** Caches a file, and drops the oldest ones if there are too many bytes. */
function cache(key, answer) {
  cachedBytes += answer.bytes.length;
  cached.set(key, answer);
  for (const [oldest, { bytes }] of cached) {
    if (cachedBytes <= MAX_CACHED) return;
    cachedBytes -= bytes.length;
    cached.delete(oldest);
  }
}

/** Returns the output with the picture, which follows the widget's output; null in a notebook without it there. */
function pictureBelow(el) {
  for (let node = el; node !== null; node = node.parentElement ?? node.getRootNode().host ?? null) {
    const next = node.nextElementSibling;
    if (next === null) continue;
    const isPicture = next.querySelectorAll("img").length === 1 && next.innerText.trim() === "";
    return isPicture ? next : null;
  }
  return null;
}

function same(a, b) {
  return JSON.stringify(a) === JSON.stringify(b);
}

function render({ model, el }) {
  const root = document.createElement("div");
  root.className = "stereocell";
  const picture = document.createElement("img");
  picture.alt = `StereoCell: ${model.get("name")}`;
  const words = document.createElement("p");
  root.append(picture, words);
  const bar = document.createElement("div");
  bar.className = "stereocell-bar";
  bar.textContent = model.get("quality");
  el.append(root, bar);
  const frame = document.createElement("iframe");
  const kernel = kernelOf(model);
  let port = null;
  /** The state that kernel and page agree on. It is not sent again. */
  let known = {};
  /** The output with the picture, which is hidden while this viewer is live. */
  let hidden = null;

  const showHeight = () => root.style.setProperty("height", `${model.get("height")}px`);
  const showPicture = () => {
    const bytes = model.get("_picture");
    picture.hidden = !(bytes?.byteLength > 0);
    if (picture.hidden) return;
    let text = "";
    for (const byte of bytesOf(bytes)) text += String.fromCharCode(byte);
    picture.src = `data:image/png;base64,${btoa(text)}`;
  };
  const sendChanges = () => {
    const state = Object.fromEntries(SHARED.map((name) => [name, model.get(name)]));
    const changed = SHARED.filter((name) => !same(state[name], known[name]));
    if (port === null || changed.length === 0) return;
    known = state;
    port.postMessage({
      type: "state",
      state: Object.fromEntries(changed.map((n) => [n, state[n]])),
    });
  };
  /** Sends the state beside the link, with which the page has already opened. */
  const sendAll = () => {
    const { channels, view, picked } = Object.fromEntries(SHARED.map((n) => [n, model.get(n)]));
    const isNamed = picked !== null && picked.tile === undefined; // a point that the notebook has set
    const state = { channels, view, ...(isNamed ? { picked } : {}) };
    port?.postMessage({ type: "state", state });
  };
  const takeOver = (state) => {
    const shared = Object.fromEntries(
      Object.entries(state).filter(([name]) => SHARED.includes(name)),
    );
    known = { ...known, ...shared };
    for (const [name, value] of Object.entries(shared)) model.set(name, value);
    model.save_changes();
  };

  const receive = async ({ data }) => {
    if (data.type === "file") {
      const { status, bytes } = await fileOf(kernel, model, data);
      port?.postMessage({ type: "file", id: data.id, status, bytes });
    } else if (data.type === "state") takeOver(data.state);
    else if (data.type === "open") sendAll();
    else if (data.type === "shown") {
      root.dataset.state = "live";
      hidden = pictureBelow(el);
      if (hidden !== null) hidden.style.display = "none";
    } else if (data.type === "picture") {
      model.send({ ask: "picture" }, undefined, [data.png]);
    }
    if (data.type === "failed") words.textContent = `The viewer can't run here: ${data.text}`;
  };
  const begin = async () => {
    const { files } = await pageOf(kernel, model);
    const { port1, port2 } = new MessageChannel();
    port?.close();
    port = port1;
    port.onmessage = (event) => void receive(event);
    known = Object.fromEntries(SHARED.map((name) => [name, model.get(name)]));
    const message = { stereocell: "begin", files, view: model.get("link") };
    frame.contentWindow?.postMessage(message, "*", [port2]);
  };
  const open = async () => {
    words.textContent = "This is a still picture. The viewer starts when no cell is running.";
    const { html } = await pageOf(kernel, model);
    words.textContent = "";
    frame.title = picture.alt;
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.allow = "fullscreen; xr-spatial-tracking; clipboard-write";
    frame.srcdoc = html;
    frame.addEventListener("load", () => void begin()); // a notebook that moves the frame loads it again
    root.append(frame);
  };
  const watched = [
    ["change:height", showHeight],
    ["change:_picture", showPicture],
    ...SHARED.map((name) => [`change:${name}`, sendChanges]),
  ];
  for (const [event, then] of watched) model.on(event, then);
  showHeight();
  showPicture();
  void open();
  return () => {
    for (const [event, then] of watched) model.off(event, then);
    kernel.leave();
    port?.close();
    hidden?.style.removeProperty("display");
    root.remove();
    bar.remove();
  };
}

export default { render };
