/** What `?bench` in the page's address asks for. Pure. */

/** Length of each run, s: without one in the address, and at most. */
const FLIGHT_S = 4;
const LONGEST_S = 60;

/** Whether an address asks for the benchmark, and how long its flights take, s. */
export function flightAsked(search: string): number | null {
  const asked = new URLSearchParams(search).get("bench");
  if (asked === null) return null;
  const seconds = Number(asked);
  return asked !== "" && seconds > 0 ? Math.min(seconds, LONGEST_S) : FLIGHT_S;
}
