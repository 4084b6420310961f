/**
 * Buttons in the corner of the view that leave the flat screen: stereo, augmented reality, full
 * screen. Unavailable ones are hidden.
 */
import { fileAddress } from "../../bundle/fetch";
import type { Bundle } from "../../bundle/load";
import { element } from "../../dom/element";
import { isFullScreen } from "../../dom/full_screen";

const IN_ROOM = "View in your room";
/** A box on a floor and a text, as an image, because Quick Look allows no text in the link. */
const LABEL =
  '<svg xmlns="http://www.w3.org/2000/svg" width="140" height="24"><g fill="none" stroke="#e6e9f0" ' +
  'stroke-width="1.6" stroke-linejoin="round"><path d="M12 3l7 4v8l-7 4-7-4V7zM5 7l7 4 7-4M12 11v8"/>' +
  '<path d="M2 20l10 3 10-3" opacity=".5"/></g><text x="30" y="17" fill="#e6e9f0" font-size="13" ' +
  `font-family="system-ui, sans-serif" textLength="108">${IN_ROOM}</text></svg>`;

/** Returns whether a link opens a viewer of augmented reality here, as on iOS. */
function opensAr(): boolean {
  const { relList } = document.createElement("a");
  return relList?.supports?.("ar") === true;
}

/** Returns the address of the file that this device shows in the user's room; null: none. */
export function arAddress({ base, manifest }: Bundle): string | null {
  const usdz = manifest.usdz ?? null;
  return usdz !== null && opensAr() ? fileAddress(base, usdz.path) : null;
}

export class EntryButtons {
  private readonly stereo = button("Stereo", "stereo");
  private readonly room = button("In your room", "room");
  /** Quick Look requires exactly one image in the link. */
  private readonly link = element(
    "a",
    { rel: "ar", hidden: true, className: "way", title: IN_ROOM },
    { overlay: "ar" },
    element("img", {
      src: `data:image/svg+xml,${encodeURIComponent(LABEL)}`,
      alt: IN_ROOM,
      width: 140,
      height: 24,
    }),
  );
  private readonly full = button("", "full-screen");
  readonly root = element(
    "div",
    { className: "ways-in" },
    {},
    ...[this.link, this.room, this.stereo, this.full],
  );

  /** @param onClick called within the click, which browsers require */
  offerFullScreen(onClick: () => void): void {
    this.full.hidden = false;
    this.full.onclick = onClick;
    const updateButton = () => {
      const isFull = isFullScreen();
      this.full.classList.toggle("is-full", isFull);
      this.full.ariaLabel = isFull ? "Leave the full screen" : "Full screen";
      this.full.title = `${this.full.ariaLabel} (Shift+Enter)`;
    };
    document.addEventListener("fullscreenchange", updateButton);
    updateButton();
  }

  /** @param onClick called within the click, which browsers require */
  offerStereo(way: "stereo" | "split" | null, onClick: () => void): void {
    this.stereo.hidden = way === null;
    this.stereo.title =
      way === "split" ? "Split the screen for a Cardboard viewer" : "Enter stereo";
    this.stereo.onclick = onClick;
  }

  /** @param onClick called within the click, which browsers require */
  offerRoom(onClick: () => void): void {
    this.room.hidden = false;
    this.room.title = "See the specimen in your room through this device's camera";
    this.room.onclick = onClick;
  }

  /** @param address address of a .usdz file */
  offerLink(address: string): void {
    this.link.href = address;
    this.link.hidden = false;
  }
}

function button(text: string, overlay: string): HTMLButtonElement {
  return element(
    "button",
    { type: "button", className: "way", textContent: text, hidden: true },
    { overlay },
  );
}
