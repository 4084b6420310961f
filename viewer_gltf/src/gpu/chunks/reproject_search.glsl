// Where another eye, nearby, sees the surface that a ray from `eye` meets: in pixels of its part of
// the picture. To and fro between distance and place: `away` is a first guess, and becomes how far
// the surface is, if any is met. The including shader defines `metAt`: the distance that the other
// eye sees at a pixel, um; 0: nothing is met there.
float metAt(ivec2 pixel);

const int SEEK_ROUNDS = 4;

vec2 seek(vec3 eye, vec3 dir, mat4 toThere, vec3 there, vec4 part, inout float away, out bool isMet) {
  ivec2 low = ivec2(part.xy);
  ivec2 high = ivec2(part.xy + part.zw) - 1;
  vec2 at = vec2(-1e6);
  isMet = false;
  for (int i = 0; i < SEEK_ROUNDS; i++) {
    vec4 device = toThere * vec4(eye + away * dir, 1.0);
    if (device.w <= 0.0) return vec2(-1e6);
    at = (0.5 * device.xy / device.w + 0.5) * part.zw;
    float met = metAt(clamp(ivec2(at + part.xy), low, high));
    isMet = met > 0.0;
    if (isMet) away = met + dot(dir, there - eye);
  }
  return at;
}
