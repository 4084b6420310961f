// The marched stand-in's light, made as bright and as coloured in the mean as a small traced picture of the
// same view: see light_probe.frag.glsl, which sums both.
uniform sampler2D uTracedLight;  // one texel: light and coverage of the traced pixels
uniform sampler2D uMarchedLight;  // ... and of the marched ones

// Largest factor of one colour part, relative to that of the luminance. Where the march has hardly any of
// a part, the missing light is added and not multiplied, such as a white shine on a green surface.
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
