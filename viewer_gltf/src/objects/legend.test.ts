import { describe, expect, it } from "vitest";
import { colorLegend } from "./legend";
import { sampleContent } from "./sample_table";

const [SIZE, TYPE] = sampleContent().columns;
const VIEW = { palette: "viridis", span: [1, 255], isLog: null } as const;
const ALL = Uint8Array.of(1, 1, 1, 1);

describe("the legend of objects' colours", () => {
  it("has a row for each shown category, and one for objects without a category", () => {
    const legend = (flags: Uint8Array) =>
      colorLegend(TYPE, Uint8Array.of(1, 2, 1, 0), flags, VIEW).rows;
    const [tissue, vessel] = [
      { colors: ["#ff0000"], text: "soft, tissue" },
      { colors: ["#0000ff"], text: "vessel" },
    ];
    expect(legend(ALL).slice(0, 2)).toEqual([tissue, vessel]);
    expect(legend(ALL)[2].text).toBe("(none)");
    expect(legend(Uint8Array.of(1, 0, 1, 0))).toEqual([tissue]);
  });

  it("names ten of many categories, and counts the others", () => {
    const [first, ...others] = Array.from({ length: 117 }, (_, i) => `organ ${i}`);
    const bytes = Uint8Array.from({ length: 117 }, (_, i) => i + 1);
    const organs = { ...TYPE, categories: [first, ...others] } as typeof TYPE;
    const { column, rows } = colorLegend(organs, bytes, bytes, VIEW);
    expect(column).toBe("Type");
    expect(rows).toHaveLength(11);
    expect(rows[9].text).toBe("organ 9");
    expect(rows[10]).toEqual({ colors: [], text: "and 107 more" });
  });

  it("has the palette of a column of numbers, with the values and the unit at its ends", () => {
    const bytes = Uint8Array.of(1, 64, 128, 255);
    const even = { ...VIEW, isLog: false };
    const [bar, ...others] = colorLegend(SIZE, bytes, ALL, even).rows;
    expect(bar.text).toBe("1 – 100 µm³");
    expect([bar.colors[0], bar.colors.at(-1)]).toEqual(["#440154", "#fde725"]);
    expect(others).toEqual([]);
    const upper = colorLegend(SIZE, bytes, ALL, { ...VIEW, span: [128, 255] }).rows;
    expect(upper[0].text).toBe("10 – 100 µm³, logarithmic");
    const missing = colorLegend(SIZE, Uint8Array.of(0, 1, 1, 1), ALL, even).rows;
    expect(missing[1].text).toBe("(none)");
  });
});
