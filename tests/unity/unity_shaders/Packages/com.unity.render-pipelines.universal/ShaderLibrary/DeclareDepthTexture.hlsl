// Stub of the universal pipeline's functions for the scene's depth.
TEXTURE2D_X(_CameraDepthTexture);
SAMPLER(sampler_PointClamp);

float SampleSceneDepth(float2 uv)
{
    return SAMPLE_TEXTURE2D_X(_CameraDepthTexture, sampler_PointClamp, uv).r;
}
