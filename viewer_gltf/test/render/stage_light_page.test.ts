/**
 * A lamp of the stage stands with the specimen, so it lights the same side of the specimen in every
 * view.
 */
import { expect, it } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { project, type Side } from "../support/browser/camera";
import { lightOf } from "../support/browser/light";
import { takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { BALLS, SPECIMEN } from "../support/fixture/bodies";

const bounds = SPECIMEN as unknown as Manifest["specimen"]["bounds_um"];
const [{ center, radius }] = BALLS;
/**
 * Direction, in radii from the ball's middle, at which its surface is sampled, away from the edge.
 */
const ASIDE = 0.6;

describeInChromium("a lamp of the stage, from the specimen's right", () => {
  const stand = prepareStand({
    viewport: { width: 320, height: 240 },
    pixelRatio: 1,
    fixture: {
      lamps: [
        {
          ...{ name: "sun", color: [1, 1, 1], strength: 0.9 },
          ...{ towards: [1, 0, 0], position_um: null },
        },
      ],
    },
  });

  /** Blue light of the ball where it faces along an axis and where it faces the opposite way. */
  async function lightOfSides(query: string, side: Side, axis: 0 | 2): Promise<readonly number[]> {
    await stand.open(query);
    await stand.viewer.settled();
    const picture = await takePicture(stand.viewer.page);
    return [1, -1].map((sign) => {
      const point = center.map((v, k) => (k === axis ? v + sign * ASIDE * radius : v));
      const [x, y, z] = point;
      const { x: column, y: row } = project([x, y, z], bounds, picture.width, picture.height, side);
      return lightOf(picture.at(Math.round(column), Math.round(row))[2]);
    });
  }

  for (const mode of ["off", "all"]) {
    it(`lights ${mode === "off" ? "surfaces" : "volumes"} by the cosine, and not from behind`, async () => {
      const [right, left] = await lightOfSides(
        `&mode=${mode}&quality=high#v=1&depth=0`,
        "front",
        0,
      );
      expect(right).toBeGreaterThan(0.3);
      expect(left).toBeLessThan(0.06);
    });
  }

  it("lights both halves of the side that faces it, seen from the lamp", async () => {
    const sides = await lightOfSides("&mode=off&quality=high&view=side", "left", 2);
    for (const light of sides) expect(light).toBeGreaterThan(0.5);
  });
});
