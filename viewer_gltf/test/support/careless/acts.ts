/** The acts of a careless user. */
import type { Locator } from "playwright-core";
import { type Act, choose, type Reader } from "./walk";

/** Controls that open other windows or files, affect the next test, or have an act of their own. */
const LEFT_OUT =
  /^(save-|own-light|scan|measure-screen|stereo|split|room|share|link|keys|letters|full|find-channel|undo|redo|retry)/;

type Place = readonly [x: number, y: number];

async function somewhere({ page, random }: Reader, selector: string): Promise<Place> {
  const box = await page.locator(selector).first().boundingBox();
  const { x, y, width, height } = box ?? { x: 0, y: 0, width: 100, height: 100 };
  return [x + (0.1 + 0.8 * random()) * width, y + (0.1 + 0.8 * random()) * height];
}

async function drag(reader: Reader): Promise<void> {
  const { page, random } = reader;
  const [x, y] = await somewhere(reader, ".stage canvas");
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 120 * (random() - 0.5), y + 80 * (random() - 0.5), { steps: 3 });
  await page.mouse.up();
}

const turnAWindow = async ({ page }: Reader) => {
  const { width, height } = page.viewportSize() ?? { width: 640, height: 480 };
  await page.setViewportSize({ width: height, height: width });
};

/** Moves a slider in several steps, like a hand. */
async function slide({ random }: Reader, slider: Locator): Promise<void> {
  const most = Number(await slider.getAttribute("max"));
  for (let i = 0; i < 3; i++) await slider.fill(String(Math.round(random() * most)));
}

/** @returns name of the control */
async function operate(reader: Reader, control: Locator): Promise<string> {
  const { random } = reader;
  const [tag, type, name] = await control.evaluate((each) => [
    each.tagName,
    (each as HTMLInputElement).type,
    (each as HTMLElement).dataset.control ?? "",
  ]);
  if (tag === "SELECT") {
    const values = await control.evaluate((each) =>
      [...(each as HTMLSelectElement).options].map(({ value }) => value),
    );
    await control.selectOption(choose(random, values));
  } else if (type === "range") await slide(reader, control);
  else if (type === "color") {
    await control.fill(
      `#${Math.floor(random() * 0xffffff)
        .toString(16)
        .padStart(6, "0")}`,
    );
  } else if (tag === "BUTTON" || type === "checkbox" || type === "radio") {
    await control.evaluate((each) => (each as HTMLElement).click());
  }
  return name;
}

async function someControl({ page, random }: Reader, selector: string): Promise<Locator | null> {
  const all = page.locator(`.panel ${selector}:visible:not([disabled])`);
  const ids = await all.evaluateAll((found) =>
    found.map((each) => (each as HTMLElement).dataset.control ?? ""),
  );
  const left = [...ids.keys()].filter((i) => !LEFT_OUT.test(ids[i]));
  return left.length === 0 ? null : all.nth(choose(random, left));
}

const CHOICES = [
  "selected",
  "isolated",
  "objects",
  "measured",
  "measuredAs",
  "measurements",
] as const;

