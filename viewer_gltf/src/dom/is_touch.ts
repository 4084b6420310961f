/** Returns whether the main pointer of this device is a finger. */
export const isTouch = (): boolean => matchMedia("(pointer: coarse)").matches;
