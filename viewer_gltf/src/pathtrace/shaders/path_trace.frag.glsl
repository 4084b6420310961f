// Traces one path through each pixel, and adds its light to the sums of earlier frames. Physically based volume
// scattering with a surface's reflection where the gradient is strong: Kroes, Post & Botha, "Exposure Render",
// PLoS ONE 2012, doi:10.1371/journal.pone.0038586. Paths are in um from the box's low corner, y up.
precision highp float;
precision highp int;
precision highp sampler3D;
precision highp usampler3D;

uniform vec3 uSize;  // um: edges of the box around all paths
uniform vec3 uTexLow;  // texture coordinates at the box's low corner
uniform vec3 uTexPerUm;  // texture coordinates per um; negative along y
uniform float uVoxel;  // um: finest voxel spacing
uniform vec3 uTexels;  // size of the traced block, texels
uniform sampler3D uVolume;
uniform usampler3D uIndex;  // only with STREAM_BRICK: slot and level of each cell's brick
uniform sampler2D uMedium;  // 256 x CHANNELS: albedo, extinction per um; TWO_D: 64 rows each, by gradient
uniform sampler3D uMajorants;  // largest extinction per um in each brick
uniform vec3 uBrick;  // texels along a brick's edges
uniform float uStride;  // um, step of a regular march along a ray; 0: free flights (delta tracking)
uniform vec3 uClipLow;
uniform vec3 uClipHigh;
uniform vec4 uClipPlane;
uniform vec4 uCorner[3];

// From normalised device coordinates to um of the box, for the view in which paths begin.
uniform mat4 uToBox;
uniform vec3 uEyeAt;  // um, from the box's low corner: the eye at which paths begin
uniform mat4 uSceneToBox;  // as uToBox, but of the current eye, which may have moved a little since
uniform mat3 uToEnvironment;  // rotates directions from the box to the environment
uniform vec4 uPart;  // the eye's part of the target: x, y, width, height, pixels
uniform vec4 uEye;  // the eye's part of the frame buffer: x, y, width, height, pixels
uniform sampler2D uSceneDepth;

uniform sampler2D uEnvironment;
uniform sampler2D uAliases;
uniform float uEnvironmentLight;  // factor to the radiance of the environment
uniform int uLampCount;
uniform vec4 uLamps[3];  // um, from the box's low corner: centre of a sphere, and its radius
uniform vec3 uLampLight[3];  // radiant intensity, um^2: irradiance is this by squared distance
uniform int uScatters;  // largest number of scatterings of a path
uniform vec3 uBeyond;  // radiance that a path receives after uScatters scatterings
uniform float uAnisotropy;  // asymmetry g of Henyey and Greenstein's phase function, -1..1
uniform float uSurface;  // 0..1: how readily a gradient makes a surface
uniform vec4 uContrast;  // factor to the gradients of each channel
uniform float uShine;  // 0..1: reflectance of a surface that is seen straight on; 1 means 8 %
uniform float uGloss;  // exponent of the lobe in which a shiny surface reflects; larger is sharper
uniform float uOcclusionReach;  // um: largest distance at which matter darkens a point
uniform float uMostLight;  // largest radiance of one path, because rare bright paths would sparkle for long

uniform uint uSample;
uniform int uHistory;  // samples of earlier frames: 0: unusable; 1: of this view; 2: of a view slightly beside it
uniform mat4 uToBefore;  // from the box to the device coordinates of the last frame
uniform vec3 uEyeBefore;
// Largest number of samples that are kept from a view slightly beside the current one.
uniform float uMostHistory;
uniform sampler2D uSums;  // premultiplied colour and coverage, summed
uniform sampler2D uMoments;  // summed: squared luminance, samples, distance, openness
uniform sampler2D uNoisiness;  // standard error of the mean luminance of each tile of NOISE_TILE pixels
uniform vec2 uTurn;  // random numbers of the tiles that this pass samples: x .. x + y, modulo 1
uniform float uCalm;  // standard error below which a tile is sampled less often; 0: all tiles always are

// The chunks use these as the box around all tiles. Here it is the box of the paths.
#define uAllLow vec3(0.0)
#define uAllHigh uSize

