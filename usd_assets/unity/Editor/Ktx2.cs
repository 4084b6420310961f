// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;

namespace StereoCell.Editor
{
    /// <summary>Reads one level of a bundle's KTX 2.0 textures, which are R8 or RGBA8 and packed by zstd. The package
    /// KTX for Unity cannot be used: it makes only 2D textures.</summary>
    public sealed class Ktx2
    {
        static readonly byte[] Identifier = { 0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32, 0x30, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A };
        const int Head = 80;
        const int ZstdScheme = 2;

        public readonly int Width;
        public readonly int Height;
        public readonly int Depth;
        public readonly int Components;

        /// <summary>Bytes: x is fastest, then rows, then slices. The components of a texel are adjacent.</summary>
        public readonly byte[] Texels;

        public Ktx2(byte[] data, int level)
        {
            if (data.Length < Head) throw new InvalidDataException("the file is not a KTX 2.0 texture");
            for (var i = 0; i < Identifier.Length; i++)
            {
                if (data[i] != Identifier[i]) throw new InvalidDataException("the file is not a KTX 2.0 texture");
            }
            var format = BitConverter.ToInt32(data, 12);
            Components = format == 9 ? 1 : format == 37 ? 4 : 0;  // VK_FORMAT_R8_UNORM, R8G8B8A8_UNORM
            var levels = BitConverter.ToInt32(data, 40);
            if (Components == 0 || BitConverter.ToInt32(data, 44) != ZstdScheme)
            {
                throw new InvalidDataException("the texture has VK_FORMAT " + format + ", expected R8 or RGBA8 texels, compressed by zstd");
            }
            if (level < 0 || level >= levels || data.Length < Head + 24 * levels) throw new InvalidDataException("the texture has no level " + level);
            Width = Math.Max(1, BitConverter.ToInt32(data, 20) >> level);
            Height = Math.Max(1, BitConverter.ToInt32(data, 24) >> level);
            Depth = Math.Max(1, BitConverter.ToInt32(data, 28) >> level);
            var at = Head + 24 * level;
            long offset = BitConverter.ToInt64(data, at), length = BitConverter.ToInt64(data, at + 8);
            var size = BitConverter.ToInt64(data, at + 16);
            if (size != (long)Width * Height * Depth * Components || size > int.MaxValue || offset < 0 || length < 0
                || offset > data.Length - length)
            {
                throw new InvalidDataException("level " + level + " of the texture does not fit the file");
            }
            Texels = Zstd.Unpack(data, (int)offset, (int)length, (int)size);
        }
    }
}
