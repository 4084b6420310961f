/** Reports faults of the bundle, the host and the network as notices to the user. */
import { BundleError, TemporaryError } from "../bundle/errors";
import type { Action } from "../state/actions";
import type { ViewerState } from "../state/viewer_state";

/** Notice that is shown while the graphics driver may still restore the context. */
export const DROPPED = "The graphics driver has dropped the view. The page is drawing it again.";
const WAITING = "The host does not answer. The page keeps trying; loaded parts stay on screen.";
const OFFLINE = "This device is offline. Parts that are not loaded yet appear once it is online.";
/**
 * Matches messages about files that only refine surfaces or volumes, so that coarser data stay on
 * screen without them.
 */
const FINER = /^(channels|volumes)\/\S+\.(glb|ktx2):/;

export type FaultsOptions = Readonly<{
  state: () => ViewerState;
  dispatch: (action: Action) => void;
  /** Whether some data of the view is not on screen at all, not even at a coarse resolution. */
  isIncomplete: () => boolean;
}>;

export class Faults {
  constructor(private readonly options: FaultsOptions) {}

  /** Shows a fault of the bundle or the network as a notice; throws any other error. */
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
    // one notice is enough for all files of a host
    if (isRetryable && state().retryable.includes(text)) return;
    dispatch({ type: "notify", text, isRetryable });
  }

  /**
   * Shows a notice while files are awaited. If the device is offline, the notice appears only if
   * the view is incomplete.
   *
   * @param files number of files that wait for another attempt; 0 removes the notice
   */
  noteWaiting(files: number): void {
    const { state, dispatch, isIncomplete } = this.options;
    const text = navigator.onLine ? WAITING : OFFLINE;
    // a notice about files whose attempts have ended stays until a retry loads them
    const passing = [WAITING, OFFLINE].filter((each) => !state().retryable.includes(each));
    if (files === 0) dispatch({ type: "dismiss", texts: passing });
    else if (state().notices.includes(text)) return;
    else if (navigator.onLine ? files === 1 : isIncomplete()) dispatch({ type: "notify", text });
  }
}
