// SPDX-License-Identifier: Apache-2.0
using Unity.Collections;
using UnityEngine;
using UnityEngine.Experimental.Rendering;
using UnityEngine.Rendering;

namespace StereoCell
{
    /// <summary>
    /// A 3D texture that is filled slice by slice. If the GPU can copy slices, a render texture is used. It has no copy in
    /// main memory, so at most one slice exists twice. Otherwise a Texture3D is filled in main memory and uploaded as a
    /// whole.
    /// </summary>
    public sealed class VolumeTexture
    {
        const CopyTextureSupport Needed =
            CopyTextureSupport.Copy3D | CopyTextureSupport.DifferentTypes | CopyTextureSupport.TextureToRT;

        readonly int sliceBytes;
        readonly RenderTexture target;
        readonly Texture3D whole;
        Texture2D slice;

        public VolumeTexture(int[] size, int channels)
        {
            var components = VolumeFile.ComponentsOf(channels);
            sliceBytes = size[0] * size[1] * components;
            var format = components == 1 ? TextureFormat.R8 : components == 2 ? TextureFormat.RG16 : TextureFormat.RGBA32;
            if (CopiesSlices)
            {
                var onGpu = components == 1 ? GraphicsFormat.R8_UNorm
                    : components == 2 ? GraphicsFormat.R8G8_UNorm : GraphicsFormat.R8G8B8A8_UNorm;
                var descriptor = new RenderTextureDescriptor(size[0], size[1], onGpu, 0)
                {
                    dimension = TextureDimension.Tex3D,
                    volumeDepth = size[2],
                };
                target = new RenderTexture(descriptor);
                target.Create();
                slice = new Texture2D(size[0], size[1], format, false, true);
            }
            else
            {
                whole = new Texture3D(size[0], size[1], size[2], format, false);
            }
            Texture.wrapMode = TextureWrapMode.Clamp;
            Texture.filterMode = FilterMode.Bilinear;
            Texture.hideFlags = HideFlags.HideAndDontSave;
        }

        public static bool CopiesSlices
        {
            get { return (SystemInfo.copyTextureSupport & Needed) == Needed; }
        }

        public Texture Texture
        {
            get { return target != null ? (Texture)target : whole; }
        }

        /// <summary>Whether the GPU has lost the texture. This can happen when an application on a phone comes to the front
        /// again.</summary>
        public bool IsLost
        {
            get { return target != null && !target.IsCreated(); }
        }

        public void Upload(int index, byte[] texels)
        {
            if (target == null)
            {
                NativeArray<byte>.Copy(texels, 0, whole.GetPixelData<byte>(0), index * sliceBytes, sliceBytes);
                return;
            }
            slice.SetPixelData(texels, 0);
            slice.Apply(false, false);
            Graphics.CopyTexture(slice, 0, 0, target, index, 0);
        }

        /// <summary>Free the memory that only loading needs. Call this after the last slice.</summary>
        public void Finish()
        {
            if (whole != null) whole.Apply(false, true);
            Discard(slice);
            slice = null;
        }

        public void Destroy()
        {
            Discard(slice);
            if (target != null) target.Release();
            Discard(Texture);
        }

        internal static void Discard(Object made)
        {
            if (made == null) return;
            if (Application.isPlaying) Object.Destroy(made);
            else Object.DestroyImmediate(made);
        }
    }
}
