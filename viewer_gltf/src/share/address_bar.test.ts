import { expect, it } from "vitest";
import { follows } from "./address_bar";

it("the address follows the view, except in a page without a panel that another page frames", () => {
  expect(follows("", false)).toBe(true);
  expect(follows("", true)).toBe(true);
  expect(follows("?panel=off", false)).toBe(true);
  expect(follows("?panel=off&view=front", true)).toBe(false);
});

it("the address follows the view, or does not, if its parameter `address` says so", () => {
  expect(follows("?panel=off&address=on", true)).toBe(true);
  expect(follows("?address=off", false)).toBe(false);
  expect(follows("?address=nonsense", false)).toBe(true);
});
