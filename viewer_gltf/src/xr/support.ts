/** Whether a headset can be used, and if not, the reason for the user. */
import type { XrSupport } from "../state/stereo";

/** The kind of stereo that a touch on the button starts; null: none is useful here. */
export function wayToStereo({ isAvailable }: XrSupport, isPhone: boolean) {
  if (isAvailable) return "stereo";
  return isPhone ? "split" : null;
}

/** Whether augmented reality is supported, by camera or through glasses. */
export async function showsUsersRoom(
  xr: Pick<XRSystem, "isSessionSupported"> | undefined,
  isSecure: boolean,
): Promise<boolean> {
  if (!isSecure || xr === undefined) return false;
  try {
    return await xr.isSessionSupported("immersive-ar");
  } catch (error) {
    if (!(error instanceof DOMException)) throw error;
    return false;
  }
}

/**
 * Returns whether a VR session is supported, or the reason why not.
 * @param xr `navigator.xr`, absent in browsers without WebXR or outside a secure context
 */
export async function findXrSupport(
  xr: Pick<XRSystem, "isSessionSupported"> | undefined,
  isSecure: boolean,
): Promise<XrSupport> {
  if (!isSecure) {
    return { isAvailable: false, reason: "Stereo needs a secure address: https, or localhost." };
  }
  if (xr === undefined) {
    return { isAvailable: false, reason: "This browser has no WebXR, which stereo needs." };
  }
  try {
    if (await xr.isSessionSupported("immersive-vr")) return { isAvailable: true, reason: "" };
  } catch (error) {
    if (!(error instanceof DOMException)) throw error;
    return { isAvailable: false, reason: `The browser refuses WebXR here: ${error.message}` };
  }
  return { isAvailable: false, reason: "No headset or Cardboard viewer was found." };
}