// Depth behind a cut face within which matter is lit as a part of the face, in lengths of the finest voxel spacing.
const float FACE_DEPTH = 2.0;

layout(location = 0) out vec4 oSums;
layout(location = 1) out vec4 oMoments;

#include <chunks/intersect_box>
#include <chunks/clip_span>
#include <chunks/cut_face>
#include <chunks/sample_intensities>
#include <chunks/gradient>
#include <chunks/random>
#include <chunks/phase_function>
#include <chunks/environment>
#ifdef TWO_D
#include <chunks/transfer_table_2d>
#include <chunks/medium_2d>
#endif
#include <chunks/in_corner>
#include <chunks/medium>
#include <chunks/delta_tracking>
#include <chunks/reproject_search>
#include <chunks/temporal_history>

// Returns the part of a ray that lies in the box and is not cut away.
vec2 spanOf(vec3 origin, vec3 dir) {
  vec3 invDir = 1.0 / dir;
  vec2 span = intersectBox(origin, invDir, vec3(0.0), uSize);
  return clipSpan(vec2(max(span.x, 0.0), span.y), origin, dir, invDir);
}

vec3 withoutZeros(vec3 dir) {
  return dir + 1e-7 * vec3(equal(dir, vec3(0.0)));
}

// Chooses how a path continues: scattered in the medium, or reflected by a surface. `weight` is the colour of that event.
Scatter chooseScatter(vec3 p, vec3 dir, vec3 albedo, out vec3 weight) {
  Scatter s = Scatter(PHASE, vec3(0.0), vec3(0.0));
  weight = albedo;
  vec3 gradient = gradientAt(uTexLow + p * uTexPerUm, uTexPerUm, uContrast);
  float steepness = length(gradient);
  // Kroes et al., equation 9, with the gradient's share of the whole range
  float isSurface = 1.0 - exp(-25.0 * uSurface * uSurface * uSurface * steepness);
  if (steepness < 1e-4 || random() >= isSurface) return s;
  vec3 normal = gradient / steepness;
  s.normal = dot(normal, dir) > 0.0 ? -normal : normal;
  s.mirrored = reflect(dir, s.normal);
  float straight = 0.08 * uShine;
  float fresnel = straight + (1.0 - straight) * pow(1.0 + dot(dir, s.normal), 5.0);  // Schlick 1994
  s.way = random() < fresnel * step(1e-6, uShine) ? GLOSSY : DIFFUSE;
  if (s.way == GLOSSY) weight = vec3(1.0);
  return s;
}

// Direct light at a point from one randomly chosen source: a lamp, or the environment.
vec3 lightAt(vec3 p, vec3 from, Scatter s) {
  int sources = uLampCount + 1;
  int drawn = min(int(random() * float(sources)), sources - 1);
  float share = 1.0 / float(sources);
  vec3 to;
  vec3 light;
  float reach = 1e30;
  if (drawn == uLampCount) {
    vec4 found;
    to = sampleEnvironment(found) * uToEnvironment;  // the transpose rotates back
    if (found.a <= 0.0) return vec3(0.0);
    float density = scatterDensity(s, from, to);
    // the balance heuristic (Veach 1997), because scattered paths also reach the environment
    light = uEnvironmentLight * found.rgb * density / (share * found.a + density);
  } else {
    vec4 lamp = uLamps[drawn];
    vec3 aside = lamp.xyz - p;
    float away = length(aside);
    if (away <= lamp.w) return vec3(0.0);
    float sine = lamp.w / away;
    float height = sine * sine / (1.0 + sqrt(1.0 - sine * sine));  // 1 - cosine of the cone
    to = around(aside / away, 1.0 - random() * height, random());
    // radiance I / (pi r^2) over the cone's solid angle 2 pi height
    vec3 lit = uLampLight[drawn] * 2.0 * height / max(lamp.w * lamp.w, 1e-12);
    light = lit * scatterDensity(s, from, to) / share;
    reach = away;
  }
  if (max(light.r, max(light.g, light.b)) <= 0.0) return vec3(0.0);
  to = withoutZeros(to);
  vec2 span = spanOf(p, to);
  span.y = min(span.y, reach);
  return span.y > span.x ? light * transmittance(p, to, span.x, span.y) : light;
}

