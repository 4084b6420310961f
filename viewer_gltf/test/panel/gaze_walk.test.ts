/** A walk through the whole panel in stereo by gaze alone: no button, no controller, no key. */
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { prepareHands } from "../support/xr/stand";

describeInChromium("by gaze alone", () => {
  const hands = prepareHands({ width: 64, height: 32 }); // no test looks at the pixels

  it.runIf(IS_EXHAUSTIVE)(
    "the panel is opened, every control of every page responds, and stereo is ended",
    async () => {
      await hands().gazeOnly();
      const { walked, silent, commands, kinds, isClosed, leaves } = await hands().page.evaluate(
        () => {
          const { hands } = window;
          const DWELL_S = 1.7;
          const gaze = (id: string) => {
            hands.gazeFor(id, DWELL_S);
            const after = seen();
            // away from the panel: the control can be chosen again, and its notice has gone
            hands.gazeFor(null, 6);
            return after;
          };
          /** All visible effects of a response. */
          const seen = () => {
            const { notices, position, scale, ...status } = hands.status();
            // Undo disappears by itself, and the button for the next page has the number of the
            // page in its label
            const regions = status.labels.filter((label) => !label.startsWith("Undo the last"));
            const asked = [hands.actions.length, hands.commands.length, hands.leaves];
            return JSON.stringify([regions, notices, position, scale, asked]);
          };
          const regions = () => hands.status().regions;
          const ofBar = new Set(["leave", "close", "more", "up", "undo-choice"]);
          const walked: string[] = [];
          const silent: string[] = [];

          const walkPages = () => {
            const done = new Set<string>();
            const isNew = (id: string) =>
              !id.startsWith("tab=") && !ofBar.has(id) && !done.has(id) && !id.endsWith("/open");
            const swatches = new Set<string>();
            for (let pages = 0; pages < 20; pages++) {
              // a choice may add or remove controls
              for (let id = regions().find(isNew); id !== undefined; id = regions().find(isNew)) {
                done.add(id);
                const before = seen();
                if (gaze(id) === before) silent.push(id);
                walked.push(id);
              }
              for (const id of regions().filter((each) => each.endsWith("/open"))) {
                if (swatches.has(id)) continue;
                swatches.add(id);
                walkGroup(id);
              }
              if (!regions().includes("more")) break;
              gaze("more");
              if (!regions().some(isNew) && pages > 3) break;
            }
          };
          /** Tries the page of a channel or lamp, to which the colours lead that its swatch shows. */
          const walkGroup = (swatch: string) => {
            const more = swatch.replace("/open", "/more");
            hands.gazeFor(swatch, 0.6);
            hands.gazeFor(regions().includes(more) ? more : swatch, DWELL_S);
            hands.gazeFor(null, 6);
            walked.push(swatch);
            walkPages();
            gaze("up");
          };
          const toList = () => {
            while (regions().includes("up")) gaze("up");
          };
          const sections = () => {
            toList();
            const found = new Set<string>();
            for (let before = -1; found.size > before; gaze("more")) {
              before = found.size;
              for (const id of regions().filter((each) => each.startsWith("tab="))) found.add(id);
            }
            return [...found];
          };

          gaze("opener");
          for (const tab of sections()) {
            toList();
            while (!regions().includes(tab)) gaze("more");
            gaze(tab);
            walkPages();
          }
          gaze("close");
          const isClosed = !hands.status().isOpen;
          gaze("opener");
          gaze("leave");
          const kinds = hands.actions.map((action) => ("id" in action ? action.id : action.type));
          return {
            walked,
            silent,
            commands: hands.commands,
            kinds,
            isClosed,
            leaves: hands.leaves,
          };
        },
      );
      expect(silent).toEqual([]);
      expect(walked.length).toBeGreaterThan(60);
      expect(new Set(commands)).toEqual(
        new Set([
          ...["front", "side", "top", "reset", "back", "share"],
          ...["zoom-in", "zoom-out", "turn-left", "turn-right", "turn-up", "turn-down"],
          ...["pan-left", "pan-right", "pan-up", "pan-down"],
        ]),
      );
      for (const kind of ["mode", "show", "select", "set-clip", "quality", "tool", "opacity"]) {
        expect(kinds).toContain(kind);
      }
      expect([isClosed, leaves]).toEqual([true, 1]);
    },
  );
});
