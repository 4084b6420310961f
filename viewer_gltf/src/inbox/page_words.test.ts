import { expect, it } from "vitest";
import { inPageWords } from "./page_words";

it.each([
  [
    "expected it in the metadata, or give it with --spacing-um z,y,x",
    'expected it in the metadata, or give it with "Voxel spacing"',
  ],
  ["give them with --spacing-um z,0.5,0.25", 'give them with "Voxel spacing"'],
  ["--spacing-um z,y,x replaces it", '"Voxel spacing" replaces it'],
  [
    "preset mri: MR is stated (--preset none: the defaults)",
    'preset mri: MR is stated ("Kind of image: Another kind": the defaults)',
  ],
  [
    "lengths follow it (--preset names another)",
    'lengths follow it ("Kind of image" names another)',
  ],
  ["take --preset ct-bone.", 'take "Kind of image: CT: bones".'],
  [
    "3 images; building --series 2, the largest: a",
    '3 images; building "Series: 2", the largest: a',
  ],
  ["found 7 (`--series list` shows them)", 'found 7 (the list "Series" shows them)'],
  ["take another --series, or export it", 'take another "Series", or export it'],
  ["voxels are inverted (--dark): each is", 'voxels are inverted ("Background: Bright"): each is'],
  ["--series N --spacing-um z,y,x reads it", '"Series" and "Voxel spacing" reads it'],
])("a setting is named as its field: %s", (line, words) => {
  expect(inPageWords(line)).toBe(words);
});

it.each([
  ["--labels . builds its objects", "`stereocell build --labels .` builds its objects"],
  ["(--labels NAME builds one)", "(`stereocell build --labels NAME` builds one)"],
  [
    "x.zarr/0 --axes zyx --spacing-um z,y,x reads the voxels",
    "x.zarr/0 `stereocell build --axes zyx --spacing-um z,y,x` reads the voxels",
  ],
  ["is read (`--time 3` picks it)", "is read (`stereocell build --time 3` picks it)"],
  ["run stereocell build --labels NAME first", "run stereocell build --labels NAME first"],
])("a setting without a field is named with its command: %s", (line, words) => {
  expect(inPageWords(line)).toBe(words);
});

it.each(["a--b is -- fine", "from 2020-01-02", "", "a.tif: cut off"])("%s is unchanged", (line) => {
  expect(inPageWords(line)).toBe(line);
});
