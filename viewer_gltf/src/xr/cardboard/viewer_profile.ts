/**
 * The lens profile: a Cardboard viewer's lenses, as its maker prints them on the viewer in a QR
 * code.
 * The code holds an address. Its parameter `p` is base64url of the protocol buffer `DeviceParams`,
 * with the field numbers of Google's Cardboard SDK (proto/cardboard_device.proto, Apache-2.0).
 */
import { BundleError } from "../../bundle/errors";
import { type Alignment, isIncreasing, type LensModel } from "./lens_model";
import { type Fields, readFields } from "./protobuf";

type Button = "none" | "magnet" | "touch" | "indirect-touch";

export type Profile = LensModel & Readonly<{ vendor: string; model: string; button: Button }>;

/** The code of a Cardboard viewer can't be read; the message is shown on the page. */
export class ProfileError extends BundleError {
  override readonly name = "ProfileError";
}

/** The v1 profile of the SDK (sdk/qrcode/cardboard_v1). */
export const CARDBOARD_V1: Profile = {
  vendor: "Google, Inc.",
  model: "Cardboard v1",
  screenToLens_m: 0.042,
  interLens_m: 0.06,
  fov_deg: { outer: 40, inner: 40, bottom: 40, top: 40 },
  alignment: "bottom",
  trayToLens_m: 0.035,
  distortion: [0.441, 0.156],
  button: "magnet",
};

/**
 * The code that Google prints on the viewer of 2015. The browser polyfills use other numbers (39
 * mm, 64 mm, 60 degrees, 0.34 and 0.55), which are in no published code.
 */
export const CARDBOARD_V2: Profile = {
  vendor: "Google",
  model: "Cardboard I/O 2015",
  screenToLens_m: 0.0364,
  interLens_m: 0.0639,
  fov_deg: { outer: 50, inner: 50, bottom: 50, top: 50 },
  alignment: "bottom",
  trayToLens_m: 0.035,
  distortion: [0.2416, 0.3012],
  button: "indirect-touch",
};

export const BUILT_IN = { v1: CARDBOARD_V1, v2: CARDBOARD_V2 } as const;

const ALIGNMENTS: readonly Alignment[] = ["bottom", "center", "top"];
const BUTTONS: readonly Button[] = ["none", "magnet", "touch", "indirect-touch"];
const HOW = "Paste the address that the code contains: https://google.com/cardboard/cfg?p=...";

/**
 * Returns the profile for the text of a code: its address, or the part after `p=`. Throws
 * ProfileError.
 */
export function parseProfile(text: string): Profile {
  const pasted = text.replace(/\s+/g, "");
  if (pasted === "") throw new ProfileError(`The viewer's code is empty. ${HOW}`);
  const isBare = /^[\w-]{40,}=*$/.test(pasted);
  if (isBare) return readParams(pasted);

  const address = readAddress(/^https?:/i.test(pasted) ? pasted : `https://${pasted}`);
  const host = address?.hostname.replace(/^www\./, "");
  const path = address?.pathname.replace(/\/$/, "");
  if (host === "goo.gl") {
    throw new ProfileError(
      `${host}${path} is a short link, which can't be followed from here. Open it in a browser ` +
        "and paste the long address that it leads to: google.com/cardboard/cfg?p=...",
    );
  }
  const isGoogle = host === "google.com" || host === "g.co" || host === "vr.google.com";
  if (!isGoogle || !path?.startsWith("/cardboard")) {
    throw new ProfileError(`This is not a Cardboard viewer's code: ${shortened(pasted)}. ${HOW}`);
  }
  const params = address?.searchParams.get("p");
  if (params) return readParams(params.replaceAll(" ", "+"));
  // The code of a viewer of 2014 has no numbers: it is the address of the project alone.
  if (path === "/cardboard") return CARDBOARD_V1;
  throw new ProfileError(`The viewer's code has no parameter p: ${shortened(pasted)}. ${HOW}`);
}

/** Returns the message about a code that can't be read; "" if it can be read. */
export function faultOfCode(code: string): string {
  try {
    parseProfile(code);
    return "";
  } catch (error) {
    if (!(error instanceof ProfileError)) throw error;
    return error.message;
  }
}

function readAddress(text: string): URL | null {
  try {
    return new URL(text); // not URL.parse, which the browsers of many phones lack
  } catch {
    return null;
  }
}

function readParams(base64: string): Profile {
  let fields: Fields;
  try {
    const standard = base64.replaceAll("-", "+").replaceAll("_", "/").replace(/=+$/, "");
    fields = readFields(Uint8Array.from(atob(standard), (c) => c.charCodeAt(0)));
  } catch (error) {
    // atob throws DOMException for text that is not base64, the reader RangeError for truncated
    // bytes.
    if (!(error instanceof DOMException || error instanceof RangeError)) throw error;
    throw new ProfileError(`The viewer's code is damaged or cut off: ${shortened(base64)}. ${HOW}`);
  }
  const length_m = (field: number, name: string, least: number, most: number) =>
    within(fields.floats(field)[0], name, least, most, "m");
  const angles = fields.floats(5);
  const angle_deg = (i: number, name: string) =>
    within(angles[i], `field of view ${name}`, 5, 85, "degrees");
  const profile: Profile = {
    vendor: fields.text(1),
    model: fields.text(2),
    screenToLens_m: length_m(3, "distance from screen to lens", 0.01, 0.2),
    interLens_m: length_m(4, "distance between the lenses", 0.03, 0.1),
    fov_deg: {
      outer: angle_deg(0, "on the outer side"),
      inner: angle_deg(1, "on the inner side"),
      bottom: angle_deg(2, "at the bottom"),
      top: angle_deg(3, "at the top"),
    },
    alignment: ALIGNMENTS[fields.whole(11) ?? 0] ?? "bottom",
    trayToLens_m:
      fields.whole(11) === 1 && fields.floats(6).length === 0
        ? CARDBOARD_V1.trayToLens_m // a centred phone does not rest on a tray
        : length_m(6, "distance from tray to lens", 0.005, 0.1),
    distortion: fields.floats(7),
    button: BUTTONS[fields.whole(12) ?? 1] ?? "magnet",
  };
  const { outer, inner, bottom, top } = profile.fov_deg;
  const tan = (deg: number) => Math.tan((deg * Math.PI) / 180);
  const corner = Math.hypot(tan(Math.max(outer, inner)), tan(Math.max(bottom, top)));
  if (!isIncreasing(profile.distortion, corner)) {
    const found = profile.distortion.map((k) => k.toPrecision(3)).join(", ");
    throw new ProfileError(
      `The viewer's code: distortion is ${found}, expected one without folds in the image.`,
    );
  }
  return profile;
}

function within(
  value: number | undefined,
  name: string,
  least: number,
  most: number,
  unit: string,
): number {
  // NaN fails both comparisons.
  if (value !== undefined && value >= least && value <= most) return value;
  const found = value === undefined ? "missing" : value.toPrecision(3);
  throw new ProfileError(
    `The viewer's code: ${name} is ${found}, expected ${least} to ${most} ${unit}.`,
  );
}

function shortened(text: string): string {
  return text.length > 60 ? `${text.slice(0, 57)}...` : text;
}
