/** Starts the split screen of a phone in a Cardboard viewer, without WebXR. */

import type { Profile } from "../xr/cardboard/viewer_profile";
import type { PartHost } from "./part";

/** Must be called within a tap. Throws BundleError with a message if the browser or the user refuses. */
export async function startSplit(host: PartHost, profile: Profile): Promise<void> {
  const problems = await host.stereo.startSplit(profile);
  for (const text of problems) host.dispatch({ type: "notify", text });
}
