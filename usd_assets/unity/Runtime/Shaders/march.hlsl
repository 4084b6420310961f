// Marches a ray through the volume of one tile, front to back, with up to four channels together. This file has
// only functions and constants. The file that includes it defines float4 sampleIntensities(float3) and
// float4 lookUp(int, float).
// Rays are measured in um from the box's low corner, with y up, so anisotropic voxels need no special treatment.
// Unity's space is left-handed. Its x is mirrored relative to the specimen's, as in glTFast, and so are the texture
// coordinates.
// Opacity correction and early termination follow Engel et al., Real-Time Volume Graphics (2006).
// The tests compile this file as C++, so it uses only syntax that HLSL and C++ share: no `out`, and no swizzles
// except xyz and rgb.
#ifndef STEREOCELL_MARCH
#define STEREOCELL_MARCH

#include "volume_material.hlsl"

#define CHANNELS 4
#define MAX_STEPS 100  // limit for one ray, for any size of the volume and any number of tiles
static const float OPAQUE = 0.99;  // opacity at which a ray ends

// Linear RGB that a white surface reflects if it faces the key lamp, the weaker fill lamp, the sky or the ground.
// The values are the same as in StereoCell's viewer.
static const float3 KEY_LIGHT = float3(0.66, 0.62, 0.56);
static const float3 FILL_LIGHT = float3(0.08, 0.1, 0.14);
static const float3 SKY_LIGHT = float3(0.33, 0.34, 0.37);
static const float3 GROUND_LIGHT = float3(0.13, 0.125, 0.12);
static const float GLOSS = 0.1;

// Unit vectors in the box's space towards the key lamp, the fill lamp and the sky.
struct Room
{
    float3 key;
    float3 fill;
    float3 up;
};

// Colour (not premultiplied) and opacity of one step of a ray, and the share of each channel in it.
struct Seen
{
    float4 color;
    float4 shares;
};

float3 colorOf(int c)
{
    return c == 0 ? _Color0.rgb : c == 1 ? _Color1.rgb : c == 2 ? _Color2.rgb : _Color3.rgb;
}

float awayFromZero(float x)
{
    return abs(x) < 1e-6 ? 1e-6 : x;
}

float3 inverseOf(float3 dir)
{
    return float3(1.0 / awayFromZero(dir.x), 1.0 / awayFromZero(dir.y), 1.0 / awayFromZero(dir.z));
}

