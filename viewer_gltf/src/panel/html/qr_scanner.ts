/** A dialog with the camera image, until it shows the QR code of a Cardboard viewer. */

import { element } from "../../dom/element";

/** Returns the text of the first code that the video shows. */
export type Scan = (video: HTMLVideoElement, signal: AbortSignal) => Promise<string>;

/**
 * Returns the text of the code; null if the dialog was closed without one. Throws the errors of
 * `scan`, and DOMException if the camera is refused.
 */
export async function scanByCamera(parent: HTMLElement, scan: Scan): Promise<string | null> {
  const closed = new AbortController();
  const video = element("video", { muted: true, playsInline: true });
  video.ariaLabel = "Camera image";
  const dialog = element(
    "dialog",
    { className: "scanner" },
    { scanner: "" },
    element("p", {
      textContent: "Hold the QR code of your Cardboard viewer in front of the camera.",
    }),
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
