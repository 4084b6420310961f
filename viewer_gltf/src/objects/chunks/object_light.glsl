// Lightens an object's linear colour according to its flag: see objects/flags.ts.
vec3 objectLight(vec3 color, int flag) {
  float share = flag == 4 ? 0.65 : flag == 3 ? 0.4 : flag == 2 ? 0.18 : 0.0;
  return mix(color, vec3(1.0), share);
}
