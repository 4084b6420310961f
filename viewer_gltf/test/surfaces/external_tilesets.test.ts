/** Finer surfaces in external tilesets, as in bundles with many tiles. */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { BALLS } from "../support/fixture/bodies";

const CHANNEL = "channels/Balls";
/** Triangles of all balls on screen, with the coarsest surface of both tiles: 6 rings each. */
const COARSEST_TRIANGLES = BALLS.length * 4 * 6 * 6;

describeInChromium("a bundle with external tilesets", () => {
  const stand = prepareStand({
    viewport: { width: 640, height: 360 },
    isBlind: true,
    fixture: { hasFinerApart: true },
  });

  it("keeps the coarsest surfaces until failed finer ones are loaded", async () => {
    const damaged = `${CHANNEL}/r0_c0/finer.json`;
    const text = await readFile(join(stand.bundle, damaged), "utf8");
    const body = text.replace("lod1.glb", "lod2.glb");
    stand.host.overrides.set(`/bundle/${damaged}`, { status: 200, body });
    // in the other tile, the external tileset is loaded but its surface is not
    const gone = `${CHANNEL}/r0_c1/lod1.glb`;
    stand.host.overrides.set(`/bundle/${gone}`, { status: 404, body: "gone" });
    await stand.open("&mode=off"); // no volume in place of a surface
    await stand.viewer.show("F_x20_body", false);
    await stand.viewer.settled();
    const { state, triangles } = await stand.viewer.snapshot();
    expect(state.notices.join()).toContain(`${damaged}: expected sha-256-128`);
    expect(state.notices.join()).toContain(`${gone}: not found (404)`);
    expect(triangles).toBe(COARSEST_TRIANGLES);

    const asked = stand.host.requests.map(({ path }) => path);
    const overview = asked.findLastIndex((path) => path.endsWith("/lod2.glb"));
    expect(asked.findIndex((path) => path.endsWith("/finer.json"))).toBeGreaterThan(overview);

    stand.host.overrides.clear();
    await stand.viewer.show("Balls", false);
    await stand.viewer.show("Balls", true);
    await stand.viewer.settled();
    const { triangles: finer } = await stand.viewer.snapshot();
    expect(finer).toBeGreaterThan(4 * COARSEST_TRIANGLES);
  });
});
