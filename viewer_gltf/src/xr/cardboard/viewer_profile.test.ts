import { describe, expect, it } from "vitest";
import { CARDBOARD_V1, CARDBOARD_V2, faultOfCode, parseProfile } from "./viewer_profile";

const V2 =
  "CgZHb29nbGUSEkNhcmRib2FyZCBJL08gMjAxNR0rGBU9JQHegj0qEAAASEIAAEhCAABIQgAASEJYADUpXA89OggeZnc-Ej6aPlAAYAM";
const XIAOMI =
  "CgZYaWFvbWkSCk1pIFZSIFBsYXkddEYUPSW28309KhAAAHBCAABwQgAAcEIAAHBCWAA12qz6PDoI7FG4PgrXI7xQAGAD";
/** The message of Cardboard v1 in the SDK. */
const V1 =
  "0a0c476f6f676c652c20496e632e120c43617264626f6172642076311d31082c3d258fc2753d2a10" +
  "0000204200002042000020420000204235295c0f3d3a08c1cae13e77be1f3e58006001";

const toBase64 = (hex: string) => Buffer.from(hex, "hex").toString("base64url");
const floats = (...values: number[]) =>
  Buffer.from(new Float32Array(values).buffer).toString("hex");
const message = (parts: Record<string, string>) =>
  Object.entries({
    screen: `1d${floats(0.04)}`,
    lenses: `25${floats(0.06)}`,
    fov: `2a10${floats(40, 40, 40, 40)}`,
    tray: `35${floats(0.035)}`,
    distortion: `3a08${floats(0.4, 0.1)}`,
    ...parts,
  })
    .map(([, hex]) => hex)
    .join("");

function near(found: number, wanted: number): void {
  // Floats of 32 bits, which the sources print with four digits.
  expect(found / wanted).toBeCloseTo(1, 3);
}

