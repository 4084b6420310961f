/**
 * Permissions that browsers grant only within the call of a tap. They are asked for before anything
 * is awaited, even before the rest of this folder is loaded.
 */
import { holdScreen, type ScreenHold } from "./screen";

export type OrientationAnswer = "granted" | "refused" | "absent";

export type StereoPermissions = Readonly<{
  /** The element that fills the screen and covers the page. */
  stage: HTMLElement;
  orientation: Promise<OrientationAnswer>;
  screen: Promise<ScreenHold>;
}>;

/**
 * Asks for the permissions of stereo. Must be called from a tap. Safari's question about the
 * orientation comes first, because a tap permits only one question.
 *
 * @param onLeave called when the user leaves full screen
 */
export function askInTap(canvas: HTMLElement, onLeave: () => void): StereoPermissions {
  const stage = canvas.parentElement ?? canvas;
  return { stage, orientation: askOrientation(), screen: holdScreen(stage, onLeave) };
}

type AskingEvent = { requestPermission?: () => Promise<PermissionState> };

/** Asks to read the orientation. Safari asks the user, and only within the call of a tap. */
export async function askOrientation(scope: object = globalThis): Promise<OrientationAnswer> {
  const { DeviceOrientationEvent } = scope as { DeviceOrientationEvent?: AskingEvent };
  if (DeviceOrientationEvent === undefined) return "absent";
  if (DeviceOrientationEvent.requestPermission === undefined) return "granted";
  try {
    return (await DeviceOrientationEvent.requestPermission()) === "granted" ? "granted" : "refused";
  } catch (error) {
    if (!(error instanceof Error)) throw error;
    return "refused"; // NotAllowedError: not called within a tap
  }
}
