import { BufferAttribute, BufferGeometry } from "three";
import { expect, it } from "vitest";
import { stageColors } from "./stage_colors";

it("returns each colour of the stage's objects once, in the order of the surface's vertices", () => {
  const geometry = new BufferGeometry();
  expect(stageColors(geometry)).toEqual([]);
  const [red, green, blue] = [
    [255, 0, 0],
    [0, 255, 0],
    [0, 0, 255],
  ];
  const vertices = [red, green, blue].flatMap((color) => Array(40).fill(color).flat());
  geometry.setAttribute("color", new BufferAttribute(Uint8Array.from(vertices), 3, true));
  expect(stageColors(geometry)).toEqual(["#ff0000", "#00ff00", "#0000ff"]);
});
