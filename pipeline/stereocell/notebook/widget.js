// The widget's view: the viewer's page in a frame of its own, and the messages between it and the kernel.
// The frame is of no origin (a sandbox), so that a bundle can reach neither the notebook nor its server.

/** The page's files, for all widgets; and files of bundles, for a view that comes again. */
const pages = new Map();
const kept = new Map();
const MAX_KEPT = 64 * 2 ** 20;
let keptBytes = 0;
/** Of the state, what goes both ways. */
const SHARED = ["link", "channels", "view", "picked"];

/** Asks of the kernel; each answer is of one question. */
function kernelOf(model) {
  const waiting = new Map();
  const mine = crypto.randomUUID();
  let last = 0;
  const hear = (content, buffers) => {
    const answer = waiting.get(content.id);
    if (answer === undefined) return; // of another view of the same widget
    waiting.delete(content.id);
    answer({ ...content, buffers: buffers.map(bytesOf) });
  };
  model.on("msg:custom", hear);
  return {
    ask: (question) =>
      new Promise((resolve) => {
        const id = `${mine}/${++last}`;
        waiting.set(id, resolve);
        model.send({ ...question, id });
      }),
    leave: () => model.off("msg:custom", hear),
  };
}

/** Buffers come as views of whatever the notebook's program has: a copy of one's own may be handed on. */
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
  const found = kept.get(key);
  if (found !== undefined) return found;
  const { status, buffers } = await kernel.ask({ ask: "file", path, range });
  const answer = { status, bytes: buffers[0] ?? new Uint8Array() };
  keep(key, answer);
  return answer;
}

/** The newest files stay. */
function keep(key, answer) {
  keptBytes += answer.bytes.length;
  kept.set(key, answer);
  for (const [oldest, { bytes }] of kept) {
    if (keptBytes <= MAX_KEPT) return;
    keptBytes -= bytes.length;
    kept.delete(oldest);
  }
}

/** The output with the picture, which comes after the widget's; null: this program has it elsewhere. */
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
  /** What both sides know of: what comes back is no news. */
  let known = {};
  /** The output below, while this lives. */
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
  const tell = () => {
    const state = Object.fromEntries(SHARED.map((name) => [name, model.get(name)]));
    const news = SHARED.filter((name) => !same(state[name], known[name]));
    if (port === null || news.length === 0) return;
    known = state;
    port.postMessage({ type: "state", state: Object.fromEntries(news.map((n) => [n, state[n]])) });
  };
  /** What the link, which the page has opened with, does not say. */
  const tellAll = () => {
    const { channels, view, picked } = Object.fromEntries(SHARED.map((n) => [n, model.get(n)]));
    const isNamed = picked !== null && picked.tile === undefined; // else the link has it, or nobody
    const state = { channels, view, ...(isNamed ? { picked } : {}) };
    port?.postMessage({ type: "state", state });
  };
  const take = (state) => {
    const told = Object.fromEntries(Object.entries(state).filter(([name]) => SHARED.includes(name)));
    known = { ...known, ...told };
    for (const [name, value] of Object.entries(told)) model.set(name, value);
    model.save_changes();
  };

  const hear = async ({ data }) => {
    if (data.type === "file") {
      const { status, bytes } = await fileOf(kernel, model, data);
      port?.postMessage({ type: "file", id: data.id, status, bytes });
    } else if (data.type === "state") take(data.state);
    else if (data.type === "open") tellAll();
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
    port.onmessage = (event) => void hear(event);
    known = Object.fromEntries(SHARED.map((name) => [name, model.get(name)]));
    const message = { stereocell: "begin", files, view: model.get("link") };
    frame.contentWindow?.postMessage(message, "*", [port2]);
  };
  const open = async () => {
    words.textContent = "A picture, until the kernel answers: it does between two cells.";
    const { html } = await pageOf(kernel, model);
    words.textContent = "";
    frame.title = picture.alt;
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.allow = "fullscreen; xr-spatial-tracking; clipboard-write";
    frame.srcdoc = html;
    frame.addEventListener("load", () => void begin()); // anew where the notebook moves it about
    root.append(frame);
  };
  const watched = [
    ["change:height", showHeight],
    ["change:_picture", showPicture],
    ...SHARED.map((name) => [`change:${name}`, tell]),
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
