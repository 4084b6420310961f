/** A walk through all of the panel in stereo by gaze alone: no button, no controller, no key. */
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { prepareHands } from "../support/xr/stand";

describeInChromium("by gaze alone", () => {
  const hands = prepareHands({ width: 64, height: 32 }); // nobody looks at it

  it.runIf(IS_EXHAUSTIVE)(
    "the panel is opened, every control of every page answers, and stereo is left",
    async () => {
      await hands().gazeOnly();
      const { walked, silent, commands, kinds, isClosed, leaves } = await hands().page.evaluate(
        () => {
          const { hands } = window;
          const DWELL_S = 1.7;
          const gaze = (id: string) => {
            hands.gazeFor(id, DWELL_S);
            const after = seen();
            hands.gazeFor(null, 6); // away: the same may be chosen again, and what was told has gone
            return after;
          };
          /** What there is to be seen of an answer. */
          const seen = () => {
            const { regions, told, position, scale } = hands.status();
            const asked = [hands.actions.length, hands.commands.length, hands.leaves];
            return JSON.stringify([regions, told, position, scale, asked]);
          };
          const regions = () => hands.status().regions;

          gaze("opener");
          const walked: string[] = [];
          const silent: string[] = [];
          for (const tab of regions().filter((id) => id.startsWith("tab="))) {
            gaze(tab);
            const ofTab = new Set<string>();
            for (let pages = 0; pages < 20; pages++) {
              const isNew = (id: string) =>
                !id.startsWith("tab=") &&
                !["leave", "close", "more"].includes(id) &&
                !ofTab.has(id);
              // what is chosen may bring others, or take some away
              for (let id = regions().find(isNew); id !== undefined; id = regions().find(isNew)) {
                ofTab.add(id);
                const before = seen();
                if (gaze(id) === before) silent.push(id);
                walked.push(id);
              }
              if (!regions().includes("more")) break;
              gaze("more");
              if (!regions().some(isNew) && pages > 3) break;
            }
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
