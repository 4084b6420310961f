/** Faults of the bundle, the host and the network, as notices to the user. */
import { BundleError, TemporaryError } from "../bundle/errors";
import type { Action } from "../state/actions";
import type { ViewerState } from "../state/viewer_state";

/** Notice that stands while the graphics driver may still give the picture back. */
export const DROPPED = "The graphics driver has dropped the picture. The page draws it again.";
const WAITING =
  "The host does not answer. The page tries again, and what has loaded stays on screen.";
const OFFLINE =
  "This device is offline. Parts that it has not shown before appear once it is online.";
/** A fault of a file that makes surfaces or volumes finer, where coarse ones show. */
const FINER = /^(channels|volumes)\/\S+\.(glb|ktx2):/;

export type FaultsOptions = Readonly<{
  state: () => ViewerState;
  dispatch: (action: Action) => void;
  /** Whether a part of the picture is missing, not merely coarse. */
  isIncomplete: () => boolean;
}>;

export class Faults {
  constructor(private readonly options: FaultsOptions) {}

  /** Shows a fault of the bundle or the network; throws any other error. */
  report(error: unknown): void {
    if (!(error instanceof BundleError)) throw error;
    const { state, dispatch, isIncomplete } = this.options;
    const isOffline = navigator.onLine === false;
    if (isOffline && FINER.test(error.message) && !isIncomplete()) return;
    const isRetryable = isOffline || error instanceof TemporaryError;
    const text = isOffline
      ? OFFLINE
      : error instanceof TemporaryError
        ? error.notice
        : error.message;
    // it would be reported again for each of a host's files
    if (isRetryable && state().retryable.includes(text)) return;
    dispatch({ type: "notify", text, isRetryable });
  }

  /**
   * Shows a notice while files are awaited. A device without a network gets it only if the picture is incomplete.
   *
   * @param files number of files that wait for another try; 0 takes the notice away
   */
  noteWaiting(files: number): void {
    const { state, dispatch, isIncomplete } = this.options;
    const text = navigator.onLine ? WAITING : OFFLINE;
    // A file that was awaited in vain keeps its notice until it arrives.
    const passing = [WAITING, OFFLINE].filter((each) => !state().retryable.includes(each));
    if (files === 0) dispatch({ type: "dismiss", texts: passing });
    else if (state().notices.includes(text)) return;
    else if (navigator.onLine ? files === 1 : isIncomplete()) dispatch({ type: "notify", text });
  }
}
