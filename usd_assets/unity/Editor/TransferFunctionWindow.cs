// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using UnityEditor;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>
    /// Edits a specimen's transfer functions as a curve of opacity and as a gradient of colour and opacity. The scene shows
    /// each change at once. *Write layer...* writes a USD layer with the edits of colour, opacity and visibility, and with
    /// the chosen functions.
    /// </summary>
    public sealed class TransferFunctionWindow : EditorWindow
    {
        static readonly Rect Unit = new Rect(0, 0, 1, 1);

        [SerializeField] Specimen specimen;
        [SerializeField] string note = "";

        /// <summary>Edited points, by channel and then by function.</summary>
        readonly Dictionary<string, Dictionary<string, List<Vector2>>> edited = new Dictionary<string, Dictionary<string, List<Vector2>>>();
        Vector2 scroll;

        [MenuItem("Window/StereoCell/Transfer Functions")]
        public static void Open()
        {
            var window = GetWindow<TransferFunctionWindow>("Transfer functions");
            if (Selection.activeGameObject != null) window.Edit(Selection.activeGameObject.GetComponentInParent<Specimen>(true));
        }

        public void Edit(Specimen chosen)
        {
            if (chosen == specimen) return;
            specimen = chosen;
            edited.Clear();
            note = "";
        }

        void OnGUI()
        {
            Edit((Specimen)EditorGUILayout.ObjectField("Specimen", specimen, typeof(Specimen), true));
            if (specimen == null || specimen.table == null)
            {
                EditorGUILayout.HelpBox("Choose a specimen in the scene.", MessageType.Info);
                return;
            }
            scroll = EditorGUILayout.BeginScrollView(scroll);
            foreach (var channel in specimen.channels) Draw(channel);
            EditorGUILayout.EndScrollView();
            if (GUILayout.Button("Write layer...")) ChooseLayer();
            if (note != "") EditorGUILayout.HelpBox(note, MessageType.Info);
        }

        void Draw(Channel channel)
        {
            Undo.RecordObject(specimen, "Edit transfer function");
            EditorGUI.BeginChangeCheck();
            channel.isVisible = EditorGUILayout.ToggleLeft(channel.name, channel.isVisible);
            channel.function = EditorGUILayout.Popup("Function", channel.function, channel.functions);
            var points = PointsOf(channel);

            var curve = OpacityPoints.ToCurve(points);
            EditorGUI.BeginChangeCheck();
            curve = EditorGUILayout.CurveField("Opacity", curve, channel.color, Unit);
            if (EditorGUI.EndChangeCheck()) Set(channel, OpacityPoints.OfCurve(curve));

            var offered = OpacityPoints.ToGradient(PointsOf(channel), channel.color);
            EditorGUI.BeginChangeCheck();
            var gradient = EditorGUILayout.GradientField("Colour and opacity", OpacityPoints.ToGradient(PointsOf(channel), channel.color));
            if (EditorGUI.EndChangeCheck()) Set(channel, offered, gradient);

            if (!EditorGUI.EndChangeCheck()) return;
            EditorUtility.SetDirty(specimen);
            specimen.Apply();
        }

        void Set(Channel channel, Gradient offered, Gradient gradient)
        {
            try
            {
                channel.color = OpacityPoints.ColorOf(gradient);
                // A gradient has at most eight keys. If only the colour was edited, the points are left alone, so a
                // function with more points does not lose any.
                var points = OpacityPoints.OfGradient(gradient);
                if (!OpacityPoints.OfGradient(offered).SequenceEqual(points)) Set(channel, points);
                note = "";
            }
            catch (ArgumentException error)
            {
                note = channel.name + ": " + error.Message;
            }
        }

        void Set(Channel channel, List<Vector2> points)
        {
            if (!edited.ContainsKey(channel.id)) edited.Add(channel.id, new Dictionary<string, List<Vector2>>());
            edited[channel.id][channel.functions[channel.function]] = points;
            specimen.SetOpacity(channel.id, channel.functions[channel.function], OpacityPoints.Row(points));
        }

        List<Vector2> PointsOf(Channel channel)
        {
            Dictionary<string, List<Vector2>> functions;
            List<Vector2> points;
            if (edited.TryGetValue(channel.id, out functions) && functions.TryGetValue(channel.functions[channel.function], out points)) return points;
            return OpacityPoints.OfRow(specimen.table.GetRawTextureData(), 4 * OpacityPoints.Samples * (channel.firstRow + channel.function));
        }

        void ChooseLayer()
        {
            var stage = StageOf(specimen);
            if (stage == null) stage = EditorUtility.OpenFilePanel("Choose stage.usda, from which the bundle was made", "", "usda");
            if (string.IsNullOrEmpty(stage)) return;
            var layer = EditorUtility.SaveFilePanel("Write the edits as a USD layer", Path.GetDirectoryName(Path.GetDirectoryName(stage)), "from_unity", "usda");
            if (string.IsNullOrEmpty(layer)) return;
            note = WriteLayer(layer, stage);
        }

        /// <summary>Write the edits as a layer. Returns a line for the user about the file and the next step.</summary>
        public string WriteLayer(string layer, string stage)
        {
            var edits = Edits();
            if (edits.Count == 0) return "Nothing was edited, so no layer was written.";
            if (Path.GetFullPath(layer) == Path.GetFullPath(stage)) return layer + " is the stage itself. Choose another name.";
            File.WriteAllText(layer, StageLayer.Text(layer, stage, edits));
            return "Wrote " + layer + ". Next, run: stereocell bundle OUT --stage " + layer;
        }

        public List<ChannelEdit> Edits()
        {
            return specimen.channels.Select(EditOf).Where(edit => !edit.IsEmpty).ToList();
        }

        ChannelEdit EditOf(Channel channel)
        {
            var edit = new ChannelEdit { Id = channel.id };
            if (channel.color != channel.importedColor) edit.Color = channel.color.linear;
            if (channel.isVisible != channel.importedVisible) edit.IsVisible = channel.isVisible;
            if (channel.function != channel.importedFunction) edit.Function = channel.functions[channel.function];
            if (edited.ContainsKey(channel.id)) edit.Points = edited[channel.id];
            return edit;
        }

        /// <summary>Path of the stage beside a linked bundle: OUT/stage/stage.usda for OUT/bundle. Null if there is
        /// none.</summary>
        static string StageOf(Specimen specimen)
        {
            var box = specimen.GetComponentsInChildren<VolumeBox>(true).FirstOrDefault();
            var asset = box == null ? "" : AssetDatabase.GUIDToAssetPath(box.specimenGuid);
            var folder = string.IsNullOrEmpty(asset) ? null : BundleFiles.LinkedFolder(asset);
            if (folder == null) return null;
            var stage = Path.Combine(Path.GetDirectoryName(folder), "stage", "stage.usda");
            return File.Exists(stage) ? stage : null;
        }
    }
}
