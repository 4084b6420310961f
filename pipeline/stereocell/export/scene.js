// In a scene of one file: the page's files and the bundle's are blocks of this document, and nothing is asked of
// any host. The rest is in bundle/blob_page.js.
(() => {
  const app = document.getElementById("app");
  const blocks = (name) =>
    new Map([...document.querySelectorAll(`script[${name}]`)].map((one) => [one.getAttribute(name), one]));

  // Bytes `from` to `to` of a block, whose text is base64: three bytes are four characters.
  const bytesOf = (block, from = 0, to = Number(block.dataset.bytes)) => {
    const first = Math.floor(from / 3);
    const text = atob(block.textContent.slice(4 * first, 4 * Math.ceil(to / 3)));
    const start = from - 3 * first;
    return Uint8Array.from({ length: to - from }, (_, i) => text.charCodeAt(start + i));
  };

  const contents = blocks("data-file");
  const read = async (path, range) => {
    const block = contents.get(path);
    if (block === undefined) return { status: 404, bytes: new Uint8Array() };
    const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(range ?? "") ?? [];
    if (first === undefined) {
      const bytes = bytesOf(block);
      const isPacked = block.hasAttribute("data-packed");
      return { status: 200, bytes: isPacked ? await new Response(unpacked(bytes)).arrayBuffer() : bytes };
    }
    if (block.hasAttribute("data-packed")) {
      const whole = await new Response(unpacked(bytesOf(block))).arrayBuffer();
      return { status: 206, bytes: whole.slice(Number(first), Number(last) + 1) };
    }
    return { status: 206, bytes: bytesOf(block, Number(first), Number(last) + 1) };
  };

  if (typeof DecompressionStream === "undefined") {
    app.textContent =
      "This browser is too old for this file: please open it in a current Chrome, Edge, Firefox or Safari.";
    return;
  }
  app.textContent = "Opening the scene ...";
  const view = document.querySelector("script[data-view]")?.textContent.trim() ?? "";
  if (location.hash === "" && view !== "") location.replace(view);
  const page = new Map([...blocks("data-page")].map(([name, block]) => [name, bytesOf(block)]));
  startViewer(page, read, { bundle: HOST }).catch((error) => {
    // the viewer itself reports its faults once it runs
    if (app.textContent.startsWith("Opening")) app.textContent = `The viewer failed: ${error.message}`;
    throw error;
  });
})();
