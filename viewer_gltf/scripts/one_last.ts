import { BaseSequencer, type TestSpecification } from "vitest/node";

/**
 * Test file that runs last. It tests a visit of 40 s, whose result depends on the speed of fetching and drawing. The
 * Python tests, which run at the same time, have then finished and no longer use the cores.
 */
export const LAST = "offline/first_visit.built";

/** Sorts test files in vitest's order, except for the one that runs last. */
export class OneLast extends BaseSequencer {
  override async sort(files: TestSpecification[]): Promise<TestSpecification[]> {
    const isLast = ({ moduleId }: TestSpecification) => moduleId.endsWith(`/test/${LAST}.test.ts`);
    const sorted = await super.sort(files);
    return [...sorted.filter((file) => !isLast(file)), ...sorted.filter(isLast)];
  }
}
