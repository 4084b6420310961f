import { Group, LineSegments, Mesh, Scene, Sprite } from "three";
import { describe, expect, it } from "vitest";
import { declareCovering, hasEdges } from "./has_edges";

describe("a scene", () => {
  it("has no edges if it is empty or shows only images that cover the frame", () => {
    const scene = new Scene();
    expect(hasEdges(scene)).toBe(false);
    const image = new Mesh();
    declareCovering(image);
    scene.add(image);
    expect(hasEdges(scene)).toBe(false);
  });

  it.each([new Mesh(), new LineSegments(), new Sprite()])(
    "has edges if it shows a mesh, lines or a sprite, at any depth: $type",
    (drawn) => {
      const scene = new Scene();
      scene.add(new Group().add(drawn));
      expect(hasEdges(scene)).toBe(true);
    },
  );

  it("has no edges where a group hides what it holds", () => {
    const scene = new Scene();
    const group = new Group().add(new Mesh());
    scene.add(group);
    group.visible = false;
    expect(hasEdges(scene)).toBe(false);
  });
});
