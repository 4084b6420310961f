// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;

namespace StereoCell
{
    /// <summary>Computes how many bytes of memory volumes take. The importer chooses levels by these numbers, and the runtime
    /// unloads tiles by them.</summary>
    public static class VolumeMemory
    {
        /// <summary>Bytes. Size of DEFLATE's window, its tables and the file's buffer, rounded up.</summary>
        const long ReaderBytes = 256 << 10;

        /// <summary>Number of slices that are read ahead of the upload.</summary>
        public const int SlicesAhead = 4;

        /// <summary>Bytes of the texture of one box.</summary>
        public static long TextureBytes(int[] size, int channels)
        {
            return (long)size[0] * size[1] * size[2] * VolumeFile.ComponentsOf(channels);
        }

        /// <summary>Bytes that loading a box takes besides its texture. They hold the slices that were read ahead, the
        /// planes of one slice, and two copies of the slice in transfer: in main memory and on the GPU.</summary>
        public static long LoadingBytes(int[] size, int channels)
        {
            long plane = (long)size[0] * size[1], texels = plane * VolumeFile.ComponentsOf(channels);
            return (SlicesAhead + 2) * texels + plane * channels + ReaderBytes;
        }

        /// <summary>Peak bytes of a tile: the textures of all its boxes, and the loading of the largest box. Boxes are
        /// loaded one after another.</summary>
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
