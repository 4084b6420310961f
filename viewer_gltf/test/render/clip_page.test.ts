/**
 * Clip plane and clip box cut surfaces and volumes alike, for one eye and for two. The expected
 * image follows from rays through the specimen. A ray that is removed over its whole length shows
 * nothing. A ray that is kept over its whole length shows the same as before.
 */
import { expect, it } from "vitest";
import { place, XR_DISTANCE_M } from "../../src/render/placement";
import type { Mode } from "../../src/state/parameters/volumes";
import { addHeadset } from "../support/browser/chromium";
import { isBackground, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";
import { SPECIMEN, type Vec3 } from "../support/fixture/bodies";

type Headset = import("iwer").XRDevice;

const CHANNELS = ["F_x20_body", "Balls"];
/** Pixels covered by the clip's own marks: around a handle, and beside a line. */
const HANDLE_PX = 16;
const LINE_PX = 3;
/** um from a plane's middle to its tip. */
const ARM_UM = 0.2 * 64;
/**
 * Difference between neighbouring pixels that counts as a silhouette; silhouettes are blended
 * differently in each drawing.
 */
const EDGE = 24;
/** um. Rays this close to a clip plane are ignored, because they lie at the image's own edges. */
const MARGIN_UM = 0.6;
/** Metres between the pupils; iwer's default for the emulated headset. */
const PUPILS_M = 0.063;
/** Share of pixels that may differ where everything is kept. */
const SAME = 0.02;

const { scale, center } = place({ min: [...SPECIMEN.min], max: [...SPECIMEN.max] });
const dot = (a: Vec3, b: Vec3) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const along = (a: Vec3, by: number, d: Vec3): Vec3 => [
  a[0] + by * d[0],
  a[1] + by * d[1],
  a[2] + by * d[2],
];

/** Position of an eye, um, and its axes; the specimen's own are x, y up, z to the front. */
type Eye = Readonly<{
  at: Vec3;
  ahead: Vec3;
  right: Vec3;
  width: number;
  height: number;
  /** Pixels per unit in the image plane, one unit in front of the eye. */
  focal_px: number;
}>;

/**
 * An eye that looks at the specimen's middle from the front or the side, from a distance in metres.
 */
function eyeOf(
  side: "front" | "side",
  away_m: number,
  fov_deg: number,
  { width, height }: Picture,
  aside_m = 0,
): Eye {
  const back: Vec3 = side === "front" ? [0, 0, 1] : [1, 0, 0];
  const right: Vec3 = side === "front" ? [1, 0, 0] : [0, 0, -1];
  const at = along(along(center, away_m / scale, back), aside_m / scale, right);
  const focal_px = height / 2 / Math.tan((fov_deg * Math.PI) / 360);
  return { at, ahead: [-back[0], 0, -back[2]], right, width, height, focal_px };
}

/** The ray through the middle of a pixel; not of unit length. */
function rayOf(eye: Eye, x: number, y: number): Vec3 {
  const { width, height, focal_px } = eye;
  const ahead = along(eye.ahead, (x + 0.5 - width / 2) / focal_px, eye.right);
  return [ahead[0], ahead[1] - (y + 0.5 - height / 2) / focal_px, ahead[2]];
}

function pixelOf(eye: Eye, p: Vec3): readonly [number, number] {
  const from = minus(p, eye.at);
  const per = eye.focal_px / dot(from, eye.ahead);
  return [eye.width / 2 + per * dot(from, eye.right) - 0.5, eye.height / 2 - per * from[1] - 0.5];
}

/** Keeps the points with normal . p <= offset, um. */
type Cut = Readonly<{ normal: Vec3; offset: number }>;
type Span = readonly [number, number] | null;

/** The part of a ray's span that the cuts keep, moved outwards by a margin. */
function kept(span: Span, from: Vec3, dir: Vec3, cuts: readonly Cut[], margin = 0): Span {
  if (span === null) return null;
  let [a, b] = span;
  for (const { normal, offset } of cuts) {
    const slope = dot(normal, dir);
    const above = dot(normal, from) - offset - margin;
    if (slope === 0) {
      if (above > 0) return null;
    } else if (slope > 0) b = Math.min(b, -above / slope);
    else a = Math.max(a, -above / slope);
  }
  return a < b ? [a, b] : null;
}

const faces = (min: Vec3, max: Vec3): readonly Cut[] => [
  { normal: [1, 0, 0], offset: max[0] },
  { normal: [0, 1, 0], offset: max[1] },
  { normal: [0, 0, 1], offset: max[2] },
  { normal: [-1, 0, 0], offset: -min[0] },
  { normal: [0, -1, 0], offset: -min[1] },
  { normal: [0, 0, -1], offset: -min[2] },
];
const WHOLE = faces(SPECIMEN.min, SPECIMEN.max);

/** A line, um, drawn over the image, with this radius in pixels. */
type Mark = Readonly<{ from: Vec3; to: Vec3; radius_px: number }>;
/** A clip: its link, its planes, and the marks that show it. */
type Clip = Readonly<{ hash: string; cuts: readonly Cut[]; marks: readonly Mark[] }>;

const UNCUT: Clip = { hash: "", cuts: [], marks: [] };

function planeClip(normal: Vec3, offset: number): Clip {
  const middle = along(center, offset - dot(normal, center), normal);
  const arm = { from: middle, to: along(middle, ARM_UM, normal), radius_px: HANDLE_PX };
  return { hash: `&cut=${[...normal, offset]}`, cuts: [{ normal, offset }], marks: [arm] };
}

function boxClip(min: Vec3, max: Vec3): Clip {
  const middle = along(along([0, 0, 0], 0.5, min), 0.5, max);
  const handles = faces(min, max).map(({ normal, offset }) => {
    const at = along(middle, offset - dot(normal, middle), normal);
    return { from: at, to: at, radius_px: HANDLE_PX };
  });
  const corner = (i: number): Vec3 => [
    i & 1 ? max[0] : min[0],
    i & 2 ? max[1] : min[1],
    i & 4 ? max[2] : min[2],
  ];
  const edges = Array.from({ length: 8 }, (_, i) => i).flatMap((i) =>
    [1, 2, 4]
      .filter((axis) => (i & axis) === 0)
      .map((axis) => ({ from: corner(i), to: corner(i + axis), radius_px: LINE_PX })),
  );
  const own = WHOLE.map(({ offset }) => offset);
  const cuts = faces(min, max).filter(({ offset }, i) => offset < own[i]);
  return { hash: `&box=${[...min, ...max]}`, cuts, marks: [...handles, ...edges] };
}

/** The pixels covered by marks. */
function maskOf(eye: Eye, marks: readonly Mark[]): ReadonlySet<number> {
  const mask = new Set<number>();
  for (const { from, to, radius_px } of marks) {
    for (let i = 0; i <= 300; i++) {
      const [px, py] = pixelOf(eye, along(from, i / 300, minus(to, from)));
      for (let y = Math.ceil(py - radius_px); y <= py + radius_px; y++) {
        for (let x = Math.ceil(px - radius_px); x <= px + radius_px; x++) {
          if (Math.hypot(x - px, y - py) <= radius_px) mask.add(y * eye.width + x);
        }
      }
    }
  }
  return mask;
}

/** Whether the image is uniform around a pixel, without any outline. */
function isEven(picture: Picture, x: number, y: number): boolean {
  const here = picture.at(x, y);
  return [-1, 0, 1].every((dx) =>
    [-1, 0, 1].every((dy) => {
      const at = [
        Math.min(Math.max(x + dx, 0), picture.width - 1),
        Math.min(Math.max(y + dy, 0), picture.height - 1),
      ];
      return picture.at(at[0], at[1]).every((v, i) => Math.abs(v - here[i]) <= EDGE);
    }),
  );
}

type Found = Readonly<{ gone: number; left: number; stays: number; changed: number }>;

/**
 * Compares a clipped image with the whole one, over the pixels of the whole specimen. Counts the
 * pixels that the clip should remove, and those of them that are left; the pixels that should stay,
 * and those of them that changed.
 *
 * @param lowest least height of the rays, of length 1, that are compared: in stereo, bar and ground
 *   are below
 */
function compare(
  whole: Picture,
  cut: Picture,
  eye: Eye,
  { cuts, marks }: Clip,
  lowest = Number.NEGATIVE_INFINITY,
): Found {
  const mask = maskOf(eye, marks);
  const found = { gone: 0, left: 0, stays: 0, changed: 0 };
  for (const [x, y] of whole.where((pixel) => !isBackground(pixel))) {
    if (mask.has(y * eye.width + x)) continue;
    const dir = rayOf(eye, x, y);
    if (dir[1] / Math.hypot(...dir) < lowest) continue;
    const span = kept([0, Number.POSITIVE_INFINITY], eye.at, dir, WHOLE);
    if (span === null) continue; // the ray misses the specimen
    const ends = span.map((t) => along(eye.at, t, dir));
    const isKept = cuts.every(({ normal, offset }) =>
      ends.every((p) => dot(normal, p) < offset - MARGIN_UM),
    );
    if (isKept && isEven(whole, x, y)) {
      const [before, after] = [whole.at(x, y), cut.at(x, y)];
      found.stays++;
      if (before.some((v, i) => Math.abs(v - after[i]) > 8)) found.changed++;
    } else if (kept(span, eye.at, dir, cuts, MARGIN_UM) === null) {
      found.gone++;
      if (!isBackground(cut.at(x, y))) found.left++;
    }
  }
  return found;
}

function expectCut(found: Found, atLeast: number, which: string): void {
  expect(found.gone, which).toBeGreaterThan(atLeast);
  expect(found.left, which).toBe(0);
  expect(found.stays, which).toBeGreaterThan(atLeast);
  expect(found.changed, which).toBeLessThanOrEqual(SAME * found.stays);
}

/** A link with all settings that matter. */
const linkOf = (mode: Mode, more: string) =>
  `#v=1&c=${CHANNELS}&mode=${mode}&dwell=off&quality=high${more}`;

const PLANE = planeClip([1, 0, 0], 34);
const OBLIQUE = planeClip([-0.8, 0.6, 0], -52);
const BOX = boxClip([0, -48, 0], [46, -16, 24]);
/** The cuts that every run tests for each drawing; others are tested in stereo and with keys. */
const KEPT: Readonly<Record<string, readonly Clip[]>> = { surfaces: [BOX], volumes: [OBLIQUE] };
const DRAWN: readonly (readonly [string, Mode])[] = [
  ["surfaces", "off"],
  ["volumes", "all"],
];

describeInChromium("a clip", () => {
  const stand = prepareStand({ viewport: { width: 600, height: 300 } });
  const page = () => stand.viewer.page;
  const AWAY_M = 1.8;

  async function shoot(mode: Mode, eye_m: readonly number[], hash: string): Promise<Picture> {
    // An address that differs only in its hash does not reload the page.
    await page().goto("about:blank");
    await stand.open(linkOf(mode, `&eye=${[...eye_m, 0, 0, 0]}${hash}`));
    await stand.viewer.still();
    return takePicture(page());
  }

  for (const [as, mode] of DRAWN) {
    it(`by plane or box removes ${as} beyond it, and changes nothing else`, async () => {
      const from = [0, 0, AWAY_M];
      const whole = await shoot(mode, from, "");
      const eye = eyeOf("front", AWAY_M, 40, whole);
      for (const clip of sweep([PLANE, OBLIQUE, BOX], (each) => KEPT[as].includes(each))) {
        const cut = await shoot(mode, from, clip.hash);
        expectCut(compare(whole, cut, eye, clip), 200, clip.hash);
      }
    });
  }

  it("is switched by a key: a plane through the middle, a box around it", async () => {
    // The view is from the side, since the plane faces the front.
    const whole = await shoot("off", [AWAY_M, 0, 0], "");
    const eye = eyeOf("side", AWAY_M, 40, whole);
    const press = async (key: string) => {
      await page().keyboard.press(key);
      await stand.viewer.still();
      return takePicture(page());
    };
    const plane = planeClip([0, 0, 1], 12);
    expectCut(compare(whole, await press("n"), eye, plane), 200, "plane");
    const back = compare(whole, await press("n"), eye, UNCUT);
    expect(back.changed).toBeLessThanOrEqual(SAME * back.stays);
    const box = boxClip([16, -36, 6], [48, -12, 18]);
    const found = compare(whole, await press("b"), eye, box); // no ray is kept from end to end
    expect(found.gone).toBeGreaterThan(200);
    expect(found.left).toBe(0);
  });
});

describeInChromium("a clip in stereo", () => {
  const VIEWPORT = { width: 360, height: 180 };
  /**
   * Sine of the pitch of the ground's farthest line, which is 9 m away and 1.45 m below the eyes.
   */
  const GROUND_BEGINS = -0.155;
  const stand = prepareStand({ viewport: VIEWPORT, pixelRatio: 1 });
  const page = () => stand.viewer.page;

  /** The images of the left and the right eye. */
  async function shoot(mode: Mode, hash: string): Promise<readonly Picture[]> {
    await page().goto("about:blank");
    await stand.open(linkOf(mode, hash));
    await stand.viewer.enterStereo();
    await page().evaluate(() => {
      const { headset } = window as unknown as { headset: Headset };
      for (const hand of ["left", "right"] as const) {
        const controller = headset.controllers[hand];
        if (controller === undefined) throw new Error(`there is no ${hand} controller`);
        controller.connected = false; // its ray would cover the image
      }
    });
    await stand.viewer.settled();
    const drawn = () => page().evaluate(() => window.stereocell?.frames ?? 0);
    const before = await drawn();
    await expect.poll(drawn, { timeout: 60_000 }).toBeGreaterThan(before + 1);
    const pictures: Picture[] = [];
    const width = VIEWPORT.width / 2;
    for (const x of [0, width]) {
      pictures.push(await takePicture(page(), { x, y: 0, width, height: VIEWPORT.height }));
    }
    return pictures;
  }

  const inStereo = [
    [DRAWN[0], PLANE],
    [DRAWN[1], BOX],
  ] as const;
  for (const [[as, mode], clip] of sweep(inStereo, ([, clip]) => clip === BOX)) {
    it(`removes ${as} for both eyes`, async () => {
      await addHeadset(page());
      const whole = await shoot(mode, "");
      const cut = await shoot(mode, clip.hash);
      whole.forEach((picture, i) => {
        const eye = eyeOf("front", XR_DISTANCE_M, 90, picture, (i - 0.5) * PUPILS_M);
        expectCut(compare(picture, cut[i], eye, clip, GROUND_BEGINS), 12, `${clip.hash}, eye ${i}`);
      });
    }, 400_000); // two sessions, with a software renderer
  }
});
