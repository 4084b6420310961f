import { BaseSequencer, type TestSpecification } from "vitest/node";

/**
 * What a visit of 40 s keeps is what a device fetches and draws in them: last, when the tests of Python,
 * which run beside these, have left the cores.
 */
export const LAST = "offline/first_visit.built";

/** The files of tests in vitest's order, but for the one that is last. */
export class OneLast extends BaseSequencer {
  override async sort(files: TestSpecification[]): Promise<TestSpecification[]> {
    const isLast = ({ moduleId }: TestSpecification) => moduleId.endsWith(`/test/${LAST}.test.ts`);
    const sorted = await super.sort(files);
    return [...sorted.filter((file) => !isLast(file)), ...sorted.filter(isLast)];
  }
}
