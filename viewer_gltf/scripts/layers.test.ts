import { describe, expect, it } from "vitest";
import { against, arrowsOf, circles, partsOf, usersOfHost } from "./layers";

const arrow = (from: string, to: string) => ({ from, to });

describe("the layers", () => {
  it("include imports of every kind, except from packages, from outside and in comments", () => {
    const text = `
      import type { Vec3 } from "../math/vec3";
      import "./panel.css";
      export { a } from "./b";
      import {
        c,
        d,
      } from "../app/viewer";
      import worker from "./sw?worker&url";
      import { Vector3 } from "three";
      import { sample } from "../../test/support/sample";
      /**
       * import { example } from "../app/example";
       */
      const later = import("../xr/session");`;
    expect(arrowsOf("panel/a.ts", text).map(({ to }) => to)).toEqual([
      "math/vec3.ts",
      "panel/panel.css",
      "panel/b.ts",
      "app/viewer.ts",
      "panel/sw.ts",
      "xr/session.ts",
    ]);
  });

  it("allow imports from the same and from lower layers, never from higher ones", () => {
    const down = arrow("app/viewer.ts", "math/vec3.ts");
    const sideways = arrow("xr/stereo.ts", "xr/session.ts");
    const up = arrow("math/vec3.ts", "state/reduce.ts");
    expect(against([down, sideways, up])).toEqual([up]);
  });

  it("recognise parts by their part.ts, and let no part import another", () => {
    const parts = partsOf(["slices/part.ts", "ruler/part.ts", "ruler/ticks.ts", "host/part.ts"]);
    expect([...parts]).toEqual(["slices", "ruler"]);
    const within = arrow("ruler/part.ts", "ruler/ticks.ts");
    const fine = [within, arrow("ruler/part.ts", "host/part.ts"), arrow("app/a.ts", "ruler/b.ts")];
    const wrong = [arrow("ruler/part.ts", "slices/part.ts"), arrow("host/a.ts", "ruler/b.ts")];
    expect(against([...fine, ...wrong], parts)).toEqual(wrong);
    expect(against([arrow("app/a.ts", "ruler/b.ts")])).toHaveLength(1);
  });

  it("know the files above the host, which may not reach through it", () => {
    const files = [
      "slices/part.ts",
      "slices/part.test.ts",
      "app/main.ts",
      "host/host.ts",
      "xr/a.ts",
    ];
    expect(usersOfHost(files, partsOf(files))).toEqual(["slices/part.ts", "app/main.ts"]);
  });

  it("refuse a folder that is in no layer", () => {
    const astray = arrow("helpers/all.ts", "math/vec3.ts");
    const lost = arrow("app/viewer.ts", "helpers/all.ts");
    expect(against([astray, lost])).toEqual([astray, lost]);
  });

  it("report each circle of imports exactly once", () => {
    const open = [arrow("a/1.ts", "a/2.ts"), arrow("a/2.ts", "a/3.ts")];
    expect(circles(open)).toEqual([]);
    expect(circles([...open, arrow("a/3.ts", "a/2.ts"), arrow("a/4.ts", "a/1.ts")])).toEqual([
      ["a/2.ts", "a/3.ts"],
    ]);
  });
});
