/** Reading the QR code of a Cardboard viewer with the camera. */
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const CODE = "https://g.co/cardboard";

describeInChromium("the scanner", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 480 }, isBlind: true });

  /** Adds a camera that shows nothing, and a detector that finds the code at its third attempt. */
  async function addCamera(isAllowed: boolean): Promise<void> {
    await stand.viewer.page.addInitScript(
      ([code, isAllowed]) => {
        let attempts = 0;
        Object.assign(window, {
          BarcodeDetector: class {
            static getSupportedFormats(): Promise<string[]> {
              return Promise.resolve(["qr_code"]);
            }

            detect = async () => (++attempts < 3 ? [] : [{ rawValue: code }]);
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

  it("reads the code, stops the camera, and keeps the lens profile", async () => {
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

  it("reports that the camera is refused", async () => {
    await addCamera(false);
    await stand.viewer.page.keyboard.press("K");
    await expect
      .poll(() => stand.viewer.page.locator("[data-announcement]").textContent())
      .toContain("Permission denied");
    expect(await stand.viewer.page.locator("[data-scanner]").count()).toBe(0);
  });
});
