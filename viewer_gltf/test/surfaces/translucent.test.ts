/** A translucent surface shows through another one that lies in front of it. */
import { expect, it } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { project } from "../support/browser/camera";
import { lightOf } from "../support/browser/light";
import { type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { BALLS, SPECIMEN } from "../support/fixture/bodies";
import { BODIES } from "../support/fixture/bundle";

const [F, BALL] = BODIES;
/** The small ball is in front of the F's upright, seen from the side. */
const { center } = BALLS[1];
const OPACITY = 0.5;

describeInChromium("translucent surfaces", () => {
  const stand = prepareStand({ viewport: { width: 320, height: 240 }, pixelRatio: 1 });

  async function look(link: string): Promise<Picture> {
    await stand.open(`&mode=off&quality=high&backdrop=plain&view=side#v=1&depth=0&${link}`);
    await stand.viewer.settled();
    return takePicture(stand.viewer.page);
  }

  /** Light (red, green, blue) of the pixel at the middle of the ball. */
  async function lightOfBall(link: string): Promise<readonly number[]> {
    const picture = await look(link);
    const bounds = SPECIMEN as unknown as Manifest["specimen"]["bounds_um"];
    // From the other side, left and right are swapped.
    const [low, high] = [bounds.min[0], bounds.max[0]];
    const mirrored = [low + high - center[0], center[1], center[2]] as const;
    const { x, y } = project(mirrored, bounds, picture.width, picture.height, "left");
    return picture.at(Math.round(picture.width - x), Math.round(y)).map(lightOf);
  }

  const half = (...ids: readonly string[]) =>
    `c=${ids.join(",")}&l=${ids.map((id) => `${id}:o${OPACITY}`).join(",")}`;

  it("are drawn over each other, the nearest last", async () => {
    const [both, ball] = [await lightOfBall(half(F.id, BALL.id)), await lightOfBall(half(BALL.id))];
    const [letter, alone] = [await lightOfBall(`c=${F.id}`), await lightOfBall(`c=${BALL.id}`)];
    for (const k of [0, 1, 2]) {
      const ground = (ball[k] - OPACITY * alone[k]) / (1 - OPACITY);
      const behind = OPACITY * letter[k] + (1 - OPACITY) * ground;
      expect(both[k], `part ${k}`).toBeCloseTo(OPACITY * alone[k] + (1 - OPACITY) * behind, 1.5);
    }
    // The letter is red, and the ball is blue.
    expect(both[0]).toBeGreaterThan(ball[0] + 0.03);
  });
});
