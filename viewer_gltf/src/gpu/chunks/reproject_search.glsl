// Searches the pixel at which a nearby eye sees the surface that a ray from `eye` hits, in its part
// of the image. The search alternates between distance and pixel: `away` is a first guess, and
// becomes the distance of the surface if one is hit. The including shader defines `hitDistanceAt`:
// the distance that the other eye sees at a pixel, um; 0 if nothing is hit there.
float hitDistanceAt(ivec2 pixel);

const int SEEK_ROUNDS = 4;

vec2 seek(vec3 eye, vec3 dir, mat4 toThere, vec3 there, vec4 part, inout float away, out bool isHit) {
  ivec2 low = ivec2(part.xy);
  ivec2 high = ivec2(part.xy + part.zw) - 1;
  vec2 at = vec2(-1e6);
  isHit = false;
  for (int i = 0; i < SEEK_ROUNDS; i++) {
    vec4 device = toThere * vec4(eye + away * dir, 1.0);
    if (device.w <= 0.0) return vec2(-1e6);
    at = (0.5 * device.xy / device.w + 0.5) * part.zw;
    float hit = hitDistanceAt(clamp(ivec2(at + part.xy), low, high));
    isHit = hit > 0.0;
    if (isHit) away = hit + dot(dir, there - eye);
  }
  return at;
}
