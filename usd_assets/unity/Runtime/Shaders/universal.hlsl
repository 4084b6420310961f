// Functions of the universal render pipeline under the names that volume_pass.hlsl uses.
#ifndef STEREOCELL_UNIVERSAL
#define STEREOCELL_UNIVERSAL

#include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"
#include "Packages/com.unity.render-pipelines.core/ShaderLibrary/Color.hlsl"
#include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/DeclareDepthTexture.hlsl"

TEXTURE3D(_Volume);
SAMPLER(sampler_Volume);
TEXTURE2D(_Table);
SAMPLER(sampler_Table);

#ifndef UNITY_INITIALIZE_OUTPUT
#define UNITY_INITIALIZE_OUTPUT(type, name) ZERO_INITIALIZE(type, name)
#endif

float4 clipOf(float3 object)
{
    return TransformObjectToHClip(object);
}

// Distance of a place from the eye's plane, world units.
float depthOf(float3 object)
{
    return -TransformWorldToView(TransformObjectToWorld(object)).z;
}

float3 objectOf(float3 world)
{
    return TransformWorldToObject(world);
}

float3 objectDirectionOf(float3 world)
{
    return mul((float3x3)GetWorldToObjectMatrix(), world);
}

float3 eyeInWorld()
{
    return GetCameraPositionWS();
}

// Distance of the nearest surface from the eye's plane, world units. `pixel` is the fragment's SV_POSITION.
float sceneDepthAt(float4 screen, float2 pixel)
{
    return LinearEyeDepth(SampleSceneDepth(GetNormalizedScreenSpaceUV(pixel)), _ZBufferParams);
}

float4 screenOf(float4 clip)
{
    return clip;  // not used: sceneDepthAt takes the pixel's position instead
}

float3 gammaOf(float3 light)
{
    return LinearToSRGB(light);
}

#endif
