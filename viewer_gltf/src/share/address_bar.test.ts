import { expect, it } from "vitest";
import { follows } from "./address_bar";

it("follows the view, but for a mere picture in another page", () => {
  expect(follows("", false)).toBe(true);
  expect(follows("", true)).toBe(true);
  expect(follows("?panel=off", false)).toBe(true);
  expect(follows("?panel=off&view=front", true)).toBe(false);
});

it("follows, or does not, as the address asks", () => {
  expect(follows("?panel=off&address=on", true)).toBe(true);
  expect(follows("?address=off", false)).toBe(false);
  expect(follows("?address=nonsense", false)).toBe(true);
});
