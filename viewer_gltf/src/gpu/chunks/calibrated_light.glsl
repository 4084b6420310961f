// Scales the stand-in march to the mean brightness and colour of a small path-traced image of the
// same view; light_probe.frag.glsl sums both.
uniform sampler2D uTracedLight;  // one texel: light and coverage of the path-traced pixels
uniform sampler2D uMarchedLight;  // one texel: light and coverage of the marched pixels

// Largest factor of one colour channel relative to that of the luminance. Where the march has
// hardly any of a channel, such as a white highlight on a green surface, the missing light is added
// and not multiplied.
const float MAX_TINT = 4.0;

float brightnessOf(vec3 c) {
  return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

// `light` is premultiplied.
vec3 calibrated(vec4 light) {
  vec4 traced = texelFetch(uTracedLight, ivec2(0), 0);
  vec4 marched = texelFetch(uMarchedLight, ivec2(0), 0);
  if (traced.a <= 0.0 || marched.a <= 0.0) return light.rgb;
  vec3 wanted = traced.rgb / traced.a;
  vec3 found = marched.rgb / marched.a;
  float brighter = brightnessOf(wanted) / max(brightnessOf(found), 1e-6);
  vec3 factor = min(wanted / max(found, 1e-6), MAX_TINT * brighter);
  return light.rgb * factor + light.a * max(wanted - factor * found, 0.0);
}
