/** How much of the GPU's memory a device is asked for. Pure. */

export type Device = Readonly<{ userAgent: string; deviceMemory?: number }>;

/** Bytes, for all volumes together and for all surfaces together. */
export type MemoryBudget = Readonly<{ volumes: number; surfaces: number }>;

const MIB = 1024 * 1024;
const SMALL: MemoryBudget = { volumes: 128 * MIB, surfaces: 128 * MIB };
const LARGE: MemoryBudget = { volumes: 512 * MIB, surfaces: 384 * MIB };
/** Memory, GiB, as browsers report it: a computer with so little is treated as a phone is. */
const LITTLE = 4;

export function memoryBudget({ userAgent, deviceMemory }: Device): MemoryBudget {
  const isPhone = /Android|iPhone|iPad|Mobile/.test(userAgent);
  return isPhone || (deviceMemory ?? 2 * LITTLE) <= LITTLE ? SMALL : LARGE;
}
