/** A dialog with the camera's picture, until it shows the code of a phone viewer. */

import { element } from "../../dom/element";

/** The text of the first code that the video shows. */
export type Scan = (video: HTMLVideoElement, signal: AbortSignal) => Promise<string>;

/**
 * The code's text; null: closed without one. Throws what `scan` throws, and DOMException where the
 * camera is refused.
 */
export async function scanByCamera(parent: HTMLElement, scan: Scan): Promise<string | null> {
  const closed = new AbortController();
  const video = element("video", { muted: true, playsInline: true });
  video.ariaLabel = "What the camera sees";
  const dialog = element(
    "dialog",
    { className: "scanner" },
    { scanner: "" },
    element("p", { textContent: "Hold the code of your phone viewer before the camera." }),
    video,
    element("button", { textContent: "Cancel", onclick: () => dialog.close() }),
  );
  dialog.addEventListener("close", () => closed.abort());
  parent.append(dialog);
  dialog.showModal();
  let stream: MediaStream | null = null;
  try {
    stream = await navigator.mediaDevices.getUserMedia({ video: { facingMode: "environment" } });
    video.srcObject = stream;
    await video.play();
    return await scan(video, closed.signal);
  } catch (error) {
    if (closed.signal.aborted) return null;
    throw error;
  } finally {
    for (const track of stream?.getTracks() ?? []) track.stop();
    dialog.remove();
  }
}
