// Converts transfer functions between points, curves and gradients, and drives the window that writes a layer.
using System;
using System.Collections.Generic;
using System.Linq;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Editor;
using UnityEditor;
using UnityEngine;

static class Functions
{
    /// <summary>For each row of 256 opacities, return its points, and the row again after a conversion to points, to a
    /// curve and to a gradient.</summary>
    public static JToken Points(JArray rows)
    {
        var found = new JArray();
        foreach (var row in rows)
        {
            var rgba = row.SelectMany(value => new byte[] { 255, 255, 255, (byte)value }).ToArray();
            var points = OpacityPoints.OfRow(rgba, 0);
            var gradient = OpacityPoints.ToGradient(points, Color.white);
            found.Add(new JObject(
                new JProperty("points", Pairs(points)),
                new JProperty("row", Bytes(OpacityPoints.Row(points))),
                new JProperty("curve", Bytes(OpacityPoints.Row(OpacityPoints.OfCurve(OpacityPoints.ToCurve(points))))),
                new JProperty("keys", gradient.alphaKeys.Length),
                new JProperty("gradient", Bytes(OpacityPoints.Row(OpacityPoints.OfGradient(gradient))))));
        }
        return found;
    }

    static JArray Bytes(byte[] row)
    {
        return new JArray(row.Select(value => (int)value));
    }

    static JArray Pairs(IEnumerable<Vector2> points)
    {
        return new JArray(points.Select(point => new JArray(point.x, point.y)));
    }

    /// <summary>
    /// Open the window on an imported bundle, change one field in each frame, and write the layer. A frame is
    /// {"field": label, ...} with the "points" of a curve or gradient, the "colors" of a gradient, or a "value".
    /// </summary>
    public static JToken Layer(string folder, string stage, string layer, JArray frames)
    {
        var made = Importing.Link(folder);
        var specimen = made.GetComponent<Specimen>();
        Selection.activeObject = made;
        var window = new TransferFunctionWindow();
        window.Edit(specimen);
        foreach (var frame in frames)
        {
            EditorGUILayout.Changes[(string)frame["field"]] = Change((JObject)frame);
            EditorGUILayout.Drawn.Clear();
            Program.Send(window, "OnGUI");
            if (EditorGUILayout.Changes.Count > 0) throw new ArgumentException("there is no field " + frame["field"]);
        }
        EditorGUILayout.Drawn.Clear();
        Program.Send(window, "OnGUI");
        return new JObject(
            new JProperty("drawn", new JArray(EditorGUILayout.Drawn)),
            new JProperty("message", window.WriteLayer(layer, stage)),
            new JProperty("imported", Dumping.Dump(specimen.table)),
            new JProperty("shown", Dumping.Dump(specimen.Table)));
    }

    static object Change(JObject frame)
    {
        if (frame["value"] != null) return frame["value"].Type == JTokenType.Boolean ? (object)(bool)frame["value"] : (int)frame["value"];
        var points = frame["points"] == null ? null : frame["points"].Select(pair => new Vector2((float)pair[0], (float)pair[1])).ToList();
        var colors = frame["colors"] == null ? null : frame["colors"].Select(color => new Color((float)color[0], (float)color[1], (float)color[2], 1)).ToArray();
        if (colors == null) return OpacityPoints.ToCurve(points);
        return new Func<Gradient, Gradient>(before =>
        {
            var keys = colors.Select((color, i) => new GradientColorKey(color, i / (float)Math.Max(1, colors.Length - 1))).ToArray();
            var alphas = points == null ? before.alphaKeys : points.Select(point => new GradientAlphaKey(point.y, point.x)).ToArray();
            before.SetKeys(keys, alphas);
            return before;
        });
    }
}
