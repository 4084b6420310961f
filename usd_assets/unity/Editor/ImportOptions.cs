// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell.Editor
{
    [Serializable]
    public sealed class ImportOptions
    {
        [Min(0.001f), Tooltip("Length of the specimen's longest edge in the scene, in units. The scale of the root is set to it.")]
        public float longestEdge = 0.5f;

        [Min(8), Tooltip("Largest number of texels along an edge of a tile's volume. If there are more, a coarser resolution level is imported.")]
        public int mostTexels = 256;

        [Min(1), Tooltip("Largest memory of a tile's volumes while they are loaded, in MB. If they need more, a coarser resolution level is imported.")]
        public float budget = 40;

        [Min(0.1f), Tooltip("Largest error of a level of detail on the screen, in pixels.")]
        public float errorPixels = 2;

        [Min(1), Tooltip("Height of the screen, or of the image for one eye, in pixels.")]
        public int screenPixels = 1080;

        const int MostOfUnity = 2048;  // largest number of texels along an edge of a 3D texture in Unity

        /// <summary>
        /// The finest mip level at which no box of a tile has too many texels along an edge, and all boxes together
        /// fit into the budget. The coarsest level is returned if no level fits.
        /// </summary>
        /// <param name="boxes">Sizes of each box's levels, finest first, and its number of channels.</param>
        public int LevelFor(IList<KeyValuePair<int[][], int>> boxes)
        {
            var levels = int.MaxValue;
            foreach (var box in boxes) levels = Math.Min(levels, box.Key.Length);
            for (var level = 0; level < levels; level++)
            {
                var sizes = new List<KeyValuePair<int[], int>>();
                var edge = 0;
                foreach (var box in boxes)
                {
                    var size = box.Key[level];
                    sizes.Add(new KeyValuePair<int[], int>(size, box.Value));
                    edge = Math.Max(edge, Math.Max(size[0], Math.Max(size[1], size[2])));
                }
                if (edge <= Math.Min(mostTexels, MostOfUnity) && VolumeMemory.PeakBytes(sizes) <= budget * 1e6) return level;
            }
            return levels - 1;
        }
    }
}
