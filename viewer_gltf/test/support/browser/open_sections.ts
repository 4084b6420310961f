/** Opens all sections of the panel, the card of the first channel, and its joint histogram. */
import type { ViewerPage } from "./page";

const SECTIONS = [
  ...["channels", "volumes", "tiles", "cut", "slices", "save", "stereo", "view", "measure"],
  ...["volume-settings", "light", "share", "quality"],
];

export async function openAllSections(viewer: ViewerPage): Promise<void> {
  for (const section of SECTIONS) await viewer.unfold(section);
  const card = viewer.page.locator("[data-channel] [data-opener]").first();
  if ((await card.getAttribute("aria-expanded")) === "false") await card.click();
  const { page } = viewer;
  const plane = page.locator('.panel canvas[role="application"]');
  if ((await plane.count()) === 0) await page.keyboard.press("H");
}
