/** The page on the full screen. iPhones and frames without permission do not support it. */

export function hasFullScreen(): boolean {
  return document.fullscreenEnabled === true;
}

export function isFullScreen(): boolean {
  return document.fullscreenElement !== null;
}

/** Must be called within a click or a key. Resolves to whether the browser did it. */
export async function toggleFullScreen(): Promise<boolean> {
  if (!hasFullScreen()) return false;
  try {
    if (isFullScreen()) await document.exitFullscreen();
    else await document.documentElement.requestFullscreen({ navigationUI: "hide" });
    return true;
  } catch {
    return false; // the browser refuses with errors of several kinds
  }
}
