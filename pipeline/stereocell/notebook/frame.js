// This script runs in the frame that holds the viewer's page in a notebook. The parent window sends the page's
// files and a port. Through the port, the page requests the bundle's files. bundle/blob_page.js does the rest.
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
      const abort = () => {
        waiting.delete(id);
        reject(new DOMException("the request was aborted", "AbortError"));
      };
      if (signal?.aborted) return abort();
      signal?.addEventListener("abort", abort, { once: true });
      waiting.set(id, (answer) => {
        signal?.removeEventListener("abort", abort);
        resolve(answer);
      });
      port.postMessage({ type: "file", id, path, range });
    });
}
