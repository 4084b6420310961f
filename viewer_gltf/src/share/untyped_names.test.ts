import { expect, it } from "vitest";
import type { Measurement } from "../state/measurements";
import { untypedNames } from "./untyped_names";

const measured = (name: string, kind: Measurement["kind"] = "distance"): Measurement => ({
  name,
  kind,
  points: [
    [0, 0, 0],
    [1, 0, 0],
    [1, 1, 0],
  ],
});

it("names of measurements that the viewer has generated are kept", () => {
  const list = [measured("Distance 1"), measured("Angle 3", "angle"), measured("Distance 2")];
  expect(untypedNames(list)).toEqual(list);
});

it("names of measurements that a user has typed are replaced by unused ones", () => {
  const list = [measured("Doe, Jane"), measured("Distance 1"), measured("Distance 1b")];
  const names = untypedNames(list).map(({ name }) => name);
  expect(names).toEqual(["Distance 2", "Distance 1", "Distance 3"]);
});
