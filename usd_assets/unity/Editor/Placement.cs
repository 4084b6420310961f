// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>
    /// Positions and sizes of a bundle's tiles and volumes in Unity. The specimen's world is right-handed and Unity's is
    /// left-handed, so x is mirrored, as glTFast does on import. Objects are measured in metres, places inside a volume's
    /// box in um.
    /// </summary>
    public sealed class Placement
    {
        const double MetresPerUm = 1e-6;

        /// <summary>The box's centre, metres.</summary>
        public Vector3 Centre;

        /// <summary>Metres. The box's corners relative to its centre. Bit 0 of the index is x, bit 1 y, bit 2 z.</summary>
        public Vector3[] Corners;

        /// <summary>Three rows of the matrix from metres around the centre to um from the box's low corner.</summary>
        public Vector4[] ToBox;

        public Vector4 Size;
        public Vector4 TexLow;
        public Vector4 TexHigh;
        public float Voxel;

        readonly double[] toBox;  // 3 rows of 4: from um in the mirrored world to the box
        readonly double[][] worldCorners;  // um, in the mirrored world

        public Placement(VolumeEntry volume)
        {
            double[] min = volume.Bounds.Min, max = volume.Bounds.Max, m = volume.Matrix;
            var low = new[] { -max[0], min[1], min[2] };  // low corner of the mirrored box
            var size = new double[3];
            var voxel = double.MaxValue;
            float[] first = new float[3], last = new float[3];
            for (var i = 0; i < 3; i++)
            {
                int n = volume.Size[i], apron = volume.Apron;
                size[i] = max[i] - min[i];
                voxel = Math.Min(voxel, size[i] / Math.Max(1, n - 1 - 2 * apron));
                first[i] = (apron + 0.5f) / n;
                last[i] = (n - apron - 0.5f) / n;
            }
            Size = new Vector4((float)size[0], (float)size[1], (float)size[2], 0);
            Voxel = (float)voxel;
            // In Unity's world both x and y run against the texture's axes: x because it is mirrored, and y because
            // the image's rows run downwards.
            TexLow = new Vector4(last[0], last[1], first[2], 0);
            TexHigh = new Vector4(first[0], first[1], last[2], 0);

            // The matrix for mirrored spaces, row by row: x is mirrored before and after the original matrix.
            var fromBox = new double[12];
            for (var row = 0; row < 3; row++)
            {
                for (var column = 0; column < 4; column++)
                {
                    var isFlipped = row == 0 != (column == 0);
                    fromBox[4 * row + column] = (isFlipped ? -1 : 1) * m[4 * column + row];
                }
            }
            for (var row = 0; row < 3; row++)
            {
                for (var i = 0; i < 3; i++) fromBox[4 * row + 3] += fromBox[4 * row + i] * low[i];
            }
            toBox = Inverse(fromBox);
            worldCorners = new double[8][];
            for (var k = 0; k < 8; k++)
            {
                worldCorners[k] = Apply(fromBox, (k & 1) * size[0], (k >> 1 & 1) * size[1], (k >> 2) * size[2]);
            }
            var centre = Apply(fromBox, size[0] / 2, size[1] / 2, size[2] / 2);
            Centre = ToVector(centre[0] * MetresPerUm, centre[1] * MetresPerUm, centre[2] * MetresPerUm);
            Corners = Array.ConvertAll(worldCorners, at => ToVector(
                (at[0] - centre[0]) * MetresPerUm, (at[1] - centre[1]) * MetresPerUm, (at[2] - centre[2]) * MetresPerUm));
            ToBox = new Vector4[3];
            var offset = Apply(toBox, centre[0], centre[1], centre[2]);
            for (var row = 0; row < 3; row++)
            {
                var turn = Array.ConvertAll(new[] { 0, 1, 2 }, i => (float)(toBox[4 * row + i] / MetresPerUm));
                ToBox[row] = new Vector4(turn[0], turn[1], turn[2], (float)offset[row]);
            }
        }

        /// <summary>The box around all volumes, um, in the space of this volume's box.</summary>
        public void Around(IEnumerable<Placement> all, out Vector4 low, out Vector4 high)
        {
            double[] min = { double.MaxValue, double.MaxValue, double.MaxValue };
            double[] max = { double.MinValue, double.MinValue, double.MinValue };
            foreach (var each in all)
            {
                foreach (var corner in each.worldCorners)
                {
                    var at = Apply(toBox, corner[0], corner[1], corner[2]);
                    for (var i = 0; i < 3; i++)
                    {
                        min[i] = Math.Min(min[i], at[i]);
                        max[i] = Math.Max(max[i], at[i]);
                    }
                }
            }
            low = new Vector4((float)min[0], (float)min[1], (float)min[2], 0);
            high = new Vector4((float)max[0], (float)max[1], (float)max[2], 0);
        }

        /// <summary>Metres. The centre of one of the specimen's boxes in Unity's space.</summary>
        public static Vector3 CentreOf(Box bounds)
        {
            double[] a = bounds.Min, b = bounds.Max;
            return ToVector(
                -(a[0] + b[0]) / 2 * MetresPerUm, (a[1] + b[1]) / 2 * MetresPerUm, (a[2] + b[2]) / 2 * MetresPerUm);
        }

        /// <summary>Metres. The lengths of a box's edges.</summary>
        public static Vector3 SizeOf(Box bounds)
        {
            double[] a = bounds.Min, b = bounds.Max;
            return ToVector((b[0] - a[0]) * MetresPerUm, (b[1] - a[1]) * MetresPerUm, (b[2] - a[2]) * MetresPerUm);
        }

        /// <summary>
        /// For each level of detail, the share of the screen's height below which the next level is drawn. At this share
        /// the largest error of the next level spans <paramref name="errorPixels"/>. The last level has no limit: 0.
        /// </summary>
        /// <param name="levels">Levels of detail, finest first.</param>
        /// <param name="sizeMetres">The LODGroup's size. An object of this size that is as high as the screen has the
        /// share 1.</param>
        public static float[] LodHeights(IList<Level> levels, double sizeMetres, double errorPixels, double screenPixels)
        {
            var heights = new float[levels.Count];
            for (var i = 0; i + 1 < levels.Count; i++)
            {
                var error = levels[i + 1].ErrorMetres;
                var height = error > 0 ? errorPixels * sizeMetres / (error * screenPixels) : 1;
                var most = i == 0 ? 1 : 0.99f * heights[i - 1];  // Unity needs falling shares
                heights[i] = Math.Min((float)height, most);
            }
            return heights;
        }

        static Vector3 ToVector(double x, double y, double z)
        {
            return new Vector3((float)x, (float)y, (float)z);
        }

        static double[] Apply(double[] m, double x, double y, double z)
        {
            var to = new double[3];
            for (var row = 0; row < 3; row++) to[row] = m[4 * row] * x + m[4 * row + 1] * y + m[4 * row + 2] * z + m[4 * row + 3];
            return to;
        }

        static double[] Inverse(double[] m)
        {
            var inverse = new double[12];
            double determinant = 0;
            for (var column = 0; column < 3; column++)
            {
                int a = (column + 1) % 3, b = (column + 2) % 3;
                for (var row = 0; row < 3; row++)
                {
                    int c = (row + 1) % 3, d = (row + 2) % 3;
                    inverse[4 * column + row] = m[4 * c + a] * m[4 * d + b] - m[4 * c + b] * m[4 * d + a];
                }
                determinant += m[column] * inverse[4 * column];
            }
            if (Math.Abs(determinant) < 1e-30) throw new BundleException("the matrix of a volume can't be inverted. Build the bundle again.");
            for (var row = 0; row < 3; row++)
            {
                for (var i = 0; i < 3; i++) inverse[4 * row + i] /= determinant;
                for (var i = 0; i < 3; i++) inverse[4 * row + 3] -= inverse[4 * row + i] * m[4 * i + 3];
            }
            return inverse;
        }
    }
}
