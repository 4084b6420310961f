// The pass that draws the volume in a tile's box. The shader includes builtin.hlsl or universal.hlsl before this file.
#ifndef STEREOCELL_VOLUME_PASS
#define STEREOCELL_VOLUME_PASS

#include "volume_material.hlsl"

float4 sampleIntensities(float3 p)
{
    return _Volume.SampleLevel(sampler_Volume, p, 0);
}

float4 lookUp(int c, float intensity)
{
    float2 at = float2((intensity * 255.0 + 0.5) / 256.0, _Rows[c]);
    return _Table.SampleLevel(sampler_Table, at, 0);
}

#include "march.hlsl"

struct Vertex
{
    float4 position : POSITION;
    UNITY_VERTEX_INPUT_INSTANCE_ID
};

struct Fragment
{
    float4 clip : SV_POSITION;
    float3 place : TEXCOORD0;  // um, the box's space
    float4 screen : TEXCOORD1;
    float viewDepth : TEXCOORD2;  // world units
    UNITY_VERTEX_INPUT_INSTANCE_ID
    UNITY_VERTEX_OUTPUT_STEREO
};

float3 toBox(float4 object)
{
    return float3(dot(_ToBox0, object), dot(_ToBox1, object), dot(_ToBox2, object));
}

float3 directionInBox(float3 world)
{
    return normalize(toBox(float4(objectDirectionOf(world), 0.0)));
}

// Unit vector in the box's space towards a lamp that moves with the eye. `inEye` has the eye's axes: right, up, back.
float3 lampInBox(float3 inEye)
{
    return directionInBox(mul(inEye, (float3x3)UNITY_MATRIX_V));
}

Fragment vert(Vertex vertex)
{
    Fragment o;
    UNITY_SETUP_INSTANCE_ID(vertex);
    UNITY_INITIALIZE_OUTPUT(Fragment, o);
    UNITY_TRANSFER_INSTANCE_ID(vertex, o);
    UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(o);
    float4 object = float4(vertex.position.xyz, 1.0);
    o.clip = clipOf(object.xyz);
    o.place = toBox(object);
    o.screen = screenOf(o.clip);
    o.viewDepth = depthOf(object.xyz);
    return o;
}

float4 frag(Fragment i) : SV_Target
{
    UNITY_SETUP_INSTANCE_ID(i);
    UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(i);
    float3 eye = toBox(float4(objectOf(eyeInWorld()), 1.0));
    float3 ray = i.place - eye;
    float back = length(ray);
    float scene = 1e30;
    UNITY_BRANCH
    if (_SceneDepth > 0.5) scene = back * sceneDepthAt(i.screen, i.clip.xy) / i.viewDepth;
    Room room;
    room.key = lampInBox(float3(-1.2, 1.6, 2.5));
    room.fill = lampInBox(float3(1.8, -0.4, 1.8));
    room.up = directionInBox(float3(0.0, 1.0, 0.0));
    float shift = lerp(0.5, grain(i.clip.xy), _Grain);
    float4 light = march(eye, ray / back, scene, shift, room);
    #ifdef UNITY_COLORSPACE_GAMMA
    light.rgb = gammaOf(light.rgb / max(light.a, 1e-6)) * light.a;
    #endif
    return light;
}

#endif
