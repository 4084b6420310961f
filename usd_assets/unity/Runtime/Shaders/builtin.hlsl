// Functions of the built-in render pipeline under the names that volume_pass.hlsl uses.
#ifndef STEREOCELL_BUILTIN
#define STEREOCELL_BUILTIN

#include "UnityCG.cginc"

UNITY_DECLARE_TEX3D(_Volume);
UNITY_DECLARE_TEX2D(_Table);
UNITY_DECLARE_DEPTH_TEXTURE(_CameraDepthTexture);

float4 clipOf(float3 object)
{
    return UnityObjectToClipPos(object);
}

// Distance of a place from the eye's plane, world units.
float depthOf(float3 object)
{
    return -UnityObjectToViewPos(object).z;
}

float3 objectOf(float3 world)
{
    return mul(unity_WorldToObject, float4(world, 1.0)).xyz;
}

float3 objectDirectionOf(float3 world)
{
    return mul((float3x3)unity_WorldToObject, world);
}

float3 eyeInWorld()
{
    return _WorldSpaceCameraPos;
}

// Distance of the nearest surface from the eye's plane, world units. `screen` is screenOf(clip) of this pixel.
float sceneDepthAt(float4 screen, float2 pixel)
{
    return LinearEyeDepth(SAMPLE_DEPTH_TEXTURE_PROJ(_CameraDepthTexture, UNITY_PROJ_COORD(screen)));
}

float4 screenOf(float4 clip)
{
    return ComputeScreenPos(clip);
}

float3 gammaOf(float3 light)
{
    return LinearToGammaSpace(light);
}

#endif
