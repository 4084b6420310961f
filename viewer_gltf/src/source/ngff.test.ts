import { describe, expect, it } from "vitest";
import { directionsOf, parseNgff, umPer } from "./ngff";

const AXES = [
  { name: "c", type: "channel" },
  ...["z", "y", "x"].map((name) => ({ name, type: "space", unit: "nanometer" })),
];
const scale = (...values: number[]) => ({ type: "scale", scale: values });
const shift = (...values: number[]) => ({ type: "translation", translation: values });
const image = (more: object = {}, steps: object[] = [scale(1, 200, 100, 100)]) => ({
  multiscales: [
    { axes: AXES, datasets: [{ path: "0", coordinateTransformations: steps }], ...more },
  ],
});

describe("the metadata of OME-Zarr", () => {
  it("are read in the form of 0.4, and below `ome` in the form of 0.5", () => {
    const found = parseNgff(image({ version: "0.4" }), "x");
    expect(found.axes).toEqual(["c", "z", "y", "x"]);
    expect(found.levels).toEqual([{ path: "0", scale_um: [0.2, 0.1, 0.1], shift_um: null }]);
    expect(parseNgff({ ome: { version: "0.5", ...image() } }, "x").levels).toEqual(found.levels);
    expect(found.notes).toEqual([]);
  });

  it("apply the transformations of a level before those of the image", () => {
    const steps = [scale(1, 2, 2, 2), shift(0, 10, 20, 30)];
    const { levels } = parseNgff(
      image({ coordinateTransformations: [scale(1, 500, 500, 500)] }, steps),
      "x",
    );
    expect(levels[0].scale_um).toEqual([1, 1, 1]);
    expect(levels[0].shift_um).toEqual([5, 10, 15]);
  });

  it("have only names of axes in older versions, and a spacing is assumed", () => {
    const old = {
      multiscales: [{ version: "0.3", axes: ["t", "c", "z", "y", "x"], datasets: [{ path: "0" }] }],
    };
    const found = parseNgff(old, "x");
    expect(found.axes).toEqual(["t", "c", "z", "y", "x"]);
    expect(found.notes).toEqual([
      "OME-Zarr 0.3 states no voxel spacing with a unit. The viewer assumes 1 µm, so lengths may be wrong.",
    ]);
    const older = { multiscales: [{ datasets: [{ path: "0" }] }] };
    expect(parseNgff(older, "x").axes).toEqual(["t", "c", "z", "y", "x"]);
  });

  it("keep the well-formed fields of channels", () => {
    const channels = [
      {
        label: " DAPI ",
        color: "0000FF",
        active: true,
        window: { start: 10, end: 200, min: 0, max: 9 },
      },
      { color: "blue", window: { start: 5, end: 5 } },
      7,
    ];
    const found = parseNgff({ ...image(), omero: { channels } }, "x").channels;
    expect(found[0]).toEqual({ label: "DAPI", color: [0, 0, 1], window: [10, 200], active: true });
    const none = { label: null, color: null, window: null, active: null };
    expect(found.slice(1)).toEqual([none, none]);
  });

  it.each([
    [{}, "found no `multiscales`"],
    [null, "found no `multiscales`"],
    [{ plate: {} }, "found a plate"],
    [{ ome: { "bioformats2raw.layout": 3 } }, "found several images"],
    [{ multiscales: [{ axes: AXES, datasets: [] }] }, "expected at least one level"],
    [{ multiscales: [{ axes: AXES.slice(2), datasets: [{ path: "0" }] }] }, "axes lack z"],
    [
      { multiscales: [{ axes: ["z", "y", "x", "q"], datasets: [{ path: "0" }] }] },
      "axes are z, y, x, q",
    ],
    [
      { multiscales: [{ axes: ["z", "y", "x", "x"], datasets: [{ path: "0" }] }] },
      "axes are z, y, x, x",
    ],
    [image({}, [scale(1, 2)]), "expected scales and translations of 4 numbers"],
    [image({}, [{ type: "affine", affine: [] }]), "coordinateTransformations has"],
    [image({}, [scale(1, 0, 1, 1)]), "expected lengths above 0"],
    [image({}, [scale(1, -2, 1, 1)]), "expected lengths above 0"],
    [
      { multiscales: [{ axes: AXES, datasets: [{ path: "../../secret" }] }] },
      "expected a level inside the image",
    ],
  ] as const)("are refused: %j", (attributes, text) => {
    expect(() => parseNgff(attributes, "x")).toThrow(text);
  });

  it("know units of length in the forms that writers use", () => {
    expect(["micrometer", "Microns", "\u00b5m", "nm", "millimetre", "meter"].map(umPer)).toEqual([
      1, 1, 1, 1e-3, 1e3, 1e6,
    ]);
    expect([umPer("pixel"), umPer(undefined), umPer(3), umPer("second")]).toEqual([
      null,
      null,
      null,
      null,
    ]);
  });

  it("give the sides of a body only if three directions are stated", () => {
    expect(
      directionsOf(["inferior-to-superior", "posterior-to-anterior", "right-to-left"]),
    ).toEqual([
      [0, 0, 1],
      [0, -1, 0],
      [1, 0, 0],
    ]);
    expect(directionsOf(["", "", ""])).toBeNull();
    expect(directionsOf(["left-to-right", "right-to-left", "inferior-to-superior"])).toBeNull();
    expect(
      directionsOf(["left-to-left", "posterior-to-anterior", "inferior-to-superior"]),
    ).toBeNull();
  });
});
