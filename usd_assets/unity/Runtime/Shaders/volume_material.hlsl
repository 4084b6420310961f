// All values of a volume's material. The block must be the same in every pass, or the scriptable render pipelines
// cannot batch. Each value is also a property of the shader.
#ifndef STEREOCELL_VOLUME_MATERIAL
#define STEREOCELL_VOLUME_MATERIAL

CBUFFER_START(UnityPerMaterial)
float4 _Size;  // um, edges of the box
float4 _TexLow;  // texture coordinates at the box's low corner
float4 _TexHigh;  // texture coordinates at the box's high corner
float4 _AllLow;  // um, in the box's space: the box around all tiles, from _AllLow to _AllHigh
float4 _AllHigh;
float4 _ToBox0;  // rows of the matrix from the object's space to the box's
float4 _ToBox1;
float4 _ToBox2;
float4 _Rows;  // 0..1: texture coordinate of each channel's transfer function in the table
float4 _Shown;  // 0 or 1: whether each channel is visible
float4 _Color0;  // linear RGB of each channel
float4 _Color1;
float4 _Color2;
float4 _Color3;
float _Voxel;  // um: length of path for which the transfer functions state opacities
float _MinStep;  // um: shortest step
float _Steps;  // steps of the whole ray, at most MAX_STEPS
float _Spare;  // steps that are reserved for the other tiles, one for each but at most 50
float _Shading;  // 0..1: share of the light by lamps
float _Grain;  // 0..1: strength of the grain that replaces bands
float _SceneDepth;  // 0 or 1: whether rays end at surfaces
float _ZTest;  // read only by the state of the pass
CBUFFER_END

#endif
