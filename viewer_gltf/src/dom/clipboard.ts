/** Copies a text to the clipboard. Returns false if the page has no clipboard, or the browser refuses. */
export async function copyText(text: string): Promise<boolean> {
  // An insecure address has no clipboard, although the types say so.
  const clipboard: Clipboard | undefined = navigator.clipboard;
  if (clipboard === undefined) return false;
  try {
    await clipboard.writeText(text);
    return true;
  } catch (error) {
    if (!(error instanceof DOMException)) throw error;
    return false;
  }
}
