/**
 * Holds the phone's screen while the phone is in a viewer: full screen, landscape, awake. Some
 * browsers lack some of these features (Safari on an iPhone has no full screen and no orientation
 * lock), so none is required. Each refused feature is reported.
 */
export type ScreenHold = Readonly<{ problems: readonly string[]; release: () => void }>;

/** The parts of the page that are used, so that tests can stand in for other browsers. */
export type ScreenHost = Readonly<{
  document: Document;
  navigator: { wakeLock?: Pick<WakeLock, "request"> };
  screen: { orientation?: { lock?: (way: "landscape") => Promise<void>; unlock?: () => void } };
}>;

type OldElement = { webkitRequestFullscreen?: () => void };
type OldDocument = { webkitFullscreenElement?: Element | null; webkitExitFullscreen?: () => void };

const NO_FULL_SCREEN =
  "This browser can't show a page in full screen. On an iPhone, add the page to the home screen " +
  "and open it from there.";
const NO_WAKE_LOCK = "This browser can't keep the screen on. The phone may dim after a while.";

/**
 * Holds the screen, and returns the features that the browser refused. Must be called from a tap.
 * Never rejects.
 *
 * @param onLeave called when the user leaves full screen without `release`
 */
export async function holdScreen(
  element: HTMLElement,
  onLeave: () => void,
  host: ScreenHost = globalThis,
): Promise<ScreenHold> {
  const { document, navigator } = host;
  const orientation = host.screen.orientation;
  const problems: string[] = [];
  const released = new AbortController();
  const { signal } = released;
  let sentinel: WakeLockSentinel | null = null;
  const matches = (query: string) => document.defaultView?.matchMedia(query).matches === true;

  const stayAwake = async (): Promise<boolean> => {
    try {
      const fresh = await navigator.wakeLock?.request("screen");
      if (fresh === undefined) return false;
      if (signal.aborted) await fresh.release();
      else sentinel = fresh;
      return true;
    } catch (error) {
      if (!(error instanceof DOMException)) throw error;
      return false; // for example with a low battery
    }
  };
  // The wake lock comes first: Safari requires a tap for it, and full screen uses the tap up.
  const awake = stayAwake();

  // A page opened from the home screen is in full screen already.
  const isFull = await enterFullScreen(element);
  if (!isFull && !matches("(display-mode: standalone)")) problems.push(NO_FULL_SCREEN);
  for (const type of isFull ? ["fullscreenchange", "webkitfullscreenchange"] : []) {
    document.addEventListener(type, () => fullElement(document) === null && onLeave(), { signal });
  }

  // Android locks the orientation in full screen only. Without a lock, the turn sign asks the user.
  await succeeds(orientation?.lock?.call(orientation, "landscape"));

  if (!(await awake)) problems.push(NO_WAKE_LOCK);
  // A hidden page loses its wake lock.
  const renew = () => void (document.visibilityState === "visible" && stayAwake());
  document.addEventListener("visibilitychange", renew, { signal });

  return {
    problems,
    release: () => {
      if (signal.aborted) return;
      released.abort();
      void sentinel?.release();
      orientation?.unlock?.();
      if (fullElement(document) !== null) leaveFullScreen(document);
    },
  };
}

async function enterFullScreen(element: HTMLElement & OldElement): Promise<boolean> {
  if (typeof element.requestFullscreen === "function") {
    return succeeds(element.requestFullscreen({ navigationUI: "hide" }));
  }
  element.webkitRequestFullscreen?.(); // an iPad before iPadOS 16.4
  return element.webkitRequestFullscreen !== undefined;
}

function leaveFullScreen(document: Document & OldDocument): void {
  if (typeof document.exitFullscreen === "function") {
    void document.exitFullscreen().catch(() => undefined); // the user has left full screen already
  } else document.webkitExitFullscreen?.();
}

function fullElement(document: Document & OldDocument): Element | null {
  return document.fullscreenElement ?? document.webkitFullscreenElement ?? null;
}

/** Whether the browser has the feature and did not refuse it. */
async function succeeds(asked: Promise<void> | undefined): Promise<boolean> {
  if (asked === undefined) return false;
  return asked.then(
    () => true,
    () => false,
  );
}
