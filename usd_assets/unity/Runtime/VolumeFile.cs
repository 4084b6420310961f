// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.IO.Compression;
using System.Text;

namespace StereoCell
{
    /// <summary>
    /// Reads and writes the voxel file of one box, slice by slice. The file starts with "SCV1" and four little-endian
    /// int32: width, rows, slices, and channels (1 to 4). A DEFLATE stream follows, which has the plane of each channel for
    /// each slice. Unity has a decoder for DEFLATE on every platform. Reading needs memory for two slices.
    /// </summary>
    public sealed class VolumeFile : IDisposable
    {
        public const int HeadBytes = 20;
        const string Magic = "SCV1";

        public readonly int Width;
        public readonly int Height;
        public readonly int Depth;
        public readonly int Channels;

        readonly Stream inner;
        readonly DeflateStream packed;
        readonly byte[] planes;
        int slicesRead;

        /// <summary>Open a file for reading. The stream is closed when this object is disposed.</summary>
        public VolumeFile(Stream stream)
        {
            inner = stream;
            var head = new byte[HeadBytes];
            if (ReadFully(stream, head) < HeadBytes || Encoding.ASCII.GetString(head, 0, 4) != Magic)
            {
                throw new InvalidDataException("found another file, expected a voxel file of the StereoCell package");
            }
            Width = BitConverter.ToInt32(head, 4);
            Height = BitConverter.ToInt32(head, 8);
            Depth = BitConverter.ToInt32(head, 12);
            Channels = BitConverter.ToInt32(head, 16);
            var isSound = Width > 0 && Height > 0 && Depth > 0 && Channels > 0 && Channels <= 4 && (long)Width * Height <= 1 << 22;
            if (!isSound) throw new InvalidDataException("the volume's size is damaged");
            packed = new DeflateStream(stream, CompressionMode.Decompress);
            planes = new byte[Width * Height * Channels];
        }

        /// <summary>Number of components of a texel. Textures can have 1, 2 or 4, so 3 channels take 4.</summary>
        public static int ComponentsOf(int channels)
        {
            return channels > 2 ? 4 : channels;
        }

        /// <summary>Read the next slice into an array. The components of a texel are adjacent.</summary>
        public void ReadSlice(byte[] texels)
        {
            if (ReadFully(packed, planes) < planes.Length)
            {
                throw new InvalidDataException("the volume ends after slice " + slicesRead + " of " + Depth);
            }
            slicesRead++;
            int plane = Width * Height, stride = ComponentsOf(Channels);
            for (var channel = 0; channel < Channels; channel++)
            {
                var from = channel * plane;
                for (int i = 0, to = channel; i < plane; i++, to += stride) texels[to] = planes[from + i];
            }
        }

        /// <param name="volumes">The texels of each channel, with x fastest, then rows, then slices.</param>
        public static void Write(Stream stream, int width, int height, int depth, byte[][] volumes)
        {
            stream.Write(Encoding.ASCII.GetBytes(Magic), 0, 4);
            foreach (var number in new[] { width, height, depth, volumes.Length }) stream.Write(BitConverter.GetBytes(number), 0, 4);
            using (var packed = new DeflateStream(stream, CompressionLevel.Fastest, true))
            {
                for (var slice = 0; slice < depth; slice++)
                {
                    foreach (var volume in volumes) packed.Write(volume, slice * width * height, width * height);
                }
            }
        }

        public void Dispose()
        {
            if (packed != null) packed.Dispose();
            inner.Dispose();
        }

        static int ReadFully(Stream stream, byte[] into)
        {
            var done = 0;
            while (done < into.Length)
            {
                var count = stream.Read(into, done, into.Length - done);
                if (count == 0) break;
                done += count;
            }
            return done;
        }
    }
}
