/** Put a text into the clipboard. False where the browser has none for this page, or refuses. */
export async function copyText(text: string): Promise<boolean> {
  // Outside a secure address there is no clipboard, in spite of the types.
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
