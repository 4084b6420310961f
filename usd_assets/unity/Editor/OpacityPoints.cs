// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>
    /// Converts between Unity's curves and gradients and the points of the stage. A point is a pair of intensity and
    /// opacity, both 0 to 1. Straight lines connect the points.
    /// </summary>
    public static class OpacityPoints
    {
        public const int Samples = 256;
        const int MostOfGradient = 8;  // largest number of keys of a gradient in Unity

        /// <summary>Opacity. Largest error of a function that is read from a table. The ends of a line and the samples are
        /// each rounded by up to half an 8-bit step.</summary>
        const float ToleranceOfTable = 1.01f / 255;

        /// <summary>Opacity. Largest error of a function that is drawn as a curve.</summary>
        const float ToleranceOfCurve = 0.1f / 255;

        /// <summary>A small set of points whose lines lie within the tolerance of all samples. The first and the last sample
        /// are always points.</summary>
        static List<Vector2> Of(IList<float> samples, float tolerance)
        {
            var points = new List<Vector2>();
            Keep(samples, 0, samples.Count - 1, tolerance, points);
            points.Add(At(samples, samples.Count - 1));
            return points;
        }

        /// <summary>The points of the transfer function in one row of the table.</summary>
        /// <param name="rgba">Bytes of the table.</param>
        /// <param name="first">Index of the row's first byte.</param>
        public static List<Vector2> OfRow(byte[] rgba, int first)
        {
            var samples = new float[Samples];
            for (var i = 0; i < Samples; i++) samples[i] = rgba[first + 4 * i + 3] / 255f;
            return Of(samples, ToleranceOfTable);
        }

        /// <summary>The points of a curve: its keys if straight lines connect them, otherwise points that follow its
        /// bends.</summary>
        public static List<Vector2> OfCurve(AnimationCurve curve)
        {
            var keys = new List<Vector2>();
            foreach (var key in curve.keys) keys.Add(new Vector2(Mathf.Clamp01(key.time), Mathf.Clamp01(key.value)));
            var samples = new float[Samples];
            var areLines = keys.Count > 0;
            for (var i = 0; i < Samples; i++)
            {
                var intensity = i / (Samples - 1f);
                samples[i] = Mathf.Clamp01(curve.Evaluate(intensity));
                areLines = areLines && Math.Abs(Evaluate(keys, intensity) - samples[i]) < ToleranceOfCurve;
            }
            return areLines ? keys : Of(samples, ToleranceOfCurve);
        }

        /// <summary>The points of a gradient's opacity, which has straight lines between its keys.</summary>
        public static List<Vector2> OfGradient(Gradient gradient)
        {
            var points = new List<Vector2>();
            foreach (var key in gradient.alphaKeys) points.Add(new Vector2(key.time, key.alpha));
            return points;
        }

        public static double Evaluate(IList<Vector2> points, double intensity)
        {
            if (intensity <= points[0].x) return points[0].y;
            for (var i = 1; i < points.Count; i++)
            {
                if (intensity > points[i].x) continue;
                double width = (double)points[i].x - points[i - 1].x;
                var share = width > 0 ? (intensity - points[i - 1].x) / width : 1;
                return points[i - 1].y + share * ((double)points[i].y - points[i - 1].y);
            }
            return points[points.Count - 1].y;
        }

        /// <summary>The alpha bytes of a row of the table, rounded as in the bundle's own table.</summary>
        public static byte[] Row(IList<Vector2> points)
        {
            var row = new byte[Samples];
            for (var i = 0; i < Samples; i++) row[i] = (byte)Math.Round(255 * Evaluate(points, i / (Samples - 1.0)));
            return row;
        }

        public static AnimationCurve ToCurve(IList<Vector2> points)
        {
            var keys = new Keyframe[points.Count];
            for (var i = 0; i < keys.Length; i++)
            {
                keys[i] = new Keyframe(points[i].x, points[i].y, Slope(points, i - 1), Slope(points, i));
            }
            return new AnimationCurve(keys);
        }

        /// <summary>A gradient with these points. Unity allows eight keys; the points whose removal changes the function
        /// least are dropped.</summary>
        public static Gradient ToGradient(List<Vector2> points, Color color)
        {
            var kept = new List<Vector2>(points);
            while (kept.Count > MostOfGradient) kept.RemoveAt(LeastNeeded(kept));
            var gradient = new Gradient();
            gradient.SetKeys(
                new[] { new GradientColorKey(color, 0), new GradientColorKey(color, 1) },
                kept.ConvertAll(point => new GradientAlphaKey(point.y, point.x)).ToArray());
            return gradient;
        }

        /// <summary>The one colour of a gradient.</summary>
        /// <exception cref="ArgumentException">The gradient has several colours; a channel of the stage has one.</exception>
        public static Color ColorOf(Gradient gradient)
        {
            var keys = gradient.colorKeys;
            foreach (var key in keys)
            {
                if (key.color != keys[0].color) throw new ArgumentException("found several colours, expected one, because a channel has one colour in the stage.");
            }
            return keys[0].color;
        }

        static float Slope(IList<Vector2> points, int i)
        {
            if (i < 0 || i + 1 >= points.Count) return 0;
            var width = points[i + 1].x - points[i].x;
            return width > 0 ? (points[i + 1].y - points[i].y) / width : float.PositiveInfinity;  // a step
        }

        static int LeastNeeded(List<Vector2> points)
        {
            var least = 1;
            var smallest = double.MaxValue;
            for (var i = 1; i + 1 < points.Count; i++)
            {
                var without = new[] { points[i - 1], points[i + 1] };
                var loss = Math.Abs(points[i].y - Evaluate(without, points[i].x)) * (points[i + 1].x - points[i - 1].x);
                if (loss >= smallest) continue;
                smallest = loss;
                least = i;
            }
            return least;
        }

        static Vector2 At(IList<float> samples, int i)
        {
            return new Vector2(i / (samples.Count - 1f), samples[i]);
        }

        /// <summary>Douglas and Peucker's simplification (1973) by the error of opacity. The caller adds the last
        /// sample.</summary>
        static void Keep(IList<float> samples, int first, int last, float tolerance, List<Vector2> points)
        {
            var worst = first;
            float most = tolerance;
            for (var i = first + 1; i < last; i++)
            {
                var share = (float)(i - first) / (last - first);
                var error = Math.Abs(samples[i] - (samples[first] + share * (samples[last] - samples[first])));
                if (error <= most) continue;
                most = error;
                worst = i;
            }
            if (worst == first)
            {
                points.Add(At(samples, first));
                return;
            }
            Keep(samples, first, worst, tolerance, points);
            Keep(samples, worst, last, tolerance, points);
        }
    }
}
