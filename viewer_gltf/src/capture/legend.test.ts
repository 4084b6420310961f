import { expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Manifest } from "../bundle/generated/bundle";
import { initialState } from "../state/initial_state";
import { legendOf } from "./legend";

const manifest = sampleManifest(3);
const [first, ...others] = manifest.channels;
const file = { path: "objects.json", bytes: 1, sha256: "0".repeat(64) };
const hidden = others.map((one) => ({ ...one, opens: false }));
const mapped: Manifest = { ...manifest, channels: [{ ...first, objects: file }, ...hidden] };

const legend = (of: Manifest, colorsOf: Parameters<typeof legendOf>[2] = () => null) =>
  legendOf(initialState(of), of, colorsOf);

it("a channel has its colour and the values of its window", () => {
  const [entry] = legend(manifest);
  expect(entry.name).toBe(first.name);
  expect(entry.colors).toHaveLength(1);
  expect(entry.text).toMatch(/^\S+ – \S+/);
});

it("a label map has the meaning of its colours, and no window, because its numbers are not values", () => {
  const rows = [
    { colors: ["#e69f00"], text: "T cell" },
    { colors: [], text: "and 3 more" },
  ];
  const entries = legend(mapped, (id) => (id === first.id ? { column: "Type", rows } : null));
  expect(entries).toEqual([
    { name: first.name, colors: [], text: "by Type" },
    ...rows.map((row) => ({ name: "", ...row })),
  ]);
  expect(legend(mapped)[0]).toEqual({ ...legend(manifest)[0], text: "" });
});
