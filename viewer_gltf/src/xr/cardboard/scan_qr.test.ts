import { afterEach, describe, expect, it, vi } from "vitest";
import { canScan, scanCode } from "./scan_qr";

const video = (readyState = 4) => ({ readyState }) as HTMLVideoElement;
const noAbort = new AbortController().signal;

/** Stubs a browser whose detector returns one answer for each call. */
function stubDetector(answers: string[][], formats = ["qr_code"]): void {
  vi.stubGlobal(
    "BarcodeDetector",
    class {
      static getSupportedFormats = async () => formats;
      detect = async () => (answers.shift() ?? []).map((rawValue) => ({ rawValue }));
    },
  );
}

describe("scanning a viewer's code", () => {
  afterEach(() => void vi.unstubAllGlobals());

  it("waits for the first code that the camera sees", async () => {
    stubDetector([[], [], ["https://g.co/cardboard"]]);
    expect(await canScan()).toBe(true);
    expect(await scanCode(video(), noAbort)).toBe("https://g.co/cardboard");
  });

  it("asks for the code's address where the browser can't scan", async () => {
    expect(await canScan()).toBe(false);
    await expect(scanCode(video(), noAbort)).rejects.toThrow(/can't read QR codes.*paste/);
    stubDetector([], ["ean_13"]);
    expect(await canScan()).toBe(false);
  });

  it("rejects a code that is not a Cardboard viewer's", async () => {
    stubDetector([["https://example.org/menu"]]);
    await expect(scanCode(video(), noAbort)).rejects.toThrow("not a Cardboard viewer's code");
  });

  it("stops when the caller aborts it, even before the camera's first frame", async () => {
    stubDetector([["https://g.co/cardboard"]]);
    const stop = new AbortController();
    const scanned = scanCode(video(0), stop.signal);
    stop.abort(new Error("closed"));
    await expect(scanned).rejects.toThrow("closed");
  });
});
