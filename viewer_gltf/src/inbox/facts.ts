/** The part of a card that shows an image: its middle slices with contours, its facts, its notes. */
import { element } from "../dom/element";
import { sizeText } from "../math/length_text";
import { inPageWords } from "./page_words";
import { NAMES } from "./setting_names";
import type { Understood } from "./understood";
import { bytesText } from "./words";

/** @param address of an image below the item's folder */
export function slicesView(
  { slices, title, channels }: Understood,
  address: (image: string) => string,
): HTMLElement {
  const hasContours = channels.some(({ hasSurface }) => hasSurface);
  const figures = slices.map(({ axis, name, image }) => {
    const alt = `Middle ${name} slice of ${title}${hasContours ? ", with the proposed surface as a contour" : ""}`;
    const picture = element("img", { alt, src: address(image), decoding: "async" });
    return element("figure", {}, { slice: axis }, picture);
  });
  const view = element("div", { className: "slices-row" }, {}, ...figures);
  view.hidden = figures.length === 0;
  return view;
}

export function factsView(understood: Understood): HTMLElement {
  const rows = factsOf(understood).map(([label, text]) =>
    element(
      "div",
      {},
      {},
      element("dt", { textContent: label }),
      element("dd", { textContent: text }),
    ),
  );
  return element("dl", { className: "facts" }, {}, ...rows);
}

/** Format and size in one line, for a card that is collapsed. */
export function summaryOf({ format, sizeText }: Understood): string {
  return [format, sizeText].filter((part) => part !== "").join(" · ");
}

/** Returns labels with their texts. Unknown values are left out. */
export function factsOf(understood: Understood): readonly (readonly [string, string])[] {
  const { format, modality, voxels, spacing_um, tiles, bytesEstimate } = understood;
  const built = [
    tiles > 0 ? `${tiles} ${tiles === 1 ? "tile" : "tiles"}` : "",
    bytesEstimate > 0 ? `about ${bytesText(bytesEstimate)}` : "",
  ];
  const rows: readonly (readonly [string, string])[] = [
    ["Format", [format, modality].filter((part) => part !== "").join(", ")],
    ["Size", understood.sizeText],
    ["Voxels", voxels.join(" × ")],
    [NAMES.spacing, spacingText(spacing_um)],
    ["When built", built.filter((part) => part !== "").join(", ")],
  ];
  return rows.filter(([, text]) => text !== "");
}

/** Writes a voxel spacing in mm from 0.1 mm on, as scanners do, and in a shorter unit below. */
export function spacingText(spacing_um: readonly number[]): string {
  if (spacing_um.length !== 3) return "";
  if (Math.max(...spacing_um) < 100) return sizeText(spacing_um);
  const texts = spacing_um.map((each) => String(Number((each / 1000).toPrecision(3))));
  return `${texts.join(" × ")} mm`;
}

/** Notes on contradictions and assumptions. The first three are visible, and the others can be unfolded. */
export function notesView({ notes }: Understood): HTMLElement {
  const listOf = (some: readonly string[]) =>
    element("ul", {}, {}, ...some.map((note) => element("li", { textContent: inPageWords(note) })));
  const SHOWN = 3;
  const view = element("div", { className: "notes" });
  view.hidden = notes.length === 0;
  if (notes.length <= SHOWN) {
    view.append(listOf(notes));
    return view;
  }
  const rest = notes.length - SHOWN;
  const summary = element("summary", {
    textContent: `${rest} more note${rest === 1 ? "" : "s"}`,
  });
  view.append(
    listOf(notes.slice(0, SHOWN)),
    element("details", {}, {}, summary, listOf(notes.slice(SHOWN))),
  );
  return view;
}
