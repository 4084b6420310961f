// The traced picture as it is laid over the scene: exposed, sharpened, toned, encoded. Where a pixel has
// few samples yet, the marched picture of the same view stands in. It gives way everywhere at once: tiles
// have their samples in turn, and a picture of both would be a mosaic of two lights.
precision highp float;

uniform sampler2D uColor;  // linear, premultiplied
uniform float uExposure;  // factor
uniform float uSharpness;  // 0: as it is
uniform bool uIsFilmic;
uniform vec3 uTone;  // turns of hue, factor to saturation, added lightness
uniform vec4 uPart;  // the eye's
uniform sampler2D uGuide;  // samples
uniform sampler2D uMarched;  // linear, premultiplied
uniform float uRounds;  // samples that every pixel has
uniform vec4 uMarchedPart;  // the eye's; no width: nothing stands in

out vec4 oColor;  // encoded, premultiplied

#include <chunks/encode_srgb>
#include <chunks/tone_map>

// Samples with which a pixel is shown as it is traced.
const float SHOWN = 4.0;

vec4 standIn() {
  vec2 at = (gl_FragCoord.xy - uPart.xy) / uPart.zw * uMarchedPart.zw;
  vec4 light = texelFetch(uMarched, ivec2(uMarchedPart.xy + min(at, uMarchedPart.zw - 1.0)), 0);
  if (light.a > 0.0) light.rgb = encoded(min(light.rgb / light.a, 1.0)) * light.a;
  return light;
}

vec4 traced() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 here = texelFetch(uColor, at, 0);
  if (here.a <= 0.0) return vec4(0.0);
  if (uSharpness > 0.0) {  // unsharp mask
    ivec2 low = ivec2(uPart.xy);
    ivec2 high = ivec2(uPart.xy + uPart.zw) - 1;
    vec3 blurred = 4.0 * here.rgb;
    for (int k = 0; k < 4; k++) {
      ivec2 aside = k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5);
      blurred += 2.0 * texelFetch(uColor, clamp(at + aside, low, high), 0).rgb;
      ivec2 corner = ivec2(2 * (k & 1) - 1, (k & 2) - 1);
      blurred += texelFetch(uColor, clamp(at + corner, low, high), 0).rgb;
    }
    here.rgb = max(here.rgb + uSharpness * (here.rgb - blurred / 16.0), 0.0);
  }
  vec3 color = uExposure * here.rgb / here.a;
  color = encoded(uIsFilmic ? filmic(color) : min(color, 1.0));
  return vec4(toned(color, uTone) * here.a, here.a);
}

void main() {
  oColor = traced();
  if (uMarchedPart.z <= 0.0) return;
  float samples = min(texelFetch(uGuide, ivec2(gl_FragCoord.xy), 0).y, uRounds);
  oColor = mix(standIn(), oColor, smoothstep(0.0, SHOWN, samples));
}
