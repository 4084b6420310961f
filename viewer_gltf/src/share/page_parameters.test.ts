import { describe, expect, it } from "vitest";
import { isLight, isPlain, settingsOf } from "./page_parameters";

describe("the page's address", () => {
  it("sets mode, switch distance and disc", () => {
    expect(settingsOf("?bundle=x&mode=tile&quality=high&switch=2.5&disc=20")).toEqual([
      { type: "set", id: "mode", value: "tile" },
      { type: "set", id: "quality", value: "high" },
      { type: "set", id: "switch-distance", value: 2.5 },
      { type: "set", id: "disc-radius", value: 20 },
    ]);
    expect(settingsOf("?bundle=x")).toEqual([]);
  });

  it("chooses a light or a dark page; without it the page follows the system", () => {
    for (const isSystemLight of [true, false]) {
      expect(isLight("?theme=light", isSystemLight)).toBe(true);
      expect(isLight("?theme=dark", isSystemLight)).toBe(false);
      for (const query of ["", "?theme=blue"])
        expect(isLight(query, isSystemLight)).toBe(isSystemLight);
    }
  });

  it("chooses a background of one colour, which users who prefer more contrast also get", () => {
    expect([isPlain("?backdrop=plain", false), isPlain("", true), isPlain("", false)]).toEqual([
      true,
      true,
      false,
    ]);
  });

  it("is reported if it can't be read", () => {
    expect(settingsOf("?mode=cube&switch=&disc=wide")).toEqual([
      {
        type: "notify",
        text: "Address: mode is cube, expected one of disc, tile, all, stage, traced, off",
      },
      { type: "notify", text: "Address: switch is empty, expected a number" },
      { type: "notify", text: "Address: disc is wide, expected a number" },
    ]);
  });
});
