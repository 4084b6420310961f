// The traced picture as it is laid over the scene: exposed, sharpened, toned, encoded.
precision highp float;

uniform sampler2D uColor;  // linear, premultiplied
uniform float uExposure;  // factor
uniform float uSharpness;  // 0: as it is
uniform bool uIsFilmic;
uniform vec3 uTone;  // turns of hue, factor to saturation, added lightness
uniform vec4 uPart;  // the eye's

out vec4 oColor;  // encoded, premultiplied

#include <chunks/encode_srgb>
#include <chunks/tone_map>

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 here = texelFetch(uColor, at, 0);
  if (here.a <= 0.0) {
    oColor = vec4(0.0);
    return;
  }
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
  oColor = vec4(toned(color, uTone) * here.a, here.a);
}
