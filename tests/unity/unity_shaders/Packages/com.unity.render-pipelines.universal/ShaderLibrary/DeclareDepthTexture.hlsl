// The scene's depth, by the universal pipeline's names.
TEXTURE2D_X(_CameraDepthTexture);
SAMPLER(sampler_PointClamp);

float SampleSceneDepth(float2 uv)
{
    return SAMPLE_TEXTURE2D_X(_CameraDepthTexture, sampler_PointClamp, uv).r;
}
