// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;

namespace StereoCell
{
    /// <summary>Bytes that volumes take in memory: the importer chooses levels by them, and tiles are unloaded by them.</summary>
    public static class VolumeMemory
    {
        /// <summary>Bytes of DEFLATE's window, of its tables and of the file's buffer, rounded up.</summary>
        const long ReaderBytes = 256 << 10;

        /// <summary>Slices that are read ahead of the upload.</summary>
        public const int SlicesAhead = 4;

        /// <summary>The texture of one box.</summary>
        public static long TextureBytes(int[] size, int channels)
        {
            return (long)size[0] * size[1] * size[2] * VolumeFile.ComponentsOf(channels);
        }

        /// <summary>What loading a box takes besides its texture: slices that wait, one slice's planes, and the slice
        /// that is copied, once in main memory and once on the GPU.</summary>
        public static long LoadingBytes(int[] size, int channels)
        {
            long plane = (long)size[0] * size[1], texels = plane * VolumeFile.ComponentsOf(channels);
            return (SlicesAhead + 2) * texels + plane * channels + ReaderBytes;
        }

        /// <summary>The most that a tile takes: the textures of all its boxes, which are loaded one after another.</summary>
        public static long PeakBytes(IEnumerable<KeyValuePair<int[], int>> boxes)
        {
            long textures = 0, loading = 0;
            foreach (var box in boxes)
            {
                textures += TextureBytes(box.Key, box.Value);
                loading = Math.Max(loading, LoadingBytes(box.Key, box.Value));
            }
            return textures + loading;
        }
    }
}
