// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Text;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>The edits of one channel. A value that was not edited is null.</summary>
    public sealed class ChannelEdit
    {
        public string Id;

        /// <summary>Linear RGB.</summary>
        public Color? Color;

        public bool? IsVisible;

        /// <summary>Name of the chosen transfer function.</summary>
        public string Function;

        /// <summary>Points of the edited transfer functions, by name.</summary>
        public Dictionary<string, List<Vector2>> Points = new Dictionary<string, List<Vector2>>();

        public bool IsEmpty
        {
            get { return Color == null && IsVisible == null && Function == null && Points.Count == 0; }
        }
    }

    /// <summary>
    /// Writes edits of channels as a USD layer over the stage, for `stereocell bundle OUT --stage layer.usda`. The layer
    /// holds only edited values; all others come from the stage.
    /// </summary>
    public static class StageLayer
    {
        /// <param name="layer">Path of the layer. The layer refers to the stage by a path relative to it.</param>
        public static string Text(string layer, string stage, IEnumerable<ChannelEdit> edits)
        {
            var all = edits.Where(edit => !edit.IsEmpty).ToList();
            var text = new StringBuilder("#usda 1.0\n(\n    defaultPrim = \"Specimen\"\n    metersPerUnit = 0.000001\n");
            text.Append("    subLayers = [" + Quoted(BundleFiles.RelativePath(layer, stage)) + "]\n    upAxis = \"Y\"\n)\n\nover \"Specimen\"\n{\n");
            var looks = all.Where(edit => edit.Color != null || edit.Function != null || edit.Points.Count > 0).ToList();
            if (looks.Count > 0) AppendGroup(text, "Channels", looks, AppendLook);
            var shown = all.Where(edit => edit.IsVisible != null).ToList();
            if (shown.Count > 0) AppendGroup(text, "Shown", shown, AppendVisibility);
            return text.Append("}\n").ToString();
        }

        static void AppendGroup(StringBuilder text, string name, List<ChannelEdit> edits, System.Action<StringBuilder, ChannelEdit> append)
        {
            text.Append("    over \"" + name + "\"\n    {\n");
            foreach (var edit in edits) append(text, edit);
            text.Append("    }\n");
        }

        static void AppendLook(StringBuilder text, ChannelEdit edit)
        {
            text.Append("        over \"" + edit.Id + "\"");
            var metadata = "";
            if (edit.Function != null)
            {
                metadata += "            variants = {\n                string transferFunction = \"" + edit.Function + "\"\n            }\n";
            }
            if (edit.Points.Count > 0)
            {
                // USD ignores the variants of a set that their layer does not list.
                metadata += "            prepend variantSets = \"transferFunction\"\n";
            }
            if (metadata.Length > 0)
            {
                text.Append(" (\n" + metadata + "        )");
            }
            text.Append("\n        {\n");
            if (edit.Color != null)
            {
                var color = edit.Color.Value;
                text.Append("            color3f inputs:color = (" + Number(color.r) + ", " + Number(color.g) + ", " + Number(color.b) + ")\n");
            }
            if (edit.Points.Count > 0)
            {
                text.Append("            variantSet \"transferFunction\" = {\n");
                foreach (var function in edit.Points)
                {
                    var pairs = function.Value.Select(point => "(" + Number(point.x) + ", " + Number(point.y) + ")").ToArray();
                    text.Append("                \"" + function.Key + "\" {\n                    float2[] stereocell:opacityPoints = ["
                        + string.Join(", ", pairs) + "]\n                }\n");
                }
                text.Append("            }\n");
            }
            text.Append("        }\n");
        }

        static void AppendVisibility(StringBuilder text, ChannelEdit edit)
        {
            text.Append("        over \"" + edit.Id + "\"\n        {\n            token visibility = \""
                + (edit.IsVisible.Value ? "inherited" : "invisible") + "\"\n        }\n");
        }

        static string Number(float value)
        {
            return value.ToString("R", CultureInfo.InvariantCulture);
        }

        static string Quoted(string path)
        {
            return path.Contains("@") ? "@@@" + path + "@@@" : "@" + path + "@";
        }
    }
}
