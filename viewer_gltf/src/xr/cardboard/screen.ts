/**
 * The phone's screen while it is in a viewer: full, held across, and awake. Each is a favour that
 * some browser doesn't do (an iPhone's Safari has no full screen and no lock), so none is needed:
 * each refused feature is reported.
 */
export type ScreenHold = Readonly<{ problems: readonly string[]; release: () => void }>;

/** The parts of the page that are used, so that tests can be other browsers. */
export type ScreenHost = Readonly<{
  document: Document;
  navigator: { wakeLock?: Pick<WakeLock, "request"> };
  screen: { orientation?: { lock?: (way: "landscape") => Promise<void>; unlock?: () => void } };
}>;

type OldElement = { webkitRequestFullscreen?: () => void };
type OldDocument = { webkitFullscreenElement?: Element | null; webkitExitFullscreen?: () => void };

const NO_FULL_SCREEN =
  "This browser gives no full screen to a page: on an iPhone, add the page to the home screen, " +
  "and open it from there.";
const NO_WAKE_LOCK = "This browser can't keep the screen on: the phone may dim after a while.";

/**
 * Must be called from a tap. Never rejects.
 *
 * @param onLeave called when the user leaves full screen by other means than `release`
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
      return false; // a low battery
    }
  };
  const awake = stayAwake(); // Safari wants the tap for it, which full screen uses up

  // A home screen's page is full without asking.
  const isFull = await enterFullScreen(element);
  if (!isFull && !matches("(display-mode: standalone)")) problems.push(NO_FULL_SCREEN);
  for (const type of isFull ? ["fullscreenchange", "webkitfullscreenchange"] : []) {
    document.addEventListener(type, () => fullElement(document) === null && onLeave(), { signal });
  }

  // Android locks in full screen only.
  await succeeds(orientation?.lock?.call(orientation, "landscape")); // else the turn sign asks for it

  if (!(await awake)) problems.push(NO_WAKE_LOCK);
  // A page that was hidden has lost its lock.
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
    void document.exitFullscreen().catch(() => undefined); // the user was quicker
  } else document.webkitExitFullscreen?.();
}

function fullElement(document: Document & OldDocument): Element | null {
  return document.fullscreenElement ?? document.webkitFullscreenElement ?? null;
}

/** Whether what was asked for is there, and was not refused. */
async function succeeds(asked: Promise<void> | undefined): Promise<boolean> {
  if (asked === undefined) return false;
  return asked.then(
    () => true,
    () => false,
  );
}
