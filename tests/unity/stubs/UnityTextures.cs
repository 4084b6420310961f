// Stub of UnityEngine's textures. It adds up the bytes of all textures in main memory and on the GPU, so that a test can
// compare them with the limit that the package computes.
using System;
using System.Linq;
using Unity.Collections;
using UnityEngine.Experimental.Rendering;
using UnityEngine.Rendering;

namespace UnityEngine
{
    public class Texture : Object
    {
        public static long HeldBytes, MostBytes;  // only in the stub: bytes of all textures now, and their maximum
        long held;
        public virtual int width { get; set; }
        public virtual int height { get; set; }
        public TextureWrapMode wrapMode { get; set; }
        public FilterMode filterMode { get; set; }
        public byte[] Data;  // only in the stub: the texels
        public string Format;
        protected void Hold(long bytes)
        {
            HeldBytes += bytes - held;
            held = bytes;
            MostBytes = Math.Max(MostBytes, HeldBytes);
        }
        internal override void OnGone() { Hold(0); }
    }

    public class Texture2D : Texture
    {
        public bool IsLinear;
        public Texture2D(int width, int height, TextureFormat textureFormat, bool mipChain, bool linear)
        {
            this.width = width;
            this.height = height;
            Format = textureFormat.ToString();
            IsLinear = linear;
            Data = new byte[width * height * Texels.BytesOf(textureFormat)];
            Hold(2 * Data.Length);
        }
        public void SetPixelData<T>(T[] data, int mipLevel, int sourceDataStartIndex = 0)
        {
            if (data.Length != Data.Length) throw new ArgumentException("found " + data.Length + " bytes, expected " + Data.Length);
            Buffer.BlockCopy(data, 0, Data, 0, Data.Length);
        }
        public byte[] GetRawTextureData() { return (byte[])Data.Clone(); }
        public void LoadRawTextureData(byte[] data) { SetPixelData(data, 0); }
        public void Apply(bool updateMipmaps, bool makeNoLongerReadable) { }
    }

    public sealed class Texture3D : Texture
    {
        public Texture3D(int width, int height, int depth, TextureFormat textureFormat, bool mipChain)
        {
            this.width = width;
            this.height = height;
            this.depth = depth;
            Format = textureFormat.ToString();
            Data = new byte[width * height * depth * Texels.BytesOf(textureFormat)];
            Hold(2 * Data.Length);
        }
        public int depth { get; private set; }
        public NativeArray<T> GetPixelData<T>(int mipLevel) where T : struct { return new NativeArray<T> { Bytes = Data }; }
        public void Apply(bool updateMipmaps, bool makeNoLongerReadable) { if (makeNoLongerReadable) Hold(Data.Length); }
    }

    public struct RenderTextureDescriptor
    {
        public RenderTextureDescriptor(int width, int height, GraphicsFormat colorFormat, int depthBufferBits) : this()
        {
            this.width = width;
            this.height = height;
            graphicsFormat = colorFormat;
        }
        public int width { get; set; }
        public int height { get; set; }
        public int volumeDepth { get; set; }
        public TextureDimension dimension { get; set; }
        public GraphicsFormat graphicsFormat { get; set; }
    }

    public class RenderTexture : Texture
    {
        readonly int stride;
        bool isCreated;
        public RenderTexture(RenderTextureDescriptor desc)
        {
            width = desc.width;
            height = desc.height;
            volumeDepth = desc.volumeDepth;
            if (desc.dimension != TextureDimension.Tex3D) throw new NotSupportedException();
            stride = desc.graphicsFormat == GraphicsFormat.R8_UNorm ? 1 : desc.graphicsFormat == GraphicsFormat.R8G8_UNorm ? 2 : 4;
            Format = stride == 1 ? "R8" : stride == 2 ? "RG16" : "RGBA32";
        }
        public int volumeDepth { get; set; }
        public bool Create()
        {
            Data = new byte[width * height * volumeDepth * stride];
            Hold(Data.Length);
            return isCreated = true;
        }
        public bool IsCreated() { return isCreated; }
        public void Release() { isCreated = false; Hold(0); }
    }

    static class Texels
    {
        public static int BytesOf(TextureFormat format) { return format == TextureFormat.R8 ? 1 : format == TextureFormat.RG16 ? 2 : 4; }
    }

    public class Graphics
    {
        public static long CopiedBytes;  // only in the stub
        public static void CopyTexture(Texture src, int srcElement, int srcMip, Texture dst, int dstElement, int dstMip)
        {
            if (src.Format != dst.Format || src.width != dst.width || src.height != dst.height) throw new ArgumentException("textures that differ");
            CopiedBytes += src.Data.Length;
            Buffer.BlockCopy(src.Data, 0, dst.Data, dstElement * src.Data.Length, src.Data.Length);
        }
    }

    public sealed class SystemInfo
    {
        public static CopyTextureSupport copyTextureSupport { get; set; }  // read-only in Unity
    }
}

namespace UnityEngine.Experimental.Rendering
{
    public enum GraphicsFormat { None = 0, R8_UNorm = 5, R8G8_UNorm = 6, R8G8B8A8_UNorm = 8 }
}

namespace UnityEngine.Rendering
{
    public enum ShadowCastingMode { Off, On, TwoSided, ShadowsOnly }
    public enum TextureDimension { Unknown = -1, None = 0, Any = 1, Tex2D = 2, Tex3D = 3, Cube = 4, Tex2DArray = 5, CubeArray = 6 }
    [Flags] public enum CopyTextureSupport { None = 0, Basic = 1, Copy3D = 2, DifferentTypes = 4, TextureToRT = 8, RTToTexture = 16 }
    public class RenderPipelineAsset : Object { }
    public sealed class GraphicsSettings
    {
        public static RenderPipelineAsset currentRenderPipeline { get; set; }  // read-only in Unity
    }
}

namespace Unity.Collections
{
    public struct NativeArray<T> where T : struct
    {
        internal byte[] Bytes;
        public static void Copy(T[] src, int srcIndex, NativeArray<T> dst, int dstIndex, int length)
        {
            Buffer.BlockCopy(src, srcIndex, dst.Bytes, dstIndex, length);
        }
    }
}
