import { describe, expect, it } from "vitest";
import { handOn, movable } from "./finish_build";

declare global {
  var stereocellBase: string | undefined;
  var stereocellCode: unknown;
}

const asModule = (code: string) => import(`data:text/javascript,${encodeURIComponent(code)}`);

describe("the viewer's code", () => {
  it("takes its address from the page, wherever it runs", async () => {
    globalThis.stereocellBase = "https://host.test/some/folder/assets/";
    const code = "export const worker=new URL(`worker.js`,import.meta.url).href";
    const { worker } = await asModule(movable(code, "index-1.js"));
    expect(worker).toBe("https://host.test/some/folder/assets/worker.js");
  });

  it("imports its other parts from the page's folder when they are needed", () => {
    const code = "const load=()=>import(`./part-1.js`),other=()=>import('./part-2.js')";
    const moved = movable(code, "index-1.js");
    expect(moved).not.toMatch(/import\([`'"]/);
    expect(moved).toContain('new URL("part-1.js",globalThis.stereocellBase)');
    expect(moved).toContain('new URL("part-2.js",globalThis.stereocellBase)');
  });

  it("passes on the same exports under their names", async () => {
    const one = { name: "one" };
    globalThis.stereocellCode = Promise.resolve({ a: one, $: 2, in: 3 });
    const { a, $, in: reserved } = await asModule(handOn(["a", "$", "in"]));
    expect([a, $, reserved]).toEqual([one, 2, 3]);
    expect(a).toBe(one);
  });
});
