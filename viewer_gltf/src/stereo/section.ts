/**
 * The panel's sections of stereo: headset, phone in a Cardboard viewer, and moving the specimen.
 */

import { command, controlOf, controlsOf, inline } from "../panel/control_templates";
import type { Button, Control, PanelView, PartSection } from "../panel/controls";
import { LENS_NAMES, LENSES } from "../panel/lenses";
import { MOVES } from "../panel/moves";
import { SCREEN_STEREO, STEREO_PARAMETERS } from "../state/parameters/tools";
import type { StereoSupport, XrSupport } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";

/** The kinds of stereo that are available, and whether stereo is running. */
export type StereoFacts = StereoSupport & Readonly<{ isStereo: boolean }>;

export function stereoSections(
  state: ViewerState,
  facts: StereoFacts,
  view: PanelView,
): readonly PartSection[] {
  return [
    { rank: 80, id: "stereo", label: "Stereo", items: stereoItems(state, facts, view) },
    // on a screen, fingers, wheel and arrow keys move the specimen
    { rank: 20, id: "move", label: "Move", isDeeper: true, items: facts.isStereo ? MOVES : [] },
  ];
}

function availability({ isAvailable, reason }: XrSupport): Pick<Button, "refusal" | "showsReason"> {
  return { refusal: isAvailable ? "" : reason || "This is not available here.", showsReason: true };
}

function stereoItems(state: ViewerState, facts: StereoFacts, view: PanelView): readonly Control[] {
  return [
    ...(facts.isStereo ? [] : [controlOf(SCREEN_STEREO, state)]),
    { ...command("stereo", "Enter stereo (VR)"), ...availability(facts.stereo), isPrimary: true },
    ...(facts.hasRoom ? [command("room", "In your room (AR)")] : []),
    ...(facts.split === null ? [] : splitItems(facts.split, facts, view)),
    ...controlsOf(STEREO_PARAMETERS, state),
  ];
}

/**
 * Controls of the split screen: the lens profile, and the code of a viewer that is not Google's.
 */
function splitItems(
  split: XrSupport,
  { canScan, faultOfCode }: StereoSupport,
  view: PanelView,
): readonly Control[] {
  const { lenses, code } = view;
  const fault = lenses === "own" ? faultOfCode(code) : "";
  const items: Control[] = [
    {
      ...inline("lenses", "Cardboard viewer", lenses, LENS_NAMES, LENSES, (each) => ({
        panel: "lenses",
        lenses: each,
      })),
      isInline: false,
    },
  ];
  if (lenses === "own") {
    items.push({
      kind: "search",
      id: "lens-code",
      label: "Address in the viewer's QR code",
      value: code,
      to: (text) => ({ panel: "code", text }),
    });
    if (canScan) items.push(command("scan", "Scan the code"));
  }
  const support = split.isAvailable && fault !== "" ? { isAvailable: false, reason: fault } : split;
  items.push(command("measure-screen", "Measure the screen with a card"));
  return [...items, { ...command("split", "Split screen"), ...availability(support) }];
}
