// Starts the viewer from files that its document holds or receives. This document can fetch nothing by address.
// Each file of the page becomes an address of its own (blob:). Requests for the bundle's files are answered by
// `read(path, range, signal)`, which resolves to the status of HTTP and the bytes.

// The bundle's files are named by a domain that can't exist (RFC 2606).
const HOST = "https://bundle.invalid/";

// A document without an origin starts no module as a worker; those of the page import nothing.
globalThis.Worker = class extends Worker {
  constructor(address) {
    super(address);
  }
};

// files: bytes by name, packed by gzip or not
// host: what the page takes in place of its own address (viewer_gltf/src/bundle/address.ts)
async function startViewer(files, read, host) {
  answerFetches(read);
  const addresses = await addressesOf(files);
  const named = (ending) => [...addresses].find(([name]) => ending.test(name))?.[1];
  await Promise.all(stylesOf(addresses).map(linkStyle));
  globalThis.stereocellBase = `${HOST}assets/`;
  globalThis.stereocellHost = host;
  globalThis.stereocellCode = import(named(/^viewer-.*\.js$/));
  await globalThis.stereocellCode;
}

// All styles, the page's own first. The code takes only an address that ends in .css for a style, so that a part which
// is loaded later would not find its own.
function stylesOf(addresses) {
  const names = [...addresses.keys()].filter((name) => name.endsWith(".css"));
  const isOwn = (name) => name.startsWith("index-");
  return [...names.filter(isOwn), ...names.filter((name) => !isOwn(name))].map((name) => addresses.get(name));
}

// Code names other files by theirs, so the addresses of those are made first.
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
  // The entry file and the main file import each other, so both addresses are made together (scripts/finish_build.ts).
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

function answerFetches(read) {
  const fetchElsewhere = globalThis.fetch;
  globalThis.fetch = async (asked, options = {}) => {
    const url = new URL(asked.url ?? asked);
    if (!url.href.startsWith(HOST)) return fetchElsewhere(asked, options);
    const range = new Headers(options.headers).get("Range");
    const path = decodeURIComponent(url.pathname.slice(1));
    const { status, bytes } = await read(path, range, options.signal ?? undefined);
    return new Response(bytes, { status });
  };
}
