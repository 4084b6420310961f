// Makes the finished frame: exposed, sharpened, tone-mapped and sRGB-encoded. Pixels with few samples show the
// ray-marched frame of the same view, whose brightness is matched to a small traced frame. It fades out at all pixels at
// once, because a mixture of both frames, tile by tile, would look like a mosaic. All adjustments are the same for both.
precision highp float;

uniform sampler2D uColor;  // linear, premultiplied
uniform float uExposure;  // factor to the light before the tone map
uniform float uSharpness;  // strength of the sharpening; 0: none
uniform bool uIsFilmic;
uniform vec3 uTone;  // turns of hue, factor to saturation, added lightness
uniform vec4 uPart;  // the eye's part of the target: x, y, width, height, pixels
uniform sampler2D uGuide;  // y: number of samples of a pixel
uniform sampler2D uMarched;  // linear, premultiplied
uniform float uRounds;  // number of samples that every pixel has at least
uniform vec4 uMarchedPart;  // the eye's part of uMarched; width 0: nothing stands in

out vec4 oColor;  // encoded, premultiplied

#include <chunks/encode_srgb>
#include <chunks/tone_map>
#include <chunks/calibrated_light>

// Number of samples from which a pixel shows only the traced colour.
const float SHOWN = 4.0;

// Colour of the ray-marched frame at a pixel, in the light of the traced frame.
vec4 standIn(ivec2 at) {
  vec2 there = (vec2(at) + 0.5 - uPart.xy) / uPart.zw * uMarchedPart.zw;
  vec4 light = texelFetch(uMarched, ivec2(uMarchedPart.xy + min(there, uMarchedPart.zw - 1.0)), 0);
  return vec4(calibrated(light), light.a);
}

// Light at a pixel, linear and premultiplied: traced, ray-marched, or a mixture.
vec4 lightAt(ivec2 at) {
  if (uMarchedPart.z <= 0.0) return texelFetch(uColor, at, 0);
  if (uRounds <= 0.0) return standIn(at);
  float samples = min(texelFetch(uGuide, at, 0).y, uRounds);
  return mix(standIn(at), texelFetch(uColor, at, 0), smoothstep(0.0, SHOWN, samples));
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 here = lightAt(at);
  oColor = vec4(0.0);
  if (here.a <= 0.0) return;
  if (uSharpness > 0.0) {  // unsharp mask
    ivec2 low = ivec2(uPart.xy);
    ivec2 high = ivec2(uPart.xy + uPart.zw) - 1;
    vec3 blurred = 4.0 * here.rgb;
    for (int k = 0; k < 4; k++) {
      ivec2 aside = k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5);
      blurred += 2.0 * lightAt(clamp(at + aside, low, high)).rgb;
      ivec2 corner = ivec2(2 * (k & 1) - 1, (k & 2) - 1);
      blurred += lightAt(clamp(at + corner, low, high)).rgb;
    }
    here.rgb = max(here.rgb + uSharpness * (here.rgb - blurred / 16.0), 0.0);
  }
  vec3 color = uExposure * here.rgb / here.a;
  color = encoded(uIsFilmic ? filmic(color) : min(color, 1.0));
  oColor = vec4(toned(color, uTone) * here.a, here.a);
}
