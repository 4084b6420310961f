/**
 * What all files of tests share: the synthetic bundle, which none changes, and browsers, one for each
 * file that runs at a time.
 */
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
    /** The browsers' addresses; none where there is no Chromium. */
    chromium: readonly string[];
  }
}

export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
  await writeFixture(folder);
  project.provide("fixture", folder);
  const count = hasChromium() ? (project.config.maxWorkers ?? 1) : 0;
  const browsers = await Promise.all(Array.from({ length: count }, serveChromium));
  project.provide(
    "chromium",
    browsers.map((browser) => browser.wsEndpoint()),
  );
  return async () => {
    await Promise.all(browsers.map((browser) => browser.close()));
    await rm(folder, { recursive: true, force: true });
  };
}
