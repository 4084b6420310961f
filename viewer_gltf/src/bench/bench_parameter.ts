/** Reads the parameter `bench` of the page's address. Pure. */

/** Length of a run if the address states none, and longest length, s. */
const FLIGHT_S = 4;
const LONGEST_S = 60;

/** Returns the length of the benchmark's flights, s, if an address asks for the benchmark; otherwise null. */
export function flightAsked(search: string): number | null {
  const asked = new URLSearchParams(search).get("bench");
  if (asked === null) return null;
  const seconds = Number(asked);
  return asked !== "" && seconds > 0 ? Math.min(seconds, LONGEST_S) : FLIGHT_S;
}
