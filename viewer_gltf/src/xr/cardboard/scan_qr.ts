/**
 * A viewer's code read by the camera, where the browser itself finds QR codes: `BarcodeDetector`,
 * which Chrome has on Android and Safari has not. Elsewhere the code's address is pasted, which the
 * camera app of every phone gives.
 */
import { ProfileError, parseProfile } from "./viewer_profile";

type Detector = { detect: (source: HTMLVideoElement) => Promise<{ rawValue: string }[]> };
type DetectorClass = {
  new (options: { formats: string[] }): Detector;
  getSupportedFormats: () => Promise<string[]>;
};

const PAUSE_ms = 150;
const NO_SCANNER =
  "This browser can't read QR codes: scan the viewer's code with the phone's camera app, copy the " +
  "address that it shows, and paste it here.";

async function findDetector(): Promise<Detector | null> {
  const { BarcodeDetector } = globalThis as { BarcodeDetector?: DetectorClass };
  if (BarcodeDetector === undefined) return null;
  // Chrome on a desktop may have the class and no format that it can read.
  const formats = await BarcodeDetector.getSupportedFormats();
  return formats.includes("qr_code") ? new BarcodeDetector({ formats: ["qr_code"] }) : null;
}

export async function canScan(): Promise<boolean> {
  return (await findDetector()) !== null;
}

/**
 * The text of the first viewer's code that the video shows. Throws ProfileError where there is no
 * scanner, or the code is another's; the signal's reason where it is aborted.
 */
export async function scanCode(video: HTMLVideoElement, signal: AbortSignal): Promise<string> {
  const detector = await findDetector();
  if (detector === null) throw new ProfileError(NO_SCANNER);
  for (;;) {
    signal.throwIfAborted();
    // Before its first frame a video is refused.
    const codes = video.readyState >= 2 ? await detector.detect(video) : [];
    if (codes[0] !== undefined) {
      parseProfile(codes[0].rawValue);
      return codes[0].rawValue;
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE_ms));
  }
}
