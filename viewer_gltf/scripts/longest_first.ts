import { BaseSequencer, type TestSpecification } from "vitest/node";

/** Files of tests of the browser that take long, below `test/`; the longest first. */
export const LONG = [
  "offline/first_visit", // it waits for most of it, as the next one does
  "offline/offline",
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
 * The order of the files of tests: those that take long begin, so that none of them is left alone
 * at the end. A fresh clone has no times of its own yet, and a file's size says little of them.
 */
export class LongestFirst extends BaseSequencer {
  override async sort(files: TestSpecification[]): Promise<TestSpecification[]> {
    const rank = ({ moduleId }: TestSpecification) => {
      const found = LONG.findIndex((name) => moduleId.endsWith(`/test/${name}.test.ts`));
      return found < 0 ? LONG.length : found;
    };
    return (await super.sort(files)).sort((a, b) => rank(a) - rank(b)); // stable
  }
}
