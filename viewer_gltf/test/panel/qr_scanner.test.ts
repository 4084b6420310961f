/** The code of a phone viewer, read by the camera. */
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const CODE = "https://g.co/cardboard";

describeInChromium("the scanner", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 480 }, isBlind: true });

  /** A camera that shows nothing, and a detector that finds the code in it at its third look. */
  async function addCamera(isAllowed: boolean): Promise<void> {
    await stand.viewer.page.addInitScript(
      ([code, isAllowed]) => {
        let looks = 0;
        Object.assign(window, {
          BarcodeDetector: class {
            static getSupportedFormats(): Promise<string[]> {
              return Promise.resolve(["qr_code"]);
            }

            detect = async () => (++looks < 3 ? [] : [{ rawValue: code }]);
          },
        });
        navigator.mediaDevices.getUserMedia = async () => {
          if (!isAllowed) throw new DOMException("Permission denied", "NotAllowedError");
          const canvas = document.createElement("canvas");
          const paint = () => canvas.getContext("2d")?.fillRect(0, 0, 300, 150);
          setInterval(paint, 30);
          const stream = canvas.captureStream(30);
          Object.assign(window, { camera: stream });
          return stream;
        };
      },
      [CODE, isAllowed] as const,
    );
    await stand.open("&mode=off");
  }

  it("takes the code, lets go of the camera, and remembers the lenses", async () => {
    const { page } = stand.viewer;
    await addCamera(true);
    await stand.viewer.unfold("stereo");
    await page.locator('[data-control="lenses"]').selectOption("own");
    await page.locator('[data-control="scan"], [data-action="scan"]').click();
    const field = page.locator('[data-control="lens-code"]');
    await expect.poll(() => field.inputValue()).toBe(CODE);
    expect(await page.locator("[data-scanner]").count()).toBe(0);
    const tracks = await page.evaluate(() =>
      (window as unknown as { camera: MediaStream }).camera.getTracks().map((t) => t.readyState),
    );
    expect(tracks).toEqual(["ended"]);
  });

  it("reports it where the camera is refused", async () => {
    await addCamera(false);
    await stand.viewer.page.keyboard.press("K");
    await expect
      .poll(() => stand.viewer.page.locator("[data-said]").textContent())
      .toContain("Permission denied");
    expect(await stand.viewer.page.locator("[data-scanner]").count()).toBe(0);
  });
});
