/**
 * Reads a Cardboard viewer's QR code with the camera, in browsers that have `BarcodeDetector`
 * (Chrome on Android has it, Safari does not). In other browsers users paste the code's address,
 * which the camera app of every phone shows.
 */
import { ProfileError, parseProfile } from "./viewer_profile";

type Detector = { detect: (source: HTMLVideoElement) => Promise<{ rawValue: string }[]> };
type DetectorClass = {
  new (options: { formats: string[] }): Detector;
  getSupportedFormats: () => Promise<string[]>;
};

/** Milliseconds between two looks at the video. */
const PAUSE_ms = 150;
const NO_SCANNER =
  "This browser can't read QR codes. Scan the viewer's code with the phone's camera app, copy the " +
  "address that it shows, and paste it here.";

async function findDetector(): Promise<Detector | null> {
  const { BarcodeDetector } = globalThis as { BarcodeDetector?: DetectorClass };
  if (BarcodeDetector === undefined) return null;
  // Chrome on a desktop may have the class but no format that it can read.
  const formats = await BarcodeDetector.getSupportedFormats();
  return formats.includes("qr_code") ? new BarcodeDetector({ formats: ["qr_code"] }) : null;
}

export async function canScan(): Promise<boolean> {
  return (await findDetector()) !== null;
}

/**
 * Returns the text of the first QR code that the video shows. Throws ProfileError if the browser
 * has no scanner or the code is not a Cardboard viewer's, and the signal's reason if it is aborted.
 */
export async function scanCode(video: HTMLVideoElement, signal: AbortSignal): Promise<string> {
  const detector = await findDetector();
  if (detector === null) throw new ProfileError(NO_SCANNER);
  for (;;) {
    signal.throwIfAborted();
    // The detector rejects a video that has no frame yet.
    const codes = video.readyState >= 2 ? await detector.detect(video) : [];
    if (codes[0] !== undefined) {
      parseProfile(codes[0].rawValue);
      return codes[0].rawValue;
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE_ms));
  }
}