describe("the code of a Cardboard viewer", () => {
  it("gives the built-in profile for the published code of Cardboard v2", () => {
    const profile = parseProfile(`http://google.com/cardboard/cfg?p=${V2}`);
    expect(profile).toMatchObject({
      vendor: "Google",
      model: "Cardboard I/O 2015",
      fov_deg: { outer: 50, inner: 50, bottom: 50, top: 50 },
      alignment: "bottom",
      button: "indirect-touch",
    });
    near(profile.screenToLens_m, CARDBOARD_V2.screenToLens_m);
    near(profile.interLens_m, CARDBOARD_V2.interLens_m);
    near(profile.trayToLens_m, CARDBOARD_V2.trayToLens_m);
    expect(profile.distortion).toHaveLength(2);
    profile.distortion.forEach((k, i) => {
      near(k, CARDBOARD_V2.distortion[i]);
    });
  });

  it("gives the built-in profile for the SDK's bytes of Cardboard v1", () => {
    const profile = parseProfile(toBase64(V1));
    near(profile.screenToLens_m, CARDBOARD_V1.screenToLens_m);
    near(profile.interLens_m, CARDBOARD_V1.interLens_m);
    near(profile.distortion[0], 0.441);
    near(profile.distortion[1], 0.156);
    const { vendor, model, fov_deg, alignment, button } = CARDBOARD_V1;
    expect(profile).toMatchObject({ vendor, model, fov_deg, alignment, button });
  });

  it("gives the numbers of another maker's viewer", () => {
    const profile = parseProfile(`https://www.google.com/cardboard/cfg?p=${XIAOMI}`);
    expect(profile).toMatchObject({ vendor: "Xiaomi", model: "Mi VR Play", alignment: "bottom" });
    near(profile.screenToLens_m, 0.0362);
    near(profile.interLens_m, 0.062);
    near(profile.trayToLens_m, 0.0306);
    near(profile.distortion[0], 0.36);
    near(profile.distortion[1], -0.01);
    expect(profile.fov_deg.outer).toBe(60);
  });

  it("gives the same profile in every form in which users paste it", () => {
    const wanted = parseProfile(V2);
    for (const text of [
      `  https://google.com/cardboard/cfg?p=${V2}\n`,
      `google.com/cardboard/cfg?p=${V2}`,
      `https://google.com/cardboard/cfg?p=${V2}%3D`,
      `${V2.slice(0, 40)}\n${V2.slice(40)}`,
    ]) {
      expect(parseProfile(text)).toEqual(wanted);
    }
  });

  it("gives Cardboard v1 for the address without numbers of 2014", () => {
    for (const text of [
      "http://g.co/cardboard",
      "https://google.com/cardboard/",
      "g.co/cardboard",
    ]) {
      expect(parseProfile(text)).toBe(CARDBOARD_V1);
    }
  });

  it("reads floats that are not packed, and skips unknown fields", () => {
    const single = `2d${floats(41)}2d${floats(42)}2d${floats(43)}2d${floats(44)}`;
    const unknown = `a00601${"a906"}${floats(1, 2)}ba060161`; // a varint, a double, a string
    const code = toBase64(message({ fov: single, unknown, alignment: "5802" }));
    const profile = parseProfile(code);
    expect(profile.fov_deg).toEqual({ outer: 41, inner: 42, bottom: 43, top: 44 });
    expect(profile.alignment).toBe("top");
  });

  it("needs no tray height for a viewer that centres the phone", () => {
    const profile = parseProfile(toBase64(message({ tray: "", alignment: "5801" })));
    expect(profile.alignment).toBe("center");
  });

  it.each([
    ["", "is empty"],
    ["https://example.org/cardboard", "not a Cardboard viewer's code"],
    ["hello", "not a Cardboard viewer's code: hello"],
    ["https://goo.gl/6tWJAX", "goo.gl/6tWJAX is a short link"],
    ["https://google.com/cardboard/cfg", "no parameter p"],
    ["https://google.com/cardboard/cfg?p=%%%", "damaged or cut off"],
    [V2.slice(0, 60), "damaged or cut off"],
    [toBase64(message({ extra: "07" })), "damaged or cut off"],
    [
      toBase64(message({ screen: "" })),
      "distance from screen to lens is missing, expected 0.01 to 0.2 m",
    ],
    [
      toBase64(message({ lenses: `25${floats(Number.NaN)}` })),
      "distance between the lenses is NaN, expected 0.03 to 0.1 m",
    ],
    [toBase64(message({ fov: `2a08${floats(40, 40)}` })), "field of view at the bottom"],
    [
      toBase64(message({ fov: `2a10${floats(40, 95, 40, 40)}` })),
      "is 95.0, expected 5 to 85 degrees",
    ],
    [toBase64(message({ distortion: `3a04${floats(-2)}` })), "distortion is -2.00"],
    [toBase64(message({ distortion: `3a04${floats(Number.NaN)}` })), "distortion is NaN"],
  ])("is rejected with a reason: %j", (text, words) => {
    expect(() => parseProfile(text)).toThrow(words);
    expect(() => parseProfile(text)).toThrow(expect.objectContaining({ name: "ProfileError" }));
  });

  it("is reported with a reason if it can't be read", () => {
    expect(faultOfCode("")).toContain("empty");
    expect(faultOfCode("https://example.org/")).toContain("not a Cardboard viewer's code");
    expect(faultOfCode("https://g.co/cardboard")).toBe("");
  });

  it("throws only ProfileError for damaged bytes", () => {
    const bytes = Buffer.from(V2, "base64url");
    let seed = 1;
    const random = (below: number) => {
      seed = (seed * 48271) % 2147483647;
      return seed % below;
    };
    for (let i = 0; i < 3000; i++) {
      const damaged = Buffer.from(bytes.subarray(0, 30 + random(bytes.length - 29)));
      for (let n = random(4); n >= 0; n--) damaged[random(damaged.length)] = random(256);
      try {
        parseProfile(damaged.toString("base64url"));
      } catch (error) {
        expect(error).toMatchObject({ name: "ProfileError" });
      }
    }
  });
});
