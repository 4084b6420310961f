/** The panel's sections of stereo: a headset, or a phone in a viewer of lenses, and what the gaze does. Pure. */

import { command, controlOf, controlsOf, inline } from "../panel/control_templates";
import type { Button, Control, PanelView, PartSection } from "../panel/controls";
import { LENS_NAMES, LENSES } from "../panel/lenses";
import { MOVES } from "../panel/moves";
import { SCREEN_STEREO, STEREO_PARAMETERS } from "../state/parameters/tools";
import type { StereoSupport, XrSupport } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";

/** The stereo that there is, and whether the panel is in it. */
export type StereoFacts = StereoSupport & Readonly<{ isStereo: boolean }>;

export function stereoSections(
  state: ViewerState,
  facts: StereoFacts,
  view: PanelView,
): readonly PartSection[] {
  return [
    { rank: 80, id: "stereo", label: "Stereo", items: stereoItems(state, facts, view) },
    // a screen has fingers, wheel and arrow keys for it
    { rank: 20, id: "move", label: "Move", isDeeper: true, items: facts.isStereo ? MOVES : [] },
  ];
}

function onlyIf({ isAvailable, reason }: XrSupport): Pick<Button, "refusal" | "showsReason"> {
  return { refusal: isAvailable ? "" : reason || "It can't be had here.", showsReason: true };
}

function stereoItems(state: ViewerState, facts: StereoFacts, view: PanelView): readonly Control[] {
  return [
    ...(facts.isStereo ? [] : [controlOf(SCREEN_STEREO, state)]),
    { ...command("stereo", "Enter stereo (VR)"), ...onlyIf(facts.stereo), isPrimary: true },
    ...(facts.hasRoom ? [command("room", "In your room (AR)")] : []),
    ...(facts.split === null ? [] : splitItems(facts.split, facts, view)),
    ...controlsOf(STEREO_PARAMETERS, state),
  ];
}

/** A phone in a viewer of lenses: which one, and the code of one that is not Google's. */
function splitItems(
  split: XrSupport,
  { canScan, faultOfCode }: StereoSupport,
  view: PanelView,
): readonly Control[] {
  const { lenses, code } = view;
  const fault = lenses === "own" ? faultOfCode(code) : "";
  const items: Control[] = [
    {
      ...inline("lenses", "Phone viewer", lenses, LENS_NAMES, LENSES, (each) => ({
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
      label: "What the viewer's QR code says",
      value: code,
      to: (text) => ({ panel: "code", text }),
    });
    if (canScan) items.push(command("scan", "Scan the code"));
  }
  const support = split.isAvailable && fault !== "" ? { isAvailable: false, reason: fault } : split;
  items.push(command("measure-screen", "Measure the screen by a card"));
  return [...items, { ...command("split", "Split screen"), ...onlyIf(support) }];
}
