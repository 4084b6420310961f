/**
 * What browsers grant only in the call of a tap itself. It is asked before anything is waited for,
 * even for the rest of this folder, which is fetched when it is first wanted.
 */
import { holdScreen, type ScreenHold } from "./screen";

export type OrientationAnswer = "granted" | "refused" | "absent";

export type Asked = Readonly<{
  /** What is held, and is to cover the page. */
  stage: HTMLElement;
  orientation: Promise<OrientationAnswer>;
  screen: Promise<ScreenHold>;
}>;

/**
 * Must be called from a tap. Safari's question comes first, since a tap is used up.
 *
 * @param onLeave called when the user leaves full screen
 */
export function askInTap(canvas: HTMLElement, onLeave: () => void): Asked {
  const stage = canvas.parentElement ?? canvas;
  return { stage, orientation: askOrientation(), screen: holdScreen(stage, onLeave) };
}

type AskingEvent = { requestPermission?: () => Promise<PermissionState> };

/** Ask to read the orientation. Safari asks the user, and only within a tap's own call. */
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
