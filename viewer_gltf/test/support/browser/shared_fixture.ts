/** Writes the synthetic bundle that all test files share and none changes. */
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { TestProject } from "vitest/node";
import { writeFixture } from "../fixture/bundle";

declare module "vitest" {
  interface ProvidedContext {
    /** Folder of the bundle. */
    fixture: string;
  }
}

export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
  await writeFixture(folder);
  project.provide("fixture", folder);
  return () => rm(folder, { recursive: true, force: true });
}
