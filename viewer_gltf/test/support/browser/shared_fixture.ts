/** What all files of tests share: the browser, and the synthetic bundle, which none changes. */
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { TestProject } from "vitest/node";
import { writeFixture } from "../fixture/bundle";
import { hasChromium, serveChromium } from "./chromium";

declare module "vitest" {
  interface ProvidedContext {
    /** The bundle's folder. */
    fixture: string;
    /** The browser's address; null where there is none. */
    chromium: string | null;
  }
}

export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
  await writeFixture(folder);
  project.provide("fixture", folder);
  const browser = hasChromium() ? await serveChromium() : null;
  project.provide("chromium", browser?.wsEndpoint() ?? null);
  return async () => {
    await browser?.close();
    await rm(folder, { recursive: true, force: true });
  };
}