// Openness along a ray, 0..1, from a free flight within the reach of the occlusion. The first 1.5 voxels are skipped,
// because they belong to the soft surface itself.
float openness(vec3 p, vec3 to, vec2 span) {
  span = vec2(max(span.x, 1.5 * uVoxel), min(span.y, uOcclusionReach));
  vec4 medium;
  float t = span.y > span.x ? track(p, to, span.x, span.y, medium) : -1.0;
  return t < 0.0 ? 1.0 : smoothstep(0.0, uOcclusionReach, t);
}

// Returns the light of a path that begins with a scattering at `p`, and writes the openness around that point. If `p`
// lies on a cut face, `face` is its normal, and otherwise 0.
vec3 tracePath(vec3 p, vec3 dir, vec4 medium, vec3 face, out float open) {
  vec3 sum = vec3(0.0);
  vec3 weight = vec3(1.0);
  open = 1.0;
  for (int i = 1; i <= uScatters; i++) {
    vec3 color;
    Scatter s = chooseScatter(p, dir, medium.rgb, color);
    if (i == 1 && face != vec3(0.0)) {
      s = Scatter(DIFFUSE, face, vec3(0.0));
      color = medium.rgb;
    }
    weight *= color;
    sum += weight * lightAt(p, dir, s);
    float survives = min(1.0, max(weight.r, max(weight.g, weight.b)));
    if (i > 3) {  // Russian roulette
      if (random() >= survives) return sum;
      weight /= survives;
    }
    vec3 to = withoutZeros(sampleScatter(s, dir));
    vec2 span = spanOf(p, to);
    float t = span.y > span.x ? track(p, to, span.x, span.y, medium) : -1.0;
    if (i == 1) open = openness(p, to, span);
    if (t < 0.0) {
      vec4 found = environmentAt(uToEnvironment * to);
      float density = scatterDensity(s, dir, to);
      float drawn = found.a / float(uLampCount + 1);
      return sum + weight * uEnvironmentLight * found.rgb * density / max(density + drawn, 1e-12);
    }
    p += t * to;
    dir = to;
  }
  return sum + weight * uBeyond;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 at = gl_FragCoord.xy - uPart.xy;
  History before = historyAt(pixel, at);
  if (!isDrawn(pixel / NOISE_TILE)) {
    oSums = before.sums;
    oMoments = before.moments;
    return;
  }
  seedRandom(uvec3(pixel, uSample));
  vec2 place = 2.0 * (at + vec2(random(), random()) - 0.5) / uPart.zw - 1.0;
  vec4 far = uToBox * vec4(place, 1.0, 1.0);
  vec3 dir = withoutZeros(normalize(far.xyz / far.w - uEyeAt));
  vec2 span = spanOf(uEyeAt, dir);
  ivec2 shown = ivec2(at * uEye.zw / uPart.zw + uEye.xy);
  vec4 scene = uSceneToBox * vec4(place, 2.0 * texelFetch(uSceneDepth, shown, 0).r - 1.0, 1.0);
  span.y = min(span.y, length(scene.xyz / scene.w - uEyeAt));
  oSums = before.sums;
  oMoments = before.moments + vec4(0.0, 1.0, 0.0, 0.0);
  if (span.y <= span.x) return;
  // distances are measured from the point of entry, because floats from a far eye would be too coarse
  vec3 start = uEyeAt + span.x * dir;
  vec4 medium;
  float t = track(start, dir, 0.0, span.y - span.x, medium);
  if (t < 0.0) return;
  // Matter at a cut is lit as a flat face, as in ray marching. Homogeneous matter has no gradient and so no normal, and
  // light that is scattered many times in it becomes dark.
  vec3 face = span.x > 0.0 && t < FACE_DEPTH * uVoxel ? cutFace(start) : vec3(0.0);
  vec3 p = face == vec3(0.0) ? start + t * dir : start;
  float open;
  vec3 color = min(tracePath(p, dir, medium, face, open), vec3(uMostLight));
  float luminance = dot(color, vec3(0.2126, 0.7152, 0.0722));
  oSums += vec4(color, 1.0);
  oMoments += vec4(luminance * luminance, 0.0, span.x + t, open);
}
