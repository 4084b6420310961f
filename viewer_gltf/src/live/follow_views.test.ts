import { expect, it } from "vitest";
import { ViewFollower } from "./follow_views";

const ROOT = "http://localhost:8000/";
const view = (folder: string) => ({ folder, hasBundle: false });
const BUNDLE = { folder: "g3/", hasBundle: true };

/** A page that shows views; the test decides when it has finished showing each one. */
function page() {
  const shown: string[] = [];
  const waiting: (() => void)[] = [];
  let faults = 0;
  return {
    shown,
    failNext: () => faults++,
    goOn: async () => {
      waiting.shift()?.();
      await new Promise((resolve) => setTimeout(resolve, 5));
    },
    show: async (base: string) => {
      shown.push(base);
      if (faults-- > 0) throw new Error("no network");
      faults = 0;
      await new Promise<void>((resolve) => waiting.push(resolve));
    },
  };
}

it("a page that follows a build shows each newer view exactly once", async () => {
  const { show, shown, goOn } = page();
  const views = new ViewFollower(ROOT, "", show);
  views.take(view(""));
  expect(shown).toEqual([]);
  views.take(view("g1/"));
  views.take(view("g1/"));
  await goOn();
  views.take(view("g2/"));
  await goOn();
  expect(shown).toEqual([`${ROOT}g1/`, `${ROOT}g2/`]);
});

it("a page that follows a build skips views that became outdated while another was opening", async () => {
  const { show, shown, goOn } = page();
  const views = new ViewFollower(ROOT, "", show);
  views.take(view("g1/"));
  views.take(view("g2/"));
  views.take(view("g3/"));
  views.take(BUNDLE);
  await goOn();
  await goOn();
  expect(shown).toEqual([`${ROOT}g1/`, ROOT]);
});

it("shows the bundle last, at the page's own address, even if the first view had that address", async () => {
  const { show, shown, goOn } = page();
  const changes: boolean[] = [];
  const views = new ViewFollower(ROOT, "", show, () => changes.push(views.isNewestShown));
  views.take(BUNDLE);
  expect(views.isNewestShown).toBe(false);
  await goOn();
  views.take(BUNDLE);
  expect(shown).toEqual([ROOT]);
  expect(changes).toEqual([true]);
});

it("a page that follows a build tries a view again that could not be shown", async () => {
  const { show, shown, goOn, failNext } = page();
  const views = new ViewFollower(ROOT, `${ROOT}g1/`, show, undefined, 1);
  failNext();
  views.take(view("g2/"));
  await expect.poll(() => shown).toEqual([`${ROOT}g2/`, `${ROOT}g2/`]);
  await goOn();
});
