// Stub of the names from the universal pipeline's includes that the package's shader uses, to compile it without Unity.
// The matrices are those of one camera. With UNITY_STEREO_INSTANCING_ENABLED, they are those of the instance's eye.
#ifndef UNIVERSAL_CORE
#define UNIVERSAL_CORE

#define CBUFFER_START(name) cbuffer name {
#define CBUFFER_END };
#define UNITY_BRANCH [branch]
#define UNITY_LOOP [loop]
#define UNITY_UNROLL [unroll]
#define TEXTURE2D(name) Texture2D name
#define TEXTURE3D(name) Texture3D name
#define SAMPLER(name) SamplerState name
#define ZERO_INITIALIZE(type, name) name = (type)0;

CBUFFER_START(UnityPerDraw)
float4x4 unity_ObjectToWorld;
float4x4 unity_WorldToObject;
CBUFFER_END

float4 _ProjectionParams;
float4 _ZBufferParams;
float4 _ScaledScreenParams;

#ifdef UNITY_STEREO_INSTANCING_ENABLED
CBUFFER_START(UnityStereoViewBuffer)
float4x4 unity_StereoMatrixV[2];
float4x4 unity_StereoMatrixVP[2];
float4 unity_StereoWorldSpaceCameraPos[2];
CBUFFER_END
static uint unity_StereoEyeIndex;
#define UNITY_MATRIX_V unity_StereoMatrixV[unity_StereoEyeIndex]
#define UNITY_MATRIX_VP unity_StereoMatrixVP[unity_StereoEyeIndex]
#define _WorldSpaceCameraPos unity_StereoWorldSpaceCameraPos[unity_StereoEyeIndex].xyz
#define UNITY_VERTEX_INPUT_INSTANCE_ID uint instanceID : SV_InstanceID;
#define UNITY_VERTEX_OUTPUT_STEREO uint stereoTargetEyeIndexAsRTArrayIdx : SV_RenderTargetArrayIndex;
#define UNITY_SETUP_INSTANCE_ID(input) unity_StereoEyeIndex = input.instanceID & 1;
#define UNITY_TRANSFER_INSTANCE_ID(input, output) output.instanceID = input.instanceID;
#define UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(output) output.stereoTargetEyeIndexAsRTArrayIdx = unity_StereoEyeIndex;
#define UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(input) unity_StereoEyeIndex = input.stereoTargetEyeIndexAsRTArrayIdx;
#define TEXTURE2D_X(name) Texture2DArray name
#define SAMPLE_TEXTURE2D_X(name, state, uv) name.Sample(state, float3(uv, unity_StereoEyeIndex))
#else
float4x4 unity_MatrixV;
float4x4 unity_MatrixVP;
float3 _WorldSpaceCameraPos;
#define UNITY_MATRIX_V unity_MatrixV
#define UNITY_MATRIX_VP unity_MatrixVP
#define UNITY_VERTEX_INPUT_INSTANCE_ID
#define UNITY_VERTEX_OUTPUT_STEREO
#define UNITY_SETUP_INSTANCE_ID(input)
#define UNITY_TRANSFER_INSTANCE_ID(input, output)
#define UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(output)
#define UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(input)
#define TEXTURE2D_X(name) Texture2D name
#define SAMPLE_TEXTURE2D_X(name, state, uv) name.Sample(state, uv)
#endif

float4x4 GetWorldToObjectMatrix()
{
    return unity_WorldToObject;
}

float3 GetCameraPositionWS()
{
    return _WorldSpaceCameraPos;
}

float3 TransformObjectToWorld(float3 place)
{
    return mul(unity_ObjectToWorld, float4(place, 1.0)).xyz;
}

float3 TransformWorldToObject(float3 place)
{
    return mul(unity_WorldToObject, float4(place, 1.0)).xyz;
}

float3 TransformWorldToView(float3 place)
{
    return mul(UNITY_MATRIX_V, float4(place, 1.0)).xyz;
}

float4 TransformObjectToHClip(float3 place)
{
    return mul(UNITY_MATRIX_VP, float4(TransformObjectToWorld(place), 1.0));
}

float LinearEyeDepth(float depth, float4 zBufferParam)
{
    return 1.0 / (zBufferParam.z * depth + zBufferParam.w);
}

float2 GetNormalizedScreenSpaceUV(float2 positionCS)
{
    return positionCS / max(_ScaledScreenParams.xy, 1.0);
}

#endif
