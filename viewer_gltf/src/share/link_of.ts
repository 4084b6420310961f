/** Makes the link to the view that the viewer shows. */
import type { PartHost } from "../host/part";
import type { CameraView } from "../state/camera_view";
import type { ObjectView } from "../state/objects";
import type { ViewerState } from "../state/viewer_state";
import { writeLink } from "./permalink";

/**
 * @param start the state in which the page opens; a link contains only differences from it
 * @param view a camera in place of the present one
 */
export function linkOf(
  host: PartHost,
  start: ViewerState,
  view: Readonly<{ state: ViewerState; camera: CameraView | null }> = {
    state: host.state,
    camera: host.viewpoint.cameraView,
  },
): string {
  const objects = host.service("objects");
  const linked = (channel: string, of: ObjectView) =>
    objects?.linked(channel, of)?.text ?? of.linked;
  return writeLink(view.state, start, view.camera, linked);
}

/** Returns the number of objects in lists that are too long for a link. */
export function leftOutOfLink(host: PartHost): number {
  const objects = host.service("objects");
  return Object.entries(host.state.objects).reduce(
    (sum, [id, view]) => sum + (objects?.linked(id, view)?.leftOut ?? 0),
    0,
  );
}
