// Returns the screen heights of levels of detail, the order of blending, and the Inspector's line for a channel.
using System.Collections.Generic;
using System.Linq;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Editor;
using UnityEditor;
using UnityEngine;

static class Placing
{
    public static JToken Heights(string[] args)
    {
        var errors = args[1].Split(',').Select(double.Parse);
        var levels = errors.Select(error => new Level { ErrorMetres = error }).ToList();
        return new JArray(Placement.LodHeights(levels, double.Parse(args[2]), double.Parse(args[3]), double.Parse(args[4])));
    }

    // Returns for each eye the sorting order of every box. Boxes are [[min, max], ...].
    public static JToken Sort(JArray corners, JArray eyes)
    {
        var root = new GameObject("specimen");
        var specimen = root.AddComponent<Specimen>();
        var renderers = new List<Renderer>();
        foreach (var corner in corners)
        {
            float[] min = corner[0].ToObject<float[]>(), max = corner[1].ToObject<float[]>();
            var box = new GameObject("box");
            box.transform.SetParent(root.transform, false);
            box.transform.localPosition = new Vector3(min[0], min[1], min[2]);
            var renderer = box.AddComponent<MeshRenderer>();
            renderer.sharedMaterial = new Material((Shader)null);
            renderer.sharedMaterial.SetVector("_Size", new Vector4(max[0] - min[0], max[1] - min[1], max[2] - min[2], 0));
            renderer.sharedMaterial.SetVector("_ToBox0", new Vector4(1, 0, 0, 0));
            renderer.sharedMaterial.SetVector("_ToBox1", new Vector4(0, 1, 0, 0));
            renderer.sharedMaterial.SetVector("_ToBox2", new Vector4(0, 0, 1, 0));
            box.AddComponent<VolumeBox>();
            renderers.Add(renderer);
        }
        var found = new JArray();
        foreach (var eye in eyes)
        {
            specimen.SortFrom(new Vector3((float)eye[0], (float)eye[1], (float)eye[2]));
            found.Add(new JArray(renderers.Select(renderer => renderer.sortingOrder)));
        }
        return found;
    }

    // Returns the fields that the Inspector draws for a channel, and its values after a click on each field.
    public static JToken Drawer()
    {
        var channel = new Channel { name = "CD31", functions = new[] { "default", "sharp" } };
        new ChannelDrawer().OnGUI(new Rect { width = 100 }, new SerializedProperty(channel), GUIContent.none);
        return new JObject(new JProperty("drawn", new JArray(EditorGUI.Drawn)), new JProperty("visible", channel.isVisible), new JProperty("function", channel.function));
    }
}
