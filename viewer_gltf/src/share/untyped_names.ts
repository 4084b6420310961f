/** Replaces names of measurements that a user has typed by ones that the viewer generates. Pure. */
import { freeName, type Measurement, NAMES } from "../state/measurements";

export function untypedNames(list: readonly Measurement[]): readonly Measurement[] {
  const made: Measurement[] = [];
  list.forEach((each, i) => {
    const isMadeUp = new RegExp(`^${NAMES[each.kind]} \\d+$`).test(each.name);
    const others = [...list.slice(i + 1), ...made];
    made.push(isMadeUp ? each : { ...each, name: freeName(each.kind, others) });
  });
  return made;
}
