// All numbers of a volume's material, the same in every pass: the scriptable render pipelines batch by this block.
// Each is among the shader's properties as well.
#ifndef STEREOCELL_VOLUME_MATERIAL
#define STEREOCELL_VOLUME_MATERIAL

CBUFFER_START(UnityPerMaterial)
float4 _Size;  // um, edges of the box
float4 _TexLow;  // texture coordinates at the box's low corner ...
float4 _TexHigh;  // ... and at its high corner
float4 _AllLow;  // um, the same space: the box around all tiles, which share a ray's steps by length
float4 _AllHigh;
float4 _ToBox0;  // rows of the matrix from the object's space to the box's
float4 _ToBox1;
float4 _ToBox2;
float4 _Rows;  // 0..1: where each channel's transfer function lies in the table
float4 _Shown;  // 0..1 of each channel
float4 _Color0;  // linear RGB of each channel
float4 _Color1;
float4 _Color2;
float4 _Color3;
float _Voxel;  // um: the opacities of the transfer functions hold for a path this long
float _MinStep;  // um
float _Steps;  // for the whole ray, at most MAX_STEPS
float _Spare;  // of these, one for each other tile
float _Shading;  // 0..1: by how much the room's light counts
float _Grain;  // 0..1: grain in place of bands
float _SceneDepth;  // 1: rays end at surfaces
float _ZTest;  // for the pass's state alone
CBUFFER_END

#endif
