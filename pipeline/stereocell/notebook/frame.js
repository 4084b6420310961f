// In the frame that holds the viewer's page in a notebook. The page's files come from the parent with a port,
// and the bundle's are asked of the kernel through it. The rest is in bundle/blob_page.js.
addEventListener("message", function begin({ data, ports, source }) {
  if (source !== parent || data?.stereocell !== "begin") return;
  removeEventListener("message", begin);
  const [port] = ports;
  const host = { page: HOST + data.view, port };
  startViewer(data.files, readerOf(port), host).catch((error) => {
    port.postMessage({ type: "failed", text: String(error?.message ?? error) });
  });
});

function readerOf(port) {
  const waiting = new Map();
  let last = 0;
  port.addEventListener("message", ({ data }) => {
    if (data.type !== "file") return;
    waiting.get(data.id)?.(data);
    waiting.delete(data.id);
  });
  port.start();
  return (path, range, signal) =>
    new Promise((resolve, reject) => {
      const id = ++last;
      const leave = () => {
        waiting.delete(id);
        reject(new DOMException("the request was left", "AbortError"));
      };
      if (signal?.aborted) return leave();
      signal?.addEventListener("abort", leave, { once: true });
      waiting.set(id, (answer) => {
        signal?.removeEventListener("abort", leave);
        resolve(answer);
      });
      port.postMessage({ type: "file", id, path, range });
    });
}
