// Fetches the viewer's code and style packed by gzip, whether or not the host packs, and shows how much has come.
// BUILD is filled in by scripts/finish_build.ts.
(() => {
  const BUILD = {};
  const bar = document.querySelector("[data-boot] progress");
  const words = document.querySelector("[data-boot] p");
  const kB = (bytes) => `${Math.round(bytes / 1000)} kB`;
  const show = (bytes) => {
    // a host may have unpacked it on its way
    const come = Math.min(bytes, BUILD.bytes);
    bar.value = come / BUILD.bytes;
    words.textContent = `Loading the viewer: ${kB(come)} of ${kB(BUILD.bytes)}`;
  };

  // Fetches a file that is packed by gzip, unpacks it, and returns an address of what it contains.
  const fetchPacked = async (path, type, onProgress) => {
    const { body, ok, status } = await fetch(path);
    if (!ok || body === null) throw new Error(`the host answers ${status} for ${path}`);
    const parts = [];
    let come = 0;
    for (const reader = body.getReader(); ; ) {
      const { done, value } = await reader.read();
      if (done) break;
      parts.push(value);
      come += value.length;
      onProgress(come);
    }
    const [first, second] = parts[0] ?? [];
    const isPacked = first === 0x1f && second === 0x8b;
    const sent = new Blob(parts);
    const plain = isPacked
      ? sent.stream().pipeThrough(new DecompressionStream("gzip"))
      : sent.stream();
    const content = await new Response(plain).blob();
    if (content.size !== BUILD.lengths[path]) throw new Error(`${path} is cut short`);
    return URL.createObjectURL(content.slice(0, content.size, type));
  };

  const linkStyle = (href) =>
    new Promise((resolve, reject) => {
      const link = document.createElement("link");
      Object.assign(link, { rel: "stylesheet", href, onload: resolve, onerror: reject });
      document.head.append(link);
    });

  // older browsers can't unpack: they take the plain files
  const canUnpack = typeof DecompressionStream !== "undefined";

  const fetchStyle = async () => {
    const { style, packedStyle } = BUILD;
    await linkStyle(canUnpack ? await fetchPacked(packedStyle, "text/css", () => {}) : style);
  };

  const fetchCode = async () => {
    const { plain, packed } = BUILD;
    return canUnpack
      ? await fetchPacked(packed, "text/javascript", show)
      : new URL(plain, location.href).href;
  };

  const start = async () => {
    globalThis.stereocellBase = new URL(BUILD.base, location.href).href;
    const style = fetchStyle();
    // it is awaited below
    style.catch(() => undefined);
    const code = await fetchCode();
    await style;
    words.textContent = "Starting the viewer";
    globalThis.stereocellCode = import(code);
    await globalThis.stereocellCode;
  };

  // it has been said
  if (location.protocol === "file:") return;
  show(0);
  start().catch((error) => {
    // the code itself says what fails once it runs
    if (document.querySelector("[data-boot]") === null) throw error;
    bar.hidden = true;
    words.textContent = `The viewer could not be loaded: ${error.message}. `;
    const again = document.createElement("button");
    again.textContent = "Try again";
    again.onclick = () => location.reload();
    words.append(again);
  });
})();