// Distances along a ray at which it enters and leaves the box from `low` to `high` (slab test, Kay & Kajiya 1986).
float2 intersectBox(float3 eye, float3 invDir, float3 low, float3 high)
{
    float3 a = (low - eye) * invDir;
    float3 b = (high - eye) * invDir;
    float3 near = min(a, b);
    float3 far = max(a, b);
    return float2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

// Opacity of a path of `voxels` voxels, from the opacity `ofVoxel` of one voxel.
float opacityOf(float ofVoxel, float voxels)
{
    return 1.0 - pow(1.0 - min(ofVoxel, 0.999), voxels);
}

// Colour and opacity of one step. Overlapping channels absorb together; the colour is their mean, weighted by opacity.
Seen classify(float4 intensity, float voxels)
{
    Seen seen;
    float3 color = float3(0.0, 0.0, 0.0);
    float weight = 0.0;
    float transparency = 1.0;
    seen.shares = float4(0.0, 0.0, 0.0, 0.0);
    UNITY_UNROLL
    for (int c = 0; c < CHANNELS; c++)
    {
        float4 look = lookUp(c, intensity[c]);
        float a = opacityOf(look.a, voxels * _Shown[c]);
        color += look.rgb * colorOf(c) * a;
        weight += a;
        seen.shares[c] = a;
        transparency *= 1.0 - a;
    }
    float whole = max(weight, 1e-6);
    seen.shares = seen.shares / whole;
    color = color / whole;
    seen.color = float4(color.x, color.y, color.z, 1.0 - transparency);
    return seen;
}

// Gradient of the intensities in the box's directions, with each channel weighted by its share. The eight samples are
// the corners of a cube two voxels wide. Each component is half the difference between the means of two opposite faces.
float3 gradientAt(float3 p, float3 texPerUm, float4 shares)
{
    float3 h = _Voxel * abs(texPerUm);
    float3 gradient = float3(0.0, 0.0, 0.0);
    UNITY_LOOP
    for (int corner = 0; corner < 8; corner++)
    {
        float3 side = 2.0 * float3(corner & 1, (corner >> 1) & 1, corner >> 2) - float3(1.0, 1.0, 1.0);
        gradient += side * dot(sampleIntensities(p + side * h), shares);
    }
    return 0.25 * gradient * sign(texPerUm);
}

// The face of the box around all tiles on which a place lies, along one axis: -1 for the low face, 1 for the high
// face, 0 for neither.
float faceAt(float place, float low, float high)
{
    float near = 0.05 * _Voxel;
    return (abs(place - high) < near ? 1.0 : 0.0) - (abs(place - low) < near ? 1.0 : 0.0);
}

// Unit normal of the outer face through which a ray enters; 0 if the ray does not start on an outer face. Tissue that
// this face cuts is lit with the face's normal, because the gradient inside the tissue does not face the eye.
float3 cutFace(float3 start)
{
    float3 face = float3(
        faceAt(start.x, _AllLow.x, _AllHigh.x),
        faceAt(start.y, _AllLow.y, _AllHigh.y),
        faceAt(start.z, _AllLow.z, _AllHigh.z));
    return face / max(length(face), 1.0);
}

float3 lightOn(float3 normal, Room room)
{
    float3 around = lerp(GROUND_LIGHT, SKY_LIGHT, 0.5 + 0.5 * dot(normal, room.up));
    around += FILL_LIGHT * max(dot(normal, room.fill), 0.0);
    return around + KEY_LIGHT * max(dot(normal, room.key), 0.0);
}

// Intensity differences over two voxels. Below the first value they are noise, and above the second they are a
// boundary; shading fades in between. Voxels without a boundary get the scattered light of their surroundings.
static const float NOISE_STEP = 0.03;
static const float BOUNDARY_STEP = 0.18;
static const float FLAT_STEP = 1e-4;
static const float SCATTERED = 1.2;

// Diffuse light by the gradient (Levoy 1988), and a highlight of the key lamp (Blinn 1977, exponent 16).
float3 shade(float3 color, float3 gradient, float3 dir, Room room)
{
    float steepness = length(gradient);
    float3 normal = -gradient / max(steepness, FLAT_STEP);
    if (dot(normal, dir) > 0.0) normal = -normal;
    float3 unlit = SCATTERED * color * lightOn(-dir, room);
    if (steepness < FLAT_STEP) return unlit;
    float gloss = max(dot(normal, normalize(room.key - dir)), 0.0);
    gloss *= gloss;
    gloss *= gloss;
    gloss *= gloss;
    gloss *= gloss;
    float3 facing = color * lightOn(normal, room) + GLOSS * gloss * KEY_LIGHT;
    return lerp(unlit, facing, smoothstep(NOISE_STEP, BOUNDARY_STEP, steepness));
}

// Number of steps that a ray may take in this tile. All tiles on the ray share _Steps by the ray's length in each.
int stepsOf(float span, float whole)
{
    float share = min(1.0, span / max(whole, 1e-6));
    return clamp((int)(share * (_Steps - _Spare) + 1e-3), 1, MAX_STEPS);
}

// Returns linear RGBA, premultiplied. `dir` has unit length, so distances along the ray are um. Voxels beyond the
// distance `scene` are hidden. `shift` is the position of the sample within its step, 0..1.
float4 march(float3 eye, float3 dir, float scene, float shift, Room room)
{
    float3 invDir = inverseOf(dir);
    float2 span = intersectBox(eye, invDir, float3(0.0, 0.0, 0.0), _Size.xyz);
    span.x = max(span.x, 0.0);
    float2 whole = intersectBox(eye, invDir, _AllLow.xyz, _AllHigh.xyz);
    int steps = stepsOf(span.y - span.x, whole.y - max(whole.x, 0.0));
    // From here on, t is the distance from the entry into the box. The distance from a far eye would be too coarse for
    // 32-bit floats.
    float end = min(span.y, scene) - span.x;
    float3 texPerUm = (_TexHigh.xyz - _TexLow.xyz) / _Size.xyz;
    float3 start = eye + span.x * dir;
    float3 face = span.x > 0.0 ? cutFace(start) : float3(0.0, 0.0, 0.0);
    bool isCut = dot(face, face) > 0.0;
    float3 texStart = _TexLow.xyz + start * texPerUm;
    float3 texDir = dir * texPerUm;
    float4 sum = float4(0.0, 0.0, 0.0, 0.0);
    float t = 0.0;
    UNITY_LOOP
    for (int i = 0; i < MAX_STEPS; i++)
    {
        if (i >= steps || t >= end || sum.a >= OPAQUE) break;
        // The rest of the ray is divided by the rest of the steps, so the ray always reaches its end.
        float dt = min(max(_MinStep, (end - t) / (float)(steps - i)), end - t);
        float3 p = texStart + (t + shift * dt) * texDir;
        Seen seen = classify(sampleIntensities(p), dt / _Voxel);
        float a = seen.color.a;
        if (a > 0.0)
        {
            float3 color = seen.color.rgb;
            if (_Shading > 0.0)
            {
                float3 gradient = -face;
                if (!isCut || t >= _Voxel) gradient = gradientAt(p, texPerUm, seen.shares);
                color = lerp(color, shade(color, gradient, dir, room), _Shading);
            }
            float visible = (1.0 - sum.a) * a;
            sum += visible * float4(color.x, color.y, color.z, 1.0);
        }
        t += dt;
    }
    // A ray that ended early is treated as fully opaque, with the colour of the part in front.
    return sum.a >= OPAQUE ? sum / sum.a : sum;
}

// Offset of a pixel's samples, 0..1, which turns bands into fine grain (interleaved gradient noise, Jimenez 2014).
float grain(float2 pixel)
{
    return frac(52.9829189 * frac(0.06711056 * pixel.x + 0.00583715 * pixel.y));
}

#endif
