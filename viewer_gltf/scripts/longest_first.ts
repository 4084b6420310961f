import { BaseSequencer, type TestSpecification } from "vitest/node";

/** Files of tests of the browser that take long, below `test/`; the longest first. */
export const LONG = [
  "offline/offline", // it waits for most of it
  "pathtrace/page",
  "render/gaze_focus",
  "xr/disparity",
  "page/opening",
  "render/clip_page",
  "xr/stereo_page",
  "volumes/bricks_page",
  "page/faults_of_host",
  "pathtrace/path_tracer",
  "render/color_match",
  "shaders/psnr_against_reference",
  "page/viewer",
  "page/faults",
  "xr/room_page",
  "volumes/page",
  "interop/stage_round_trip",
  "bench/bench_page",
];

/**
 * What a visit of 40 s keeps is what a device fetches and draws in them: last, when the tests of Python,
 * which run beside these, have left the cores.
 */
export const LAST = "offline/first_visit";

/**
 * The order of the files of tests: those that take long begin, so that none of them is left alone
 * at the end. A fresh clone has no times of its own yet, and a file's size says little of them.
 */
export class LongestFirst extends BaseSequencer {
  override async sort(files: TestSpecification[]): Promise<TestSpecification[]> {
    const rank = ({ moduleId }: TestSpecification) => {
      const is = (name: string) => moduleId.endsWith(`/test/${name}.test.ts`);
      const found = LONG.findIndex(is);
      return is(LAST) ? LONG.length + 1 : found < 0 ? LONG.length : found;
    };
    return (await super.sort(files)).sort((a, b) => rank(a) - rank(b)); // stable
  }
}