export const ACTS: readonly Act[] = [
  {
    name: "rest anywhere",
    changes: [],
    weight: 4,
    run: async (reader) => {
      await reader.page.mouse.move(
        ...(await somewhere(reader, choose(reader.random, [".stage", ".panel"]))),
      );
      await reader.page.waitForTimeout(300 + 1200 * reader.random());
    },
  },
  { name: "turn", changes: ["look"], weight: 3, run: drag },
  {
    name: "click the picture",
    changes: CHOICES,
    weight: 2,
    run: async (reader) => {
      await reader.page.waitForTimeout(450); // not the second click of a double click
      await reader.page.mouse.click(...(await somewhere(reader, ".stage canvas")));
      await reader.page.waitForTimeout(450);
    },
  },
  {
    name: "double click the picture",
    changes: ["look", ...CHOICES],
    weight: 2,
    run: async (reader) => {
      await reader.page.mouse.dblclick(...(await somewhere(reader, ".stage canvas")));
      // the flight begins after the structure at that place is known
      await reader.page.waitForTimeout(2500);
    },
  },
  {
    name: "wheel over the picture",
    changes: ["look"],
    weight: 2,
    run: async (reader) => {
      await reader.page.mouse.move(...(await somewhere(reader, ".stage canvas")));
      await reader.page.mouse.wheel(0, 240 * (reader.random() - 0.5));
    },
  },
  {
    name: "operate a control",
    changes: ["any", "look"],
    weight: 6,
    run: async (reader) => {
      const control = await someControl(reader, "[data-control]");
      return control === null ? "none" : operate(reader, control);
    },
  },
  {
    name: "open or close a section or a card",
    changes: [],
    weight: 3,
    run: async ({ page, random }) => {
      const openers = page.locator(".panel [data-opener]:visible");
      const count = await openers.count();
      if (count > 0) await openers.nth(Math.floor(random() * count)).click();
    },
  },
  {
    name: "move a slider while the picture glides",
    changes: ["any", "look"],
    weight: 2,
    run: async (reader) => {
      await drag(reader);
      const slider = await someControl(reader, 'input[type="range"]');
      if (slider !== null) await slide(reader, slider);
    },
  },
  {
    name: "turn the phone while it loads",
    changes: ["mode", "look"],
    weight: 1,
    run: async (reader) => {
      const modes = reader.page.locator("select[data-mode]:visible");
      if ((await modes.count()) > 0) await operate(reader, modes.first());
      await turnAWindow(reader);
      await reader.page.waitForTimeout(200);
      await turnAWindow(reader);
    },
  },
  {
    name: "undo and redo",
    changes: ["any", "look"],
    weight: 1,
    run: async ({ page }) => {
      for (const key of ["Control+z", "Control+z", "Control+y"]) await page.keyboard.press(key);
    },
  },
  {
    name: "open the list of keys, and close it",
    changes: [],
    weight: 1,
    run: async ({ page }) => {
      await page.keyboard.press("?");
      await page.waitForTimeout(100);
      await page.keyboard.press("Escape");
    },
  },
  {
    name: "copy a link",
    changes: [],
    weight: 1,
    run: ({ page }) => page.keyboard.press("l"),
  },
];

/** Holds the phone in its Cardboard viewer, turned about the vertical and tilted; -90 degrees is level. */
function holdHead({ page }: Reader, alpha_deg: number, gamma_deg: number): Promise<void> {
  return page.evaluate(
    ([alpha, gamma]) => {
      dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha, beta: 0, gamma }));
    },
    [alpha_deg, gamma_deg] as const,
  );
}

/** Looks from side to side, and finally far away from everything. */
async function lookAround(reader: Reader): Promise<void> {
  const { page, random } = reader;
  const [alpha, gamma] = [360 * random(), -90 + 30 * (random() - 0.5)];
  for (let i = 0; i < 12; i++) {
    await holdHead(reader, alpha + 9 * i, gamma);
    await page.waitForTimeout(60);
  }
  await holdHead(reader, alpha, -5);
}

export const IN_STEREO: readonly Act[] = [
  {
    name: "look around without a rest",
    changes: [],
    weight: 2,
    run: lookAround,
  },
  {
    name: "rest a gaze anywhere",
    // the controls that a gaze rests on do what they are made for
    changes: ["any", "look"],
    weight: 2,
    run: async (reader) => {
      const { random } = reader;
      await holdHead(reader, 360 * random(), -90 + 30 * (random() - 0.5));
      await reader.page.waitForTimeout(1800);
    },
  },
];

/** Enters the split screen. */
export async function enterStereo({ page }: Reader): Promise<void> {
  // otherwise letters would go to a field
  await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
  await page.keyboard.press("P");
  await page.waitForFunction(() => window.stereocell?.snapshot().isStereo);
}

export async function leaveStereo({ page }: Reader): Promise<void> {
  await page.keyboard.press("Escape");
  await page.waitForFunction(() => window.stereocell?.snapshot().isStereo === false);
}
