/**
 * A stream of values with several listeners.
 *
 * ```ts
 * import { Signal } from "./signal";
 *
 * const picked = new Signal<string>();
 * const names: string[] = [];
 * picked.subscribe((name) => names.push(name));
 * picked.emit("nucleus 7");
 * print(names); // ["nucleus 7"]
 * ```
 */
export class Signal<T> {
  private readonly listeners = new Set<(value: T) => void>();

  subscribe(listener: (value: T) => void): void {
    this.listeners.add(listener);
  }

  emit(value: T): void {
    for (const listener of this.listeners) listener(value);
  }
}
