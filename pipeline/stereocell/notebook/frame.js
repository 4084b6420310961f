// In the frame that holds the viewer's page: no address leads anywhere from here, and what the page
// fetches is asked of the kernel through a port. The parent sends that port with the page's files.
addEventListener("message", function begin({ data, ports, source }) {
  if (source !== parent || data?.stereocell !== "begin") return;
  removeEventListener("message", begin);
  const [port] = ports;
  start(data, port).catch((error) => {
    port.postMessage({ type: "failed", text: String(error?.message ?? error) });
  });
});

// what a bundle's files are named by; of a domain that can't exist (RFC 2606)
const HOST = "https://notebook.invalid/";

// A frame without an origin starts no module as a worker; those of the page import nothing.
globalThis.Worker = class extends Worker {
  constructor(address) {
    super(address);
  }
};

async function start({ files, view }, port) {
  answerFetches(port);
  const addresses = await addressesOf(files);
  const named = (ending) => [...addresses].find(([name]) => ending.test(name))?.[1];
  await linkStyle(named(/^index-.*\.css$/));
  globalThis.stereocellBase = `${HOST}assets/`;
  globalThis.stereocellHost = { page: HOST + view, port };
  globalThis.stereocellCode = import(named(/^viewer-.*\.js$/));
  await globalThis.stereocellCode;
}

// Of each of the page's files: its code names others by theirs, so those have to have theirs first.
async function addressesOf(files) {
  const addresses = new Map();
  const texts = new Map();
  const types = { js: "text/javascript", css: "text/css", wasm: "application/wasm" };
  const addressFor = (name, bytes) => {
    const type = types[name.split(".").at(-1)];
    addresses.set(name, URL.createObjectURL(new Blob([bytes], { type })));
  };
  for (const [name, bytes] of files) {
    if (name.endsWith(".js")) {
      const text = await new Response(unpacked(bytes)).text();
      const isWorker = name.includes("_worker-"); // which is no module here
      texts.set(name, isWorker ? text.replaceAll("import.meta.url", "location.href") : text);
    } else addressFor(name, await new Response(unpacked(bytes)).arrayBuffer());
  }
  const naming = /(["'`])(?:\.\/)?([\w.-]+\.(?:js|css|wasm))\1/g;
  const place = (name, above) => {
    if (addresses.has(name)) return;
    const text = texts.get(name).replace(naming, (as, quote, other) => {
      if (!(files.has(other) && !above.includes(other))) return as;
      place(other, [...above, other]);
      return quote + addresses.get(other) + quote;
    });
    addressFor(name, text);
  };
  // the code calls itself by the name of what hands its exports on (scripts/finish_build.ts)
  const own = [...texts.keys()].filter((name) => /^(index|viewer)-/.test(name));
  for (const name of texts.keys()) place(name, own.includes(name) ? own : [name]);
  return addresses;
}

function unpacked(bytes) {
  const { body } = new Response(bytes);
  const isPacked = bytes[0] === 0x1f && bytes[1] === 0x8b;
  return isPacked ? body.pipeThrough(new DecompressionStream("gzip")) : body;
}

function linkStyle(href) {
  return new Promise((resolve, reject) => {
    const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href });
    link.onload = resolve;
    link.onerror = () => reject(new Error("the page's style was refused"));
    document.head.append(link);
  });
}

function answerFetches(port) {
  const waiting = new Map();
  let last = 0;
  port.addEventListener("message", ({ data }) => {
    if (data.type !== "file") return;
    waiting.get(data.id)?.(data);
    waiting.delete(data.id);
  });
  port.start();
  const fetchElsewhere = globalThis.fetch;
  globalThis.fetch = (asked, options = {}) => {
    const url = new URL(asked.url ?? asked);
    if (!url.href.startsWith(HOST)) return fetchElsewhere(asked, options);
    const range = new Headers(options.headers).get("Range");
    const path = decodeURIComponent(url.pathname.slice(1));
    return new Promise((resolve, reject) => {
      const id = ++last;
      const leave = () => {
        waiting.delete(id);
        reject(new DOMException("the request was left", "AbortError"));
      };
      const { signal } = options;
      if (signal?.aborted) return leave();
      signal?.addEventListener("abort", leave, { once: true });
      waiting.set(id, ({ status, bytes }) => {
        signal?.removeEventListener("abort", leave);
        resolve(new Response(bytes, { status }));
      });
      port.postMessage({ type: "file", id, path, range });
    });
  };
}
